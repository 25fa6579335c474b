//! Pictures and videos, one frame after another.

use std::path::Path;

use super::Args;
use crate::failure::Failure;
use rowtone::camera::Pixels;
use rowtone_clip::picture::{self, Grey};
use rowtone_clip::{CameraOptions, Feed, Rect};

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

/// Hands out each picture (the part to use, turned) with its width, until the sink says that it is enough.
pub(super) fn each_picture(
    args: &Args,
    mut sink: impl FnMut(&[u16], usize) -> bool,
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
    each_frame(args, name, sink)
}

/// By its extension.
fn is_picture(name: &str) -> bool {
    let extension = Path::new(name).extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| ["png", "jpg", "jpeg"].contains(&e.to_lowercase().as_str()))
}

/// Several pictures, all alike; when each was taken is not known.
fn each_of_several(
    args: &Args,
    sink: &mut impl FnMut(&[u16], usize) -> bool,
) -> Result<Info, Failure> {
    let mut first = None;
    for name in args.input.iter().take(most_frames(args)) {
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
    sink: &mut impl FnMut(&[u16], usize) -> bool,
) -> Result<(usize, usize), Failure> {
    let Grey {
        width,
        height,
        values,
    } = picture::read(Path::new(name))
        .map_err(|e| Failure::input(format!("{name}: cannot be read as a picture: {e}")))?;
    // Back to 8 bit, so that saturation is at 255 as in a video.
    let values: Vec<u16> = values
        .into_iter()
        .map(|v| (f32::from(v) / 257.0).round() as u16)
        .collect();
    let whole = Rect::whole(width, height);
    let part = args.roi.unwrap_or(whole);
    if !part.fits(width, height) {
        return Err(beyond(width, height));
    }
    let mut turned = Vec::new();
    args.rotate.plane(&values, width, height, &mut turned);
    let part = args.rotate.part(part, width, height);
    let size = args.rotate.size(width, height);
    hand_out(part, &turned, size.0, sink);
    Ok(size)
}

/// The frames of a video.
fn each_frame(
    args: &Args,
    name: &str,
    mut sink: impl FnMut(&[u16], usize) -> bool,
) -> Result<Info, Failure> {
    let options = CameraOptions {
        fps: args.fps,
        pts: args.pts.clone(),
        rotate: args.rotate,
        // The line time is what is looked for.
        global_shutter: true,
        ..CameraOptions::of(name)
    };
    let mut feed = Feed::open(&options)?;
    feed.stop_when(crate::stop::on_signals());
    for note in &feed.notes {
        eprintln!("rowtone: {}: {note}", feed.name);
    }
    let (width, height) = feed.camera.size;
    let whole = Rect::whole(width, height);
    // Given in the picture before it is turned.
    let given = args.rotate.size(width, height);
    let part = args.roi.unwrap_or(Rect::whole(given.0, given.1));
    if !part.fits(given.0, given.1) {
        return Err(beyond(given.0, given.1));
    }
    let part = args.rotate.part(part, given.0, given.1);
    let mut values = Vec::new();
    let mut starts_ns = Vec::new();
    let mut is_enough = false;
    while !is_enough && starts_ns.len() < most_frames(args) {
        let Some(frame) = feed.next_frame()? else {
            break;
        };
        values.clear();
        for row in 0..height {
            match frame.pixels(&whole, row) {
                Pixels::U8(row) => values.extend(row.iter().map(|&value| u16::from(value))),
                Pixels::U16(row) => values.extend_from_slice(row),
                Pixels::Upper(row) => values.extend(row.iter().map(u16::from)),
            }
        }
        is_enough = !hand_out(part, &values, width, &mut sink);
        starts_ns.push(frame.start_ns);
        feed.recycle(frame);
    }
    if let Some(warning) = feed.warning() {
        eprintln!("rowtone: warning: {warning}");
    }
    let first = starts_ns.first().copied().unwrap_or(0);
    let times = starts_ns.iter().map(|&start| (start - first) as f64 * 1e-9);
    Ok(Info {
        times_s: (starts_ns.len() > 1).then(|| times.collect()),
        fps: Some(feed.camera.fps),
        picture_rows: Some(height),
    })
}

/// Most frames to use.
fn most_frames(args: &Args) -> usize {
    let usual = if args.from_vibration {
        super::VIBRATION_FRAMES
    } else {
        super::FRAMES
    };
    args.frames.unwrap_or(usual)
}

fn beyond(width: usize, height: usize) -> Failure {
    Failure::usage(format!(
        "--roi is not inside the picture of {width}x{height}"
    ))
}

/// Cuts the part to use out of a picture of that width; whether more is wanted.
fn hand_out(
    part: Rect,
    values: &[u16],
    width: usize,
    sink: &mut impl FnMut(&[u16], usize) -> bool,
) -> bool {
    let rows = values.chunks_exact(width).skip(part.y).take(part.height);
    let cut: Vec<u16> = rows
        .flat_map(|row| row[part.x..part.x + part.width].iter().copied())
        .collect();
    sink(&cut, part.width)
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
