//! The pattern of a sensor that stands still: drawn once from the seed, the same in every frame.

use rand_chacha::rand_core::RngCore;
use rand_distr::{Distribution, StandardNormal};

use super::config::Config;
use super::random::{stream, unit};

/// The fixed pattern of a sensor.
#[derive(Clone, Debug, Default)]
pub(super) struct Pattern {
    /// Response of each pixel, row by row; empty where all are alike.
    gains: Vec<f32>,
    /// Added to each column, shares of white; empty where nothing is.
    offsets: Vec<f32>,
    /// Hot pixels: row, column; sorted.
    hot: Vec<(u32, u32)>,
}

impl Pattern {
    pub(super) fn new(config: &Config) -> Self {
        let (d, sensor) = (&config.defects, &config.sensor);
        let (cols, rows) = (sensor.cols as usize, sensor.rows as usize);
        let mut rng = stream(config.seed, 6, 0);
        let mut gains = Vec::new();
        if d.prnu > 0.0 || d.dust_specks > 0 {
            gains = vec![1.0f32; cols * rows];
            for gain in &mut gains {
                let normal: f32 = StandardNormal.sample(&mut rng);
                *gain += d.prnu as f32 * normal;
            }
            for _ in 0..d.dust_specks {
                let middle = [unit(&mut rng) * cols as f64, unit(&mut rng) * rows as f64];
                let radius = 1.0 + 1.5 * unit(&mut rng);
                dim(&mut gains, cols, middle, radius, d.dust_depth);
            }
        }
        let offsets = match d.column_pattern > 0.0 {
            true => (0..cols)
                .map(|_| -> f32 { StandardNormal.sample(&mut rng) })
                .map(|normal| d.column_pattern as f32 * normal)
                .collect(),
            false => Vec::new(),
        };
        let mut place = |of: u32| (rng.next_u64() % u64::from(of)) as u32;
        let mut hot: Vec<(u32, u32)> = (0..d.hot_pixels)
            .map(|_| (place(sensor.rows), place(sensor.cols)))
            .collect();
        hot.sort_unstable();
        Self {
            gains,
            offsets,
            hot,
        }
    }

    /// The hot pixels of `row`, by column.
    pub(super) fn hot(&self, row: u32) -> impl Iterator<Item = u32> + '_ {
        let from = self.hot.partition_point(|&(y, _)| y < row);
        self.hot[from..]
            .iter()
            .take_while(move |&&(y, _)| y == row)
            .map(|&(_, x)| x)
    }

    /// Puts the pattern and the row's own noise on the light of a row, shares of white.
    pub(super) fn put(&self, row: u32, row_offset: f32, levels: &mut [f32]) {
        let first = row as usize * levels.len();
        if let Some(gains) = self.gains.get(first..first + levels.len()) {
            levels.iter_mut().zip(gains).for_each(|(v, g)| *v *= g);
        }
        levels
            .iter_mut()
            .zip(&self.offsets)
            .for_each(|(v, o)| *v = (*v + o).max(0.0));
        if row_offset != 0.0 {
            levels
                .iter_mut()
                .for_each(|v| *v = (*v + row_offset).max(0.0));
        }
        for column in self.hot(row) {
            levels[column as usize] = 4.0;
        }
    }
}

/// A soft dark speck.
fn dim(gains: &mut [f32], cols: usize, middle: [f64; 2], radius: f64, depth: f64) {
    let reach = 3.0 * radius;
    for (y, row) in gains.chunks_mut(cols).enumerate() {
        let dy = y as f64 - middle[1];
        if dy.abs() > reach {
            continue;
        }
        for (x, gain) in row.iter_mut().enumerate() {
            let dx = x as f64 - middle[0];
            let far = (dx * dx + dy * dy) / (radius * radius);
            *gain *= (1.0 - depth * libm::exp(-0.5 * far * far)) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Defects;

    #[test]
    fn a_pattern_has_the_asked_size_and_is_the_same_every_time() {
        let defects = Defects {
            hot_pixels: 7,
            prnu: 0.02,
            column_pattern: 0.01,
            ..Defects::default()
        };
        let config = Config {
            defects,
            ..Config::default()
        };
        let (one, again) = (Pattern::new(&config), Pattern::new(&config));
        let n = one.gains.len() as f64;
        let var = one
            .gains
            .iter()
            .map(|g| f64::from(g - 1.0).powi(2))
            .sum::<f64>()
            / n;
        // 38 400 pixels: the sd of the estimate is 0.36 %, 2 % is over five of them.
        assert!((var.sqrt() / 0.02 - 1.0).abs() < 0.02, "{var}");
        assert_eq!((one.hot.len(), &one.hot), (7, &again.hot));
        assert_eq!(one.offsets, again.offsets);
        let mut levels = vec![0.5; 128];
        one.put(one.hot[0].0, 0.0, &mut levels);
        assert_eq!(levels[one.hot[0].1 as usize], 4.0);
    }
}
