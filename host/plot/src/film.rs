//! An animation as a file: GIF, which every browser plays, or Y4M.

use std::borrow::Cow;

use gif::{DisposalMethod, Encoder, Repeat};

use crate::animation::{Animation, PERIOD_S};
use crate::error::DrawError;

/// Frames of a period in a GIF, whose times are in hundredths of a second.
const GIF_FRAMES: usize = 24;
/// Frames a second of a video, and its periods.
const FPS: usize = 25;
const PERIODS: usize = 3;
/// Greys of the palette, and steps of red, green and blue beside them; the first entry is transparent.
const GREYS: usize = 63;
const STEPS: [usize; 3] = [6, 8, 4];

/// The animation as a GIF that goes on for ever. What does not change from one frame to the next is transparent.
///
/// # Errors
/// What the encoder says.
pub fn gif(animation: &Animation<'_>) -> Result<Vec<u8>, DrawError> {
    let [width, height] = animation.size();
    let (columns, rows) = (u16::try_from(width)?, u16::try_from(height)?);
    let palette = Palette::new();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, columns, rows, &palette.colours.concat())?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut before: Option<Vec<u8>> = None;
    for k in 0..GIF_FRAMES {
        let pixels = animation.frame(k as f64 / GIF_FRAMES as f64);
        let indices = palette.indices(&pixels);
        let mut shown = indices.clone();
        if let Some(before) = &before {
            for (shown, before) in shown.iter_mut().zip(before) {
                if shown == before {
                    *shown = 0;
                }
            }
        }
        encoder.write_frame(&gif::Frame {
            width: columns,
            height: rows,
            delay: (PERIOD_S * 100.0 / GIF_FRAMES as f64).round() as u16,
            dispose: DisposalMethod::Keep,
            transparent: Some(0),
            buffer: Cow::Owned(shown),
            ..gif::Frame::default()
        })?;
        before = Some(indices);
    }
    drop(encoder);
    Ok(bytes)
}

/// The animation as a Y4M of three periods: 25 frames a second, full-range colour in all pixels.
pub fn y4m(animation: &Animation<'_>) -> Vec<u8> {
    let [width, height] = animation.size();
    let head = format!("YUV4MPEG2 W{width} H{height} F{FPS}:1 Ip A1:1 C444 XCOLORRANGE=FULL\n");
    let mut bytes = head.into_bytes();
    let frames = (PERIOD_S * FPS as f64).round() as usize;
    for k in 0..frames * PERIODS {
        let pixels = animation.frame(k as f64 / frames as f64);
        bytes.extend_from_slice(b"FRAME\n");
        // ITU-R BT.601, full range.
        for [r, g, b, offset] in [
            [0.299, 0.587, 0.114, 0.0],
            [-0.168_736, -0.331_264, 0.5, 128.0],
            [0.5, -0.418_688, -0.081_312, 128.0],
        ] {
            let value = |p: &[u8]| {
                let [red, green, blue] = [p[0], p[1], p[2]].map(f64::from);
                (r * red + g * green + b * blue + offset).round() as u8
            };
            bytes.extend(pixels.chunks_exact(3).map(value));
        }
    }
    bytes
}

/// Greys, and colours in even steps.
struct Palette {
    colours: Vec<[u8; 3]>,
    /// The nearest entry, for five bits of each colour.
    nearest: Vec<u8>,
}

impl Palette {
    fn new() -> Self {
        let step = |k: usize, steps: usize| (255 * k / (steps - 1)) as u8;
        let mut colours = vec![[0; 3]];
        colours.extend((0..GREYS).map(|k| [step(k, GREYS); 3]));
        let [reds, greens, blues] = STEPS;
        for r in 0..reds {
            for g in 0..greens {
                colours
                    .extend((0..blues).map(|b| [step(r, reds), step(g, greens), step(b, blues)]));
            }
        }
        let nearest = (0..1 << 15).map(|at: usize| {
            let own = [at >> 10, at >> 5, at].map(|v| ((v & 31) * 255 / 31) as i32);
            let distance = |colour: &[u8; 3]| -> i32 {
                colour
                    .iter()
                    .zip(own)
                    .map(|(&c, own)| (i32::from(c) - own).pow(2))
                    .sum()
            };
            let all = colours.iter().enumerate().skip(1);
            all.min_by_key(|(_, colour)| distance(colour))
                .map_or(1, |(k, _)| k as u8)
        });
        Self {
            nearest: nearest.collect(),
            colours,
        }
    }

    fn indices(&self, pixels: &[u8]) -> Vec<u8> {
        let index = |p: &[u8]| {
            if p[0] == p[1] && p[1] == p[2] {
                return 1 + ((usize::from(p[0]) * (GREYS - 1) + 127) / 255) as u8;
            }
            let five = |v: u8| usize::from(v >> 3);
            self.nearest[five(p[0]) << 10 | five(p[1]) << 5 | five(p[2])]
        };
        pixels.chunks_exact(3).map(index).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Panel, Plate};

    fn plate(picture: &[f32]) -> Plate<'_> {
        Plate {
            picture,
            size: (64, 32),
            tile_px: 16,
            panels: vec![Panel {
                title: "131.700 Hz".to_owned(),
                hz: 131.7,
                tiles: vec![Some([[0.05, 0.0], [0.0, 0.02]]); 8],
            }],
        }
    }

    #[test]
    fn a_colour_of_the_palette_is_itself_and_others_are_near() {
        let palette = Palette::new();
        assert_eq!(palette.colours.len(), 256);
        for pixel in [[0, 0, 0], [200, 200, 200], [255, 0, 85], [253, 231, 37]] {
            let shown = palette.colours[usize::from(palette.indices(&pixel)[0])];
            let far = shown.iter().zip(pixel).map(|(a, b)| a.abs_diff(b)).max();
            assert!(far <= Some(43), "{pixel:?} {shown:?}");
        }
        assert!(
            !palette.indices(&[7; 300]).contains(&0),
            "nothing is transparent"
        );
    }

    #[test]
    fn a_gif_has_all_frames_goes_on_for_ever_and_shows_what_was_drawn() {
        let picture = vec![100.0; 64 * 32];
        let plate = plate(&picture);
        let animation = Animation::new(&plate).expect("a drawing");
        let bytes = gif(&animation).expect("a GIF");
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes.as_slice()).expect("a GIF");
        assert_eq!(decoder.repeat(), Repeat::Infinite);
        let [width, height] = animation.size();
        let mut shown = vec![0; 3 * width * height];
        let mut frames = 0;
        while let Some(frame) = decoder.read_next_frame().expect("a frame") {
            for (shown, new) in shown.chunks_exact_mut(3).zip(frame.buffer.chunks_exact(4)) {
                if new[3] > 0 {
                    shown.copy_from_slice(&new[..3]);
                }
            }
            let drawn = animation.frame(frames as f64 / GIF_FRAMES as f64);
            let far = shown.iter().zip(&drawn).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(far <= Some(48), "frame {frames}: {far:?}");
            frames += 1;
        }
        assert_eq!(frames, GIF_FRAMES);
    }

    #[test]
    fn a_video_has_three_periods_of_three_planes() {
        let picture = vec![100.0; 64 * 32];
        let plate = plate(&picture);
        let animation = Animation::new(&plate).expect("a drawing");
        let bytes = y4m(&animation);
        let [width, height] = animation.size();
        let head = bytes.iter().position(|&b| b == b'\n').expect("a line") + 1;
        assert_eq!(bytes.len(), head + 144 * (6 + 3 * width * height));
    }
}
