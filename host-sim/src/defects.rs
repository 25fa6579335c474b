//! What a real sensor adds that does not move with the picture, and what a phone's processing does.
//!
//! The fixed part (hot pixels, dust, unequal pixels, column pattern) is drawn once from the seed and is
//! the same in every frame; row noise is drawn anew for each row of each frame.

use serde::Serialize;

use super::error::{SimError, check};

/// What is wrong with the sensor; nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Defects {
    /// Pixels at random places that always read white.
    pub hot_pixels: u32,
    /// Specks of dust at random places, 2 to 5 px wide, soft-edged.
    pub dust_specks: u32,
    /// Light that a speck of dust takes in its middle, 0 to 1.
    pub dust_depth: f64,
    /// Unequal response of the pixels (PRNU), rms, as a share.
    pub prnu: f64,
    /// Pattern of the columns, rms, as a share of white.
    pub column_pattern: f64,
    /// Noise that all pixels of a row have in common, rms, as a share of white.
    pub row_noise: f64,
    /// Share of the frame before that a phone's temporal denoiser mixes in, 0 to below 1.
    pub denoise: f64,
}

impl Defects {
    pub(super) fn check(&self) -> Result<(), SimError> {
        for (field, value, most, allowed) in [
            ("the dust's depth", self.dust_depth, 1.0, "0 to 1"),
            ("the pixels' PRNU", self.prnu, 0.5, "0 to 0.5"),
            ("the column pattern", self.column_pattern, 0.5, "0 to 0.5"),
            ("the row noise", self.row_noise, 0.5, "0 to 0.5"),
            (
                "the temporal denoiser's share",
                self.denoise,
                0.95,
                "0 to 0.95",
            ),
        ] {
            check((0.0..=most).contains(&value), field, value, allowed)?;
        }
        for (field, count) in [
            ("the number of hot pixels", self.hot_pixels),
            ("the number of dust specks", self.dust_specks),
        ] {
            check(count <= 100_000, field, f64::from(count), "at most 100 000")?;
        }
        Ok(())
    }

    /// Frames that the denoiser still shows, with their shares; the newest first.
    pub(super) fn mixture(&self) -> Vec<f32> {
        let mut shares = Vec::new();
        let mut left = 1.0;
        while left > 0.01 && shares.len() < 64 {
            shares.push(((1.0 - self.denoise) * left) as f32);
            left *= self.denoise;
        }
        let sum: f32 = shares.iter().sum();
        shares.iter().map(|share| share / sum).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_denoisers_shares_fall_evenly_and_add_up() {
        let shares = Defects {
            denoise: 0.5,
            ..Defects::default()
        }
        .mixture();
        assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(shares.windows(2).all(|w| (w[1] / w[0] - 0.5).abs() < 1e-6));
        assert_eq!(Defects::default().mixture(), [1.0]);
    }
}
