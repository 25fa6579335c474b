//! How bright the picture is, from one row a frame.

use crate::camera::Pixels;

/// Pixels that are looked at in a row, at most: enough for shares of a percent over some frames, and a few hundred
/// instructions of one line in a frame.
const MOST_LOOKED_AT: usize = 32;

/// Rows over which the running mean goes.
const MEAN_OF: f32 = 16.0;

/// How bright the picture is; shares of the largest pixel value and of the pixels, from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Mean pixel value over the largest one.
    pub mean: f32,
    /// Share of the pixels that are at the upper end of their range.
    pub saturated: f32,
}

impl Light {
    /// Before anything was seen: neither dark nor saturated.
    pub(crate) const UNSEEN: Self = Self {
        mean: 0.5,
        saturated: 0.0,
    };

    /// Whether the picture is too dark, or too many of its pixels are saturated.
    pub fn is_bad(&self) -> bool {
        // Raw pixels have a black level of 6 %.
        self.mean < 0.09 || self.saturated > 0.1
    }

    /// Of a row of pixels of so many bits; of some of them, evenly spread, where there are many.
    pub(super) fn of(pixels: &Pixels<'_>, bits: u8) -> Self {
        // Of scattered pixels the upper eight bits are seen.
        let bits = match pixels {
            Pixels::Upper(_) | Pixels::U8(_) => 8,
            Pixels::U16(_) => bits.clamp(1, 16),
        };
        let full = (1_u32 << bits) - 1;
        let high = full - full / 64;
        // Odd, so that both colours of a Bayer row are seen.
        let step = (pixels.len() / MOST_LOOKED_AT) | 1;
        let (mut count, mut sum, mut saturated) = (0_u16, 0_u32, 0_u16);
        let mut add = |value: u16| {
            count += 1;
            sum += u32::from(value);
            saturated += u16::from(u32::from(value) >= high);
        };
        match pixels {
            Pixels::U8(p) => p.iter().step_by(step).for_each(|&p| add(p.into())),
            Pixels::U16(p) => p.iter().step_by(step).for_each(|&p| add(p)),
            Pixels::Upper(p) => p.iter().step_by(step).for_each(|p| add(p.into())),
        }
        let count = f32::from(count.max(1));
        Self {
            mean: sum as f32 / count / full as f32,
            saturated: f32::from(saturated) / count,
        }
    }

    /// Follows what a further row shows: a running mean over some sixteen rows.
    pub(super) fn follow(&mut self, now: Self) {
        self.mean += (now.mean - self.mean) / MEAN_OF;
        self.saturated += (now.saturated - self.saturated) / MEAN_OF;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_depths_are_seen_alike() {
        let bytes = [0_u8, 128, 255, 255, 64, 64, 0, 0];
        let words = bytes.map(|p| u16::from(p) * 257);
        let eight = Light::of(&Pixels::U8(&bytes), 8);
        let sixteen = Light::of(&Pixels::U16(&words), 16);
        assert_eq!(eight.saturated, 0.25);
        assert!((eight.mean - 766.0 / 8.0 / 255.0).abs() < 1e-6);
        assert!((eight.mean - sixteen.mean).abs() < 1e-6);
        assert_eq!(eight.saturated, sixteen.saturated);
    }

    #[test]
    fn long_rows_are_seen_in_part_and_both_colours_of_them() {
        let row: [u8; 4096] = core::array::from_fn(|x| if x % 2 == 0 { 255 } else { 10 });
        let light = Light::of(&Pixels::U8(&row), 8);
        assert!((light.saturated - 0.5).abs() < 0.01, "{light:?}");
    }

    #[test]
    fn dark_and_saturated_pictures_are_bad() {
        for (value, bad) in [
            (0, true),
            (16, true),
            (40, false),
            (240, false),
            (255, true),
        ] {
            let mut light = Light::UNSEEN;
            for _ in 0..100 {
                light.follow(Light::of(&Pixels::U8(&[value; 50]), 8));
            }
            assert_eq!(light.is_bad(), bad, "{value}: {light:?}");
        }
        assert!(!Light::of(&Pixels::U8(&[]), 8).mean.is_nan());
    }
}
