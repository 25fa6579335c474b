//! A scene of random waves that moves along both axes, seen row after row: everything about it is known exactly.

use core::f64::consts::TAU;

use rowtone_chance::{Chance, Mmix};

/// One wave of the texture: amplitude in pixel values, rad/px along x and y, phase.
struct Wave([f64; 4]);

/// How a texture's edges lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Texture {
    /// Every way.
    Even,
    /// Mostly along one direction, some 30° wide about this angle of the wave vector, rad.
    Leaning(f64),
    /// All of them: the wave vectors have this angle.
    OneWay(f64),
}

pub(crate) struct Scene {
    width: usize,
    waves: Vec<Wave>,
    pub(crate) read_noise: f64,
    pub(crate) per_value: f64,
    random: Mmix,
    pub(crate) line_s: f64,
    pub(crate) frame_s: f64,
    /// Tones along x and y: Hz, px, phase.
    pub(crate) tones: [Vec<(f64, f64, f64)>; 2],
}

impl Scene {
    pub(crate) fn new(texture: Texture, width: usize, seed: u64) -> Self {
        let mut random = Mmix(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let waves = (0..60)
            .map(|_| {
                // Up to 0.14 cycles/px, weaker the finer: what a lens leaves.
                let k = TAU * (0.015 + 0.125 * random.unit());
                let angle = match texture {
                    Texture::Even => TAU * random.unit(),
                    Texture::Leaning(angle) => angle + 0.26 * random.normal(),
                    Texture::OneWay(angle) => angle,
                };
                let amplitude = 2.6 / (0.2 + k);
                Wave([
                    amplitude,
                    k * angle.cos(),
                    k * angle.sin(),
                    TAU * random.unit(),
                ])
            })
            .collect();
        Self {
            width,
            waves,
            read_noise: 1.0,
            per_value: 0.012,
            random,
            line_s: 60e-6,
            frame_s: 1.0 / 60.0,
            tones: [Vec::new(), Vec::new()],
        }
    }

    pub(crate) fn motion(&self, t: f64) -> [f64; 2] {
        let along = |tones: &[(f64, f64, f64)]| {
            tones
                .iter()
                .map(|(hz, px, phase)| px * (TAU * hz * t + phase).sin())
                .sum()
        };
        [along(&self.tones[0]), along(&self.tones[1])]
    }

    pub(crate) fn start_s(&self, frame: u32, row: usize) -> f64 {
        f64::from(frame) * self.frame_s + row as f64 * self.line_s
    }

    /// Value and both derivatives of the texture along a row, `step` apart.
    fn texture(&self, x0: f64, y: f64, step: f64, count: usize) -> Vec<[f64; 3]> {
        let mut values = vec![[118.0, 0.0, 0.0]; count];
        for Wave([a, kx, ky, phase]) in &self.waves {
            let (mut sin, mut cos) = (kx * x0 + ky * y + phase).sin_cos();
            let (ds, dc) = (kx * step).sin_cos();
            for v in &mut values {
                v[0] += a * cos;
                v[1] -= a * kx * sin;
                v[2] -= a * ky * sin;
                (sin, cos) = (sin * dc + cos * ds, cos * dc - sin * ds);
            }
        }
        values
    }

    /// A row of a frame, 8 bits.
    pub(crate) fn row(&mut self, frame: u32, row: usize) -> Vec<u8> {
        let [u, v] = self.motion(self.start_s(frame, row));
        let texture = self.texture(-u, row as f64 - v, 1.0, self.width);
        let pixels = texture.iter().map(|[value, ..]| {
            let sigma = (self.read_noise.powi(2) + self.per_value * value.max(0.0)).sqrt();
            (value + sigma * self.random.normal())
                .round()
                .clamp(0.0, 255.0) as u8
        });
        pixels.collect()
    }

    /// The 2x2 Fisher information of a row about a displacement (xx, xy, yy), 1/px²; brightness and offset are unknown too.
    /// The 8 columns at either end, of which the band's filter does not see both sides, are left out.
    pub(crate) fn information(&self, row: usize) -> [f64; 3] {
        let texture = self.texture(0.0, row as f64, 1.0, self.width);
        let inner = &texture[8..self.width - 8];
        let weight =
            |v: f64| 1.0 / (self.read_noise.powi(2) + self.per_value * v.max(0.0) + 1.0 / 12.0);
        // Moments of (1, r, r_x, r_y), then the Schur complement of the first two.
        let mut m = [[0.0; 4]; 4];
        for &[v, gx, gy] in inner {
            let basis = [1.0, v, gx, gy];
            for (i, a) in basis.iter().enumerate() {
                for (j, b) in basis.iter().enumerate() {
                    m[i][j] += weight(v) * a * b;
                }
            }
        }
        for k in 0..2 {
            for i in k + 1..4 {
                let f = m[i][k] / m[k][k];
                let above = m[k];
                for (own, above) in m[i].iter_mut().zip(above) {
                    *own -= f * above;
                }
            }
        }
        [m[2][2], m[2][3], m[3][3]]
    }
}
