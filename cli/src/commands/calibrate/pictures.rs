//! Pictures and videos, one frame after another.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::Args;
use rowtone_clip::pts;
use rowtone_clip::y4m::{Next, Reader};
use rowtone_failure::Failure;

/// The value of white: 255, or all ones of the depth that the values need.
pub(super) fn full_scale(picture: &[u16]) -> u16 {
    let top = picture.iter().copied().max().unwrap_or(0).max(255);
    ((u32::from(top) + 1).next_power_of_two() - 1) as u16
}

/// When the pictures were taken.
pub(super) struct Info {
    pub(super) times_s: Option<Vec<f64>>,
    pub(super) fps: Option<f64>,
    /// Rows of a whole picture.
    pub(super) picture_rows: Option<usize>,
}

/// Hands out each picture (the part to use) with its width.
pub(super) fn each_picture(
    args: &Args,
    mut sink: impl FnMut(&[u16], usize),
) -> Result<Info, Failure> {
    let [name] = &args.input[..] else {
        return each_of_several(args, &mut sink);
    };
    if is_picture(name) {
        let (_, height) = picture(args, name, &mut sink)?;
        return Ok(Info {
            times_s: None,
            fps: args.fps,
            picture_rows: Some(height),
        });
    }
    if name == "-" {
        return each_frame(args, "standard input", io::stdin().lock(), sink);
    }
    let file =
        File::open(name).map_err(|e| Failure::input(format!("{name}: cannot be opened: {e}")))?;
    each_frame(args, name, io::BufReader::new(file), sink)
}

/// By its extension.
fn is_picture(name: &str) -> bool {
    let extension = Path::new(name).extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| ["png", "jpg", "jpeg"].contains(&e.to_lowercase().as_str()))
}

/// Several pictures, all alike; when each was taken is not known.
fn each_of_several(args: &Args, sink: &mut impl FnMut(&[u16], usize)) -> Result<Info, Failure> {
    let mut first = None;
    for name in args.input.iter().take(args.frames) {
        if !is_picture(name) {
            return Err(Failure::usage(format!(
                "{name}: several inputs must all be PNG or JPEG pictures"
            )));
        }
        let size = picture(args, name, sink)?;
        let (other, expected) = first.get_or_insert((name, size));
        if size != *expected {
            return Err(Failure::input(format!(
                "{name}: is {}x{}, {other} is {}x{}: give pictures of one camera and mode",
                size.0, size.1, expected.0, expected.1
            )));
        }
    }
    Ok(Info {
        times_s: None,
        fps: args.fps,
        picture_rows: first.map(|(_, (_, height))| height),
    })
}

/// One picture; its size.
fn picture(
    args: &Args,
    name: &str,
    sink: &mut impl FnMut(&[u16], usize),
) -> Result<(usize, usize), Failure> {
    let picture = image::open(name)
        .map_err(|e| Failure::input(format!("{name}: cannot be read as a picture: {e}")))?
        .to_luma16();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    // Back to 8 bit, so that saturation is at 255 as in a video.
    let values: Vec<u16> = picture
        .into_raw()
        .into_iter()
        .map(|v| (f32::from(v) / 257.0).round() as u16)
        .collect();
    hand_out(args, &values, width, height, sink)?;
    Ok((width, height))
}

/// The frames of a Y4M stream.
fn each_frame(
    args: &Args,
    name: &str,
    from: impl Read,
    mut sink: impl FnMut(&[u16], usize),
) -> Result<Info, Failure> {
    let mut reader = Reader::open(from, name)?;
    let (width, height, bits) = (
        reader.header().width,
        reader.header().height,
        reader.header().format.bits,
    );
    let fps = args.fps.or(reader.header().fps);
    let given: Option<Vec<i64>> = args.pts.as_deref().map(pts::read).transpose()?;
    let mut buffer = Vec::new();
    let mut values = vec![0u16; width * height];
    let mut count = 0;
    while count < args.frames {
        match reader.read_frame(&mut buffer)? {
            Next::Frame { luma } => {
                let bytes = &buffer[luma..];
                if bits > 8 {
                    for (value, pair) in values.iter_mut().zip(bytes.chunks_exact(2)) {
                        *value = u16::from_le_bytes([pair[0], pair[1]]);
                    }
                } else {
                    for (value, &byte) in values.iter_mut().zip(bytes) {
                        *value = u16::from(byte);
                    }
                }
                hand_out(args, &values, width, height, &mut sink)?;
                count += 1;
            }
            Next::End => break,
            Next::Truncated { have, need } => {
                eprintln!(
                    "rowtone: warning: {name}: ends inside frame {count} ({have} of {need} bytes)"
                );
                break;
            }
        }
    }
    let times_s = match (given, fps) {
        (Some(times), _) if times.len() < count => {
            return Err(Failure::input(format!(
                "{name}: {count} frames, but only {} times in --pts",
                times.len()
            )));
        }
        (Some(times), _) => Some(
            times[..count]
                .iter()
                .map(|&t| (t - times[0]) as f64 * 1e-9)
                .collect(),
        ),
        (None, Some(fps)) => Some((0..count).map(|n| n as f64 / fps).collect()),
        (None, None) => None,
    };
    Ok(Info {
        times_s: times_s.filter(|t: &Vec<f64>| t.len() > 1),
        fps,
        picture_rows: Some(height),
    })
}

/// Cuts the part to use out of a picture.
fn hand_out(
    args: &Args,
    values: &[u16],
    width: usize,
    height: usize,
    sink: &mut impl FnMut(&[u16], usize),
) -> Result<(), Failure> {
    let Some(part) = args.roi else {
        sink(values, width);
        return Ok(());
    };
    if !part.fits(width, height) {
        return Err(Failure::usage(format!(
            "--roi is not inside the picture of {width}x{height}"
        )));
    }
    let rows = values.chunks_exact(width).skip(part.y).take(part.height);
    let cut: Vec<u16> = rows
        .flat_map(|row| row[part.x..part.x + part.width].iter().copied())
        .collect();
    sink(&cut, part.width);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_all_ones() {
        assert_eq!(full_scale(&[3, 200]), 255);
        assert_eq!(full_scale(&[3, 1000]), 1023);
        assert_eq!(full_scale(&[65535]), 65535);
    }
}
