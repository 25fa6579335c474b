//! What a camera delivers before it is ready.

use rand_distr::{Distribution, StandardNormal};

use super::config::{Config, FirstFrame};
use super::random::{stream, unit};

/// Puts the fault in place of the frame's values, DN.
pub(super) fn spoil(kind: FirstFrame, config: &Config, values: &mut [f32]) {
    let white = config.sensor.white_dn();
    let mut rng = stream(config.seed, 8, 0);
    match kind {
        FirstFrame::Black => values.fill(0.0),
        FirstFrame::Dark => {
            let noise_dn = config.sensor.read_noise_e / config.sensor.full_well_e * white;
            for value in values {
                let normal: f64 = StandardNormal.sample(&mut rng);
                *value = (0.02 * white + noise_dn * normal).round().clamp(0.0, white) as f32;
            }
        }
        FirstFrame::Stale => {
            let cols = config.sensor.cols as usize;
            values
                .chunks_mut(cols)
                .for_each(|row| row.rotate_left(cols / 3));
        }
        FirstFrame::Random => {
            for value in values {
                *value = (white * unit(&mut rng)).round() as f32;
            }
        }
    }
}
