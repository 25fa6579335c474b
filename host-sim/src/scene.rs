//! What the camera looks at: how much light each point reflects.

mod fields;
mod picture;

use std::path::PathBuf;

use serde::Serialize;

use super::error::{SimError, check};
use super::random::{stream, unit};
use super::texture::Strip;
use fields::{blur_cols, blur_rows, noise, one_over_f};
use picture::picture;

/// The kinds of scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
#[non_exhaustive]
pub enum Scene {
    /// Random specks, as on a sprayed or rough surface.
    Speckle {
        /// Size of a speck: standard deviation of the Gaussian that made them, px.
        grain_px: f64,
    },
    /// One bright vertical bar on a dark ground, in the middle.
    Bar {
        /// Its width, px.
        width_px: f64,
    },
    /// Bright vertical stripes.
    Stripes {
        /// From one to the next, px.
        period_px: f64,
    },
    /// Straight edges at random distances that all lean the same way: only the motion across them
    /// can be seen.
    Edges {
        /// By how much they lean from upright, degrees, -80 to 80.
        lean_deg: f64,
    },
    /// Like a photograph: detail at every size (amplitude falling as 1/frequency), dark and bright
    /// shapes, and a sky without texture above.
    Photo {
        /// Share of the rows that are sky, 0 to 1.
        sky: f64,
    },
    /// An evenly lit wall without texture, to see nothing but the light.
    Plain,
    /// A picture file (PNG or JPEG), scaled to the frame's height.
    Picture {
        /// The file.
        path: PathBuf,
    },
}

impl Scene {
    pub(super) fn check(&self) -> Result<(), SimError> {
        match *self {
            Self::Speckle { grain_px } => check(
                (0.0..=200.0).contains(&grain_px),
                "the grain (px)",
                grain_px,
                "0 to 200",
            ),
            Self::Bar { width_px } => {
                check(width_px > 0.0, "the bar's width (px)", width_px, "above 0")
            }
            Self::Stripes { period_px } => check(
                period_px >= 2.0,
                "the stripes' period (px)",
                period_px,
                "2 or more",
            ),
            Self::Edges { lean_deg } => check(
                (-80.0..=80.0).contains(&lean_deg),
                "the edges' lean (degrees)",
                lean_deg,
                "-80 to 80",
            ),
            Self::Photo { sky } => check(
                (0.0..=1.0).contains(&sky),
                "the share of sky",
                sky,
                "0 to 1",
            ),
            Self::Plain | Self::Picture { .. } => Ok(()),
        }
    }

    /// The scene as a strip of `rows` rows that shows `cols` and has at least `margin_px` more.
    ///
    /// # Errors
    /// [`SimError::File`] when the picture cannot be read.
    pub fn strip(
        &self,
        cols: usize,
        margin_px: usize,
        rows: usize,
        blur_px: f64,
        seed: u64,
    ) -> Result<Strip, SimError> {
        let mut period_px = (cols + margin_px).next_multiple_of(32);
        Ok(match self {
            Self::Speckle { grain_px } => speckle(period_px, rows, *grain_px, blur_px, seed),
            Self::Bar { width_px } => {
                let middle = cols as f64 * 0.5;
                let ends = [middle - 0.5 * width_px, middle + 0.5 * width_px];
                boxes(period_px, rows, |_| vec![ends])
            }
            Self::Stripes { period_px: p } => {
                // A whole number of stripes, so that the strip closes.
                period_px = (((period_px as f64 / p).ceil() * p).round()) as usize;
                let count = (period_px as f64 / p).round();
                let step = period_px as f64 / count;
                boxes(period_px, rows, |_| {
                    (0..count as usize)
                        .map(|k| [(k as f64 + 0.25) * step, (k as f64 + 0.75) * step])
                        .collect()
                })
            }
            Self::Edges { lean_deg } => {
                blurred_down(edges(period_px, rows, *lean_deg, seed), blur_px)
            }
            Self::Photo { sky } => blurred_down(photo(period_px, rows, *sky, seed), blur_px),
            Self::Plain => Strip {
                period_px,
                fineness: 1,
                values: vec![0.7; period_px * rows],
            },
            Self::Picture { path } => blurred_down(picture(path, period_px, rows)?, blur_px),
        })
    }
}

/// White noise blurred to the grain, pressed into 0 to 1 so that all greys are equally frequent.
fn speckle(period_px: usize, rows: usize, grain_px: f64, blur_px: f64, seed: u64) -> Strip {
    let width = period_px * 2;
    let mut values = noise(width * rows, seed);
    blur_rows(&mut values, width, 2.0 * grain_px);
    blur_cols(&mut values, width, grain_px);
    let n = values.len() as f64;
    let rms = (values.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() / n).sqrt();
    for v in &mut values {
        *v = (0.5 + 0.5 * libm::erf(f64::from(*v) / (rms * std::f64::consts::SQRT_2))) as f32;
    }
    blur_cols(&mut values, width, blur_px);
    Strip {
        period_px,
        fineness: 2,
        values,
    }
}

/// Bright boxes (start, end in px) on a dark ground, drawn with their exact share of each value.
fn boxes(period_px: usize, rows: usize, in_row: impl Fn(usize) -> Vec<[f64; 2]>) -> Strip {
    let width = period_px * 2;
    let mut values = vec![0.0; width * rows];
    for (y, row) in values.chunks_mut(width).enumerate() {
        for [start, end] in in_row(y) {
            for (k, v) in row.iter_mut().enumerate() {
                // Value k stands for the half pixel around k/2 in the picture's own coordinates.
                let (left, right) = (0.5 * k as f64 - 0.25, 0.5 * k as f64 + 0.25);
                *v += (2.0 * (end.min(right) - start.max(left)).max(0.0)) as f32;
            }
        }
    }
    Strip {
        period_px,
        fineness: 2,
        values,
    }
}

/// Boxes of random widths, moved to the right from row to row.
fn edges(period_px: usize, rows: usize, lean_deg: f64, seed: u64) -> Strip {
    let mut rng = stream(seed, 9, 0);
    let period = period_px as f64;
    let (mut ends, mut at) = (Vec::new(), 0.0);
    while at < period - 30.0 {
        let start = at + 4.0 + 12.0 * unit(&mut rng);
        at = start + 4.0 + 12.0 * unit(&mut rng);
        ends.push([start, at]);
    }
    let lean = libm::tan(lean_deg.to_radians());
    boxes(period_px, rows, |y| {
        let by = lean * y as f64;
        let moved = |[start, end]: [f64; 2]| {
            let start_here = (start + by).rem_euclid(period);
            [start_here, start_here + end - start]
        };
        // What reaches over the strip's end goes on at its beginning.
        let here = ends.iter().map(|&b| moved(b));
        here.flat_map(|[a, b]| [[a, b], [a - period, b - period]])
            .collect()
    })
}

/// The lens blurs down the columns too; along the rows the texture does it.
fn blurred_down(mut strip: Strip, blur_px: f64) -> Strip {
    let width = strip.period_px * strip.fineness;
    blur_cols(&mut strip.values, width, blur_px);
    strip
}

/// A 1/f field over the whole strip (2-D Fourier synthesis), a harder-edged version of a second one on
/// top, and an almost plain sky above a wavy horizon.
fn photo(period_px: usize, rows: usize, sky: f64, seed: u64) -> Strip {
    let detail = one_over_f(period_px, rows, 1.0, seed);
    let shapes = one_over_f(period_px, rows, 1.6, seed ^ 0x5eed);
    let mut values = vec![0.0; period_px * rows];
    for (i, v) in values.iter_mut().enumerate() {
        let (x, y) = (i % period_px, i / period_px);
        let u = std::f64::consts::TAU * x as f64 / period_px as f64;
        let horizon = rows as f64
            * (sky + 0.01 * (libm::sin(3.0 * u) + libm::sin(5.0 * u + 1.0)).min(sky * 50.0));
        let land = 0.42 + 0.13 * detail[i] + 0.12 * libm::tanh(4.0 * shapes[i]);
        let above = 0.78 - 0.1 * y as f64 / rows as f64;
        let ground = ((y as f64 - horizon) + 0.5).clamp(0.0, 1.0);
        *v = (ground * land + (1.0 - ground) * above).clamp(0.0, 1.0) as f32;
    }
    Strip {
        period_px,
        fineness: 1,
        values,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_fills_its_strip_with_reflectances() {
        let scenes = [
            Scene::Speckle { grain_px: 2.0 },
            Scene::Speckle { grain_px: 0.0 },
            Scene::Bar { width_px: 40.0 },
            Scene::Stripes { period_px: 14.3 },
            Scene::Photo { sky: 0.25 },
            Scene::Photo { sky: 0.0 },
            Scene::Edges { lean_deg: 30.0 },
            Scene::Plain,
        ];
        for scene in scenes {
            let strip = scene.strip(80, 20, 20, 1.6, 7).expect("no files");
            assert!(strip.period_px >= 100);
            assert_eq!(
                strip.values.len(),
                strip.period_px * strip.fineness * 20,
                "{scene:?}"
            );
            assert!(
                strip.values.iter().all(|v| (0.0..=1.0001).contains(v)),
                "{scene:?}"
            );
        }
    }

    #[test]
    fn a_bar_has_its_width_and_place() {
        let strip = Scene::Bar { width_px: 30.3 }
            .strip(100, 20, 2, 0.0, 1)
            .expect("no files");
        let row = &strip.values[..strip.period_px * 2];
        let sum: f32 = row.iter().sum();
        let middle: f32 = row
            .iter()
            .enumerate()
            .map(|(k, v)| k as f32 * 0.5 * v)
            .sum::<f32>()
            / sum;
        assert!(
            (sum * 0.5 - 30.3).abs() < 1e-3 && (middle - 50.0).abs() < 1e-3,
            "{sum} {middle}"
        );
    }

    #[test]
    fn sky_has_no_texture_and_land_has() {
        let strip = Scene::Photo { sky: 0.3 }
            .strip(128, 0, 60, 0.0, 3)
            .expect("no files");
        let swing = |y: usize| {
            let row = &strip.values[y * strip.period_px..][..strip.period_px];
            row.iter().fold(0.0f32, |a, &v| a.max(v)) - row.iter().fold(1.0f32, |a, &v| a.min(v))
        };
        assert!((0..15).all(|y| swing(y) == 0.0));
        assert!((22..60).all(|y| swing(y) > 0.1));
    }

    #[test]
    fn a_picture_file_is_read_and_a_wrong_one_refused_with_its_name() {
        let dir = std::env::temp_dir();
        let path = dir.join(format!("rowtone-scene-{}.png", std::process::id()));
        let grey: Vec<u8> = (0..40)
            .flat_map(|y| (0..50).map(move |x| (x * 4 + y) as u8))
            .collect();
        let file = std::fs::File::create(&path).expect("a temporary file");
        let mut encoder = png::Encoder::new(file, 50, 40);
        encoder.set_color(png::ColorType::Grayscale);
        let mut writer = encoder.write_header().expect("room");
        writer.write_image_data(&grey).expect("room");
        writer.finish().expect("room");
        let strip = Scene::Picture { path: path.clone() }
            .strip(80, 20, 20, 0.0, 1)
            .expect("a good picture");
        std::fs::remove_file(&path).expect("just written");
        assert_eq!(strip.values.len(), strip.period_px * 20);
        let missing = Scene::Picture { path }
            .strip(80, 20, 20, 0.0, 1)
            .expect_err("it is gone")
            .to_string();
        assert!(missing.contains("rowtone-scene-"), "{missing}");
    }
}
