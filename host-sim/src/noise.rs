//! From light to numbers: shot noise, read noise, gain, quantisation, saturation.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::config::Sensor;
use super::random::unit;

/// Below this many electrons their number is drawn from the Poisson distribution itself; above, from
/// a normal one of the same mean and variance, whose skewness (0.14 here) no longer shows.
const FEW_ELECTRONS: f32 = 50.0;

/// The pixel electronics.
#[derive(Clone, Copy, Debug)]
pub struct Pixels {
    full_well_e: f32,
    read_noise_e: f32,
    white_dn: f32,
}

impl Pixels {
    /// Of this sensor.
    pub fn new(sensor: &Sensor) -> Self {
        Self {
            full_well_e: sensor.full_well_e as f32,
            read_noise_e: sensor.read_noise_e as f32,
            white_dn: sensor.white_dn() as f32,
        }
    }

    /// Variance of a pixel that `level` (fraction of white, at gain 1) falls on, DN²: shot noise,
    /// read noise and the 1/12 of quantisation.
    pub fn variance_dn2(&self, level: f32) -> f64 {
        let dn_per_e = f64::from(self.white_dn) / f64::from(self.full_well_e);
        let electrons = f64::from(level) * f64::from(self.full_well_e);
        (electrons + f64::from(self.read_noise_e).powi(2)) * dn_per_e * dn_per_e + 1.0 / 12.0
    }

    /// Reads a row: `levels` are fractions of white at gain 1 and become DN (whole numbers).
    pub fn read(
        &self,
        levels: &mut [f32],
        gain: f32,
        rng: &mut ChaCha8Rng,
        normals: &mut Vec<f32>,
    ) {
        normals.clear();
        normals.extend(levels.iter().map(|_| -> f32 { StandardNormal.sample(rng) }));
        let dn_per_e = gain * self.white_dn / self.full_well_e;
        let read2 = self.read_noise_e * self.read_noise_e;
        let full_well = self.full_well_e;
        let mut few = false;
        for (level, z) in levels.iter_mut().zip(normals.iter()) {
            let electrons = *level * full_well;
            few |= electrons < FEW_ELECTRONS;
            // Kept aside for the rare dim pixel below; otherwise this is the reading.
            let reading = (electrons + z * (electrons.max(0.0) + read2).sqrt()) * dn_per_e;
            *level = if electrons < FEW_ELECTRONS {
                -1.0 - electrons.max(0.0)
            } else {
                reading.max(0.0)
            };
        }
        if few {
            for (level, z) in levels
                .iter_mut()
                .zip(normals.iter())
                .filter(|(l, _)| **l <= -1.0)
            {
                let electrons = poisson(-1.0 - *level, rng) + z * self.read_noise_e;
                *level = electrons * dn_per_e;
            }
        }
        for level in levels {
            // Never negative here, so cutting off rounds down; a call of floor would not be inlined.
            *level = (*level + 0.5).clamp(0.0, self.white_dn) as i32 as f32;
        }
    }
}

/// A Poisson number by counting down its distribution.
fn poisson(mean: f32, rng: &mut ChaCha8Rng) -> f32 {
    let mean = f64::from(mean);
    let mut left = unit(rng);
    let mut p = libm::exp(-mean);
    let mut count = 0.0;
    while left > p && count < 1000.0 {
        left -= p;
        count += 1.0;
        p *= mean / count;
    }
    count as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use crate::random::stream;

    /// Mean and variance follow the photon transfer curve from dark to near white. Of 100 000 pixels
    /// the variance's estimate has a relative sd of 0.45 %; 2.3 % is five of them, so a false
    /// failure of one of the levels has a probability below 1e-5.
    #[test]
    fn variance_against_mean_is_the_photon_transfer_curve() {
        for (bits, full_well_e, read_noise_e) in
            [(8, 9600.0, 30.0), (10, 4000.0, 5.0), (12, 9600.0, 3.0)]
        {
            let sensor = Sensor {
                bits,
                full_well_e,
                read_noise_e,
                ..Config::default().sensor
            };
            let pixels = Pixels::new(&sensor);
            for level in [0.003, 0.02, 0.1, 0.5, 0.9] {
                let mut rng = stream(5, 9, bits.into());
                let mut row = vec![level; 100_000];
                pixels.read(&mut row, 1.0, &mut rng, &mut Vec::new());
                let mean = row.iter().map(|&v| f64::from(v)).sum::<f64>() / 1e5;
                let var = row
                    .iter()
                    .map(|&v| (f64::from(v) - mean).powi(2))
                    .sum::<f64>()
                    / 1e5;
                let want = pixels.variance_dn2(level);
                let clipped = f64::from(level) * sensor.white_dn() < 4.0 * want.sqrt();
                if !clipped {
                    assert!(
                        (mean - f64::from(level) * sensor.white_dn()).abs() < 0.02 * want.sqrt(),
                        "{mean}"
                    );
                    assert!(
                        (var / want - 1.0).abs() < 0.023,
                        "{bits} bits at {level}: {var} {want}"
                    );
                }
            }
        }
    }

    #[test]
    fn few_electrons_are_poisson() {
        let mut rng = stream(3, 9, 0);
        for mean in [0.0f32, 0.5, 3.0, 20.0] {
            let counts: Vec<f64> = (0..100_000)
                .map(|_| f64::from(poisson(mean, &mut rng)))
                .collect();
            let m = counts.iter().sum::<f64>() / 1e5;
            let v = counts.iter().map(|c| (c - m).powi(2)).sum::<f64>() / 1e5;
            let mean = f64::from(mean);
            assert!((m - mean).abs() <= 6.0 * (mean / 1e5).sqrt(), "{m}");
            assert!((v - mean).abs() <= 0.03 * mean, "{v}"); // 0.45 % to 0.6 % sd
        }
    }

    #[test]
    fn white_is_the_end() {
        let pixels = Pixels::new(&Config::default().sensor);
        let mut row = vec![3.0, 1.0, -0.1];
        pixels.read(&mut row, 2.0, &mut stream(1, 9, 0), &mut Vec::new());
        assert_eq!(row[..2], [255.0, 255.0]);
        assert!((0.0..4.0).contains(&row[2]));
    }
}
