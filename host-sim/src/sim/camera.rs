//! The camera: frames out, truth beside them.

use rand_chacha::rand_core::RngCore;
use rowtone::camera::{Line, Pixels as LinePixels, Timing};

use super::config::{Config, Hand};
use super::error::{SimError, check};
use super::exposure::{Quadrature, Seen};
use super::motion::step_value;
use super::noise::Pixels;
use super::schedule::{Slot, slots, stream};
use super::texture::Texture;

/// The pixels of a frame, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PixelBuffer {
    /// 8 bits.
    U8(Vec<u8>),
    /// 10 to 16 bits, one pixel a word, not scaled up.
    U16(Vec<u16>),
}

/// One frame as it arrives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its number; lost frames leave a gap.
    pub number: u32,
    /// Start of exposure of the row that is read first, ns.
    pub start_ns: i64,
    /// Columns.
    pub cols: u32,
    /// Its pixels.
    pub pixels: PixelBuffer,
    line_time_ps: u32,
    rows: u32,
    bottom_up: bool,
}

impl Frame {
    /// Rows.
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// The line of `row`, as the core takes it; `None` beyond the last.
    pub fn line(&self, row: u32) -> Option<Line<'_>> {
        let cols = self.cols as usize;
        let part = (row as usize * cols)..((row as usize + 1) * cols);
        let pixels = match &self.pixels {
            PixelBuffer::U8(p) => LinePixels::U8(p.get(part)?),
            PixelBuffer::U16(p) => LinePixels::U16(p.get(part)?),
        };
        let order = if self.bottom_up {
            self.rows - 1 - row
        } else {
            row
        };
        let start_ns =
            self.start_ns + (u64::from(order) * u64::from(self.line_time_ps) / 1000) as i64;
        Some(Line {
            frame: self.number,
            row: u16::try_from(row).ok()?,
            start_ns,
            pixels,
        })
    }
}

/// What really happened while a row was exposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowTruth {
    /// Middle of the exposure, ns.
    pub middle_ns: i64,
    /// The object's displacement, averaged over the exposure with the light, px.
    pub displacement_px: f64,
    /// The camera's own, averaged in the same way, px.
    pub shake_px: f64,
    /// Mean light, 1 for the steady light.
    pub light: f64,
}

/// A simulated camera, checked and ready.
#[derive(Clone, Debug)]
pub struct Camera {
    config: Config,
    slots: Vec<Slot>,
    texture: Texture,
    texture_after: Option<Texture>,
    quadrature: Quadrature,
    pixels: Pixels,
}

impl Camera {
    /// Checks the configuration and prepares scene and schedule.
    ///
    /// # Errors
    /// A [`SimError`] that names what is wrong.
    pub fn new(config: Config) -> Result<Self, SimError> {
        config.check()?;
        let slots = slots(&config);
        let sensor = &config.sensor;
        let (cols, rows) = (sensor.cols as usize, sensor.rows as usize);
        let seconds = slots.last().map_or(0.0, |s| s.start_ns as f64 * 1e-9) + sensor.readout_s();
        let reach = config.motion.reach_px(seconds) + config.shake.reach_px(seconds);
        // Beyond this the scene repeats itself, which no line can tell.
        let margin = (2.0 * reach).ceil().min(4.0 * cols as f64) as usize + 32;
        let optics = &config.optics;
        let texture = |seed| -> Result<Texture, SimError> {
            let strip = config
                .scene
                .strip(cols, margin, rows, optics.blur_px, seed)?;
            Ok(Texture::new(
                &strip,
                optics.blur_px,
                optics.dark,
                optics.bright,
            ))
        };
        let size = (cols + margin) * rows;
        check(
            size <= 1 << 26,
            "the scene's size (px, margins for the motion included)",
            size as f64,
            "at most 67 million",
        )?;
        let changed_seed = stream(config.seed, 3, 0).next_u64();
        let texture_after = config
            .disturbances
            .scene_change_s
            .map(|_| texture(changed_seed))
            .transpose()?;
        let texture = texture(config.seed)?;
        let pixels = Pixels::new(sensor);
        Ok(Self {
            slots,
            texture,
            texture_after,
            quadrature: Quadrature::default(),
            pixels,
            config,
        })
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The blurred scene.
    pub fn texture(&self) -> &Texture {
        &self.texture
    }

    /// All frames in time, the lost ones too.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The frames that arrive.
    pub fn arriving(&self) -> impl Iterator<Item = Slot> + '_ {
        self.slots.iter().copied().filter(|s| !s.lost)
    }

    /// The pixel electronics.
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// How the rows are timed, for the core. For a sensor read from the bottom up, give the core
    /// the rows in reading order.
    ///
    /// # Panics
    /// Never: the configuration has been checked.
    pub fn timing(&self) -> Timing {
        let s = &self.config.sensor;
        let rows = u16::try_from(s.rows).expect("checked to be at most 16384");
        Timing::new(s.line_time_ps, s.exposure_ns, rows).expect("checked to have rows")
    }

    /// The object's displacement at any instant, px.
    pub fn displacement_px(&self, t_s: f64) -> f64 {
        self.config.motion.at(t_s)
    }

    /// The camera's own displacement at any instant, px.
    pub fn shake_px(&self, t_s: f64) -> f64 {
        self.config.shake.at(t_s)
    }

    /// Exposure of a row that starts at `t_s`, s.
    pub fn exposure_s(&self, t_s: f64) -> f64 {
        f64::from(self.config.sensor.exposure_ns) * 1e-9 * self.exposure_factor(t_s)
    }

    fn exposure_factor(&self, t_s: f64) -> f64 {
        step_value(&self.config.disturbances.exposure_steps, t_s, 1.0)
    }

    /// What really happened during the exposure of `row` in the frame of `slot`.
    pub fn row_truth(&self, slot: Slot, row: u32) -> RowTruth {
        let mut seen = Seen::default();
        let frame_s = slot.start_ns as f64 * 1e-9;
        let from_s = frame_s + self.config.sensor.row_start_s(row);
        let exposure_s = self.exposure_s(frame_s);
        seen.look(&self.config, &self.quadrature, from_s, exposure_s);
        RowTruth {
            middle_ns: ((from_s + 0.5 * exposure_s) * 1e9).round() as i64,
            displacement_px: seen.displacement_px,
            shake_px: seen.shake_px,
            light: seen.light,
        }
    }

    /// The arriving frames, one at a time.
    pub fn frames(&self) -> impl Iterator<Item = Frame> + '_ {
        self.arriving().map(|slot| self.frame(slot))
    }

    /// One frame.
    pub fn frame(&self, slot: Slot) -> Frame {
        let sensor = &self.config.sensor;
        let (cols, rows) = (sensor.cols as usize, sensor.rows);
        let mut rng = stream(self.config.seed, 0, slot.number);
        let frame_s = slot.start_ns as f64 * 1e-9;
        let gain = step_value(&self.config.disturbances.gain_steps, frame_s, 1.0) as f32;
        let mut seen = Seen::default();
        let (mut levels, mut normals) = (vec![0.0; cols], Vec::with_capacity(cols));
        let mut narrow = Vec::with_capacity(if sensor.bits == 8 {
            cols * rows as usize
        } else {
            0
        });
        let mut wide = Vec::with_capacity(if sensor.bits == 8 {
            0
        } else {
            cols * rows as usize
        });
        for row in 0..rows {
            self.light_row(frame_s, row, &mut seen, &mut levels);
            self.pixels.read(&mut levels, gain, &mut rng, &mut normals);
            for &dead in &self.config.disturbances.dead_cols {
                levels[dead as usize] = 0.0;
            }
            match sensor.bits {
                8 => narrow.extend(levels.iter().map(|&v| v as u8)),
                _ => wide.extend(levels.iter().map(|&v| v as u16)),
            }
        }
        let pixels = if sensor.bits == 8 {
            PixelBuffer::U8(narrow)
        } else {
            PixelBuffer::U16(wide)
        };
        Frame {
            number: slot.number,
            start_ns: slot.start_ns,
            cols: sensor.cols,
            pixels,
            line_time_ps: sensor.line_time_ps,
            rows,
            bottom_up: sensor.bottom_up,
        }
    }

    /// The light that the pixels of a row gathered, fractions of white: a frame without noise.
    pub fn noise_free_row(&self, slot: Slot, row: u32) -> Vec<f32> {
        let mut levels = vec![0.0; self.config.sensor.cols as usize];
        self.light_row(
            slot.start_ns as f64 * 1e-9,
            row,
            &mut Seen::default(),
            &mut levels,
        );
        levels
    }

    fn light_row(&self, frame_s: f64, row: u32, seen: &mut Seen, levels: &mut [f32]) {
        let config = &self.config;
        let factor = self.exposure_factor(frame_s);
        let from_s = frame_s + config.sensor.row_start_s(row);
        let exposure_s = f64::from(config.sensor.exposure_ns) * 1e-9 * factor;
        seen.look(config, &self.quadrature, from_s, exposure_s);
        levels.fill(0.0);
        let (y, cols) = (row as usize, levels.len());
        let moving = config
            .moving_cols(row)
            .map_or(0..0, |r| r.start as usize..r.end as usize);
        let after = self.texture_after.as_ref().unwrap_or(&self.texture);
        let layers = [
            (&self.texture, &seen.still, &seen.moving),
            (after, &seen.still_after, &seen.moving_after),
        ];
        for (texture, still, moved) in layers {
            texture.add(y, 0..moving.start, still, &mut levels[..moving.start]);
            texture.add(y, moving.clone(), moved, &mut levels[moving.clone()]);
            texture.add(y, moving.end..cols, still, &mut levels[moving.end..]);
        }
        if let Some(uneven) = config.light.at_place(cols, y, config.sensor.rows as usize) {
            levels
                .iter_mut()
                .enumerate()
                .for_each(|(x, v)| *v *= uneven(x) as f32);
        }
        if let Some(hand) = &config.disturbances.hand {
            cover(hand, from_s + 0.5 * exposure_s, seen.light as f32, levels);
        }
        if factor != 1.0 {
            levels.iter_mut().for_each(|v| *v *= factor as f32);
        }
        if config.disturbances.saturated_rows.contains(&row) {
            levels.fill(4.0);
        } else if config.disturbances.black_rows.contains(&row) {
            levels.fill(0.0);
        }
    }
}

/// Puts the hand in front: its edges are 4 px wide, its position that of the middle of the exposure.
fn cover(hand: &Hand, t_s: f64, light: f32, levels: &mut [f32]) {
    let u = (t_s - hand.start_s) / hand.duration_s;
    if !(0.0..1.0).contains(&u) {
        return;
    }
    let left = u * (levels.len() as f64 + hand.width_px) - hand.width_px;
    for (x, v) in levels.iter_mut().enumerate() {
        let inside = (x as f64 - left).min(left + hand.width_px - x as f64);
        let opaque = (inside / 4.0 + 0.5).clamp(0.0, 1.0) as f32;
        *v += opaque * (hand.level as f32 * light - *v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::{Rect, Step, Tone};

    fn small() -> Config {
        let mut config = Config {
            frames: 4,
            ..Config::default()
        };
        config.sensor.cols = 96;
        config.sensor.rows = 40;
        config
    }

    fn tone(hz: f64, amplitude_px: f64) -> Tone {
        Tone {
            hz,
            amplitude_px,
            phase_rad: 0.3,
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_in_any_order_and_another_does_not() {
        let mut config = small();
        config.motion.tones.push(tone(49.2, 0.4));
        let camera = Camera::new(config.clone()).expect("good");
        let forward: Vec<Frame> = camera.frames().collect();
        let again = Camera::new(config.clone()).expect("good");
        let mut backward: Vec<Frame> = again
            .slots()
            .iter()
            .rev()
            .map(|&s| again.frame(s))
            .collect();
        backward.reverse();
        assert_eq!(forward, backward);
        config.seed = 2;
        let other = Camera::new(config).expect("good");
        assert_ne!(forward[0].pixels, other.frame(other.slots()[0]).pixels);
    }

    /// The bytes themselves, so that a change of any step shows: the recordings in the repository's
    /// tables depend on them.
    #[test]
    fn the_bytes_stay_what_they_are() {
        let camera = Camera::new(small()).expect("good");
        let PixelBuffer::U8(p) = camera.frame(camera.slots()[3]).pixels else {
            panic!("8 bits")
        };
        let hash = p.iter().fold(0xcbf2_9ce4_8422_2325u64, |h, &b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        });
        assert_eq!(hash, BYTES_OF_THE_DEFAULT, "{hash:#x}");
    }

    /// FNV-1a of the fourth frame of [`small`].
    const BYTES_OF_THE_DEFAULT: u64 = 0x91ed_7778_75a6_5838;

    /// Displacement of a noise-free row against the scene at rest, by Gauss–Newton on the texture.
    fn measured(camera: &Camera, row: &[f32], y: usize) -> f64 {
        let cols = 0..row.len();
        let mut d = 0.0;
        for _ in 0..30 {
            let at = camera.texture().row(y, cols.clone(), d);
            let ahead = camera.texture().row(y, cols.clone(), d + 1e-3);
            let (mut num, mut den) = (0.0, 0.0);
            for ((r, a), b) in row.iter().zip(&at).zip(&ahead) {
                let slope = f64::from(b - a) / 1e-3;
                num += slope * f64::from(r - a);
                den += slope * slope;
            }
            d += num / den;
        }
        d
    }

    #[test]
    fn rows_stand_where_the_truth_says() {
        for exposure_ns in [0, 900_000] {
            let mut config = small();
            config.sensor.exposure_ns = exposure_ns;
            config.motion.tones = vec![tone(49.2, 0.4), tone(296.7, 0.05)];
            config.shake.tones = vec![tone(13.0, 0.2)];
            let camera = Camera::new(config).expect("good");
            for slot in camera.arriving() {
                for row in [0u32, 17, 39] {
                    let truth = camera.row_truth(slot, row);
                    let pixels = camera.noise_free_row(slot, row);
                    let d = measured(&camera, &pixels, row as usize);
                    assert!(
                        (d - truth.displacement_px - truth.shake_px).abs() < 1e-3,
                        "row {row}: {d} {truth:?}"
                    );
                    let t_s = slot.start_ns as f64 * 1e-9 + f64::from(row) * 40e-6;
                    if exposure_ns == 0 {
                        assert!((truth.displacement_px - camera.displacement_px(t_s)).abs() < 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn each_row_integrates_its_own_interval() {
        // A step in the middle of row 20's exposure: rows before see nothing, rows after all of it.
        let mut config = small();
        config.sensor.exposure_ns = 100_000;
        config.motion.steps = vec![Step {
            t_s: 20.0 * 40e-6 + 50e-6,
            value: 1.0,
        }];
        let camera = Camera::new(config).expect("good");
        let at = |row| camera.row_truth(camera.slots()[0], row).displacement_px;
        for (row, want) in [(18, 0.0), (19, 0.1), (20, 0.5), (21, 0.9), (22, 1.0)] {
            assert!((at(row) - want).abs() < 1e-6, "{row}: {}", at(row));
        }
    }

    #[test]
    fn fast_motion_within_an_exposure_is_the_average_of_many_instants() {
        let mut config = small();
        config.sensor.exposure_ns = 8_000_000;
        config.motion.tones = vec![tone(40.0, 12.0)];
        let camera = Camera::new(config.clone()).expect("good");
        let slot = camera.slots()[1];
        let blurred = camera.noise_free_row(slot, 5);
        let n = 4000;
        let mut mean = vec![0.0f64; 96];
        for k in 0..n {
            let t = slot.start_ns as f64 * 1e-9
                + 5.0 * 40e-6
                + 8e-3 * (f64::from(k) + 0.5) / f64::from(n);
            let row = camera.texture().row(5, 0..96, config.motion.at(t));
            mean.iter_mut()
                .zip(row)
                .for_each(|(m, r)| *m += f64::from(r) / f64::from(n));
        }
        for (b, m) in blurred.iter().zip(mean) {
            assert!((f64::from(*b) - m).abs() < 1e-5, "{b} {m}");
        }
    }

    #[test]
    fn only_the_vibrating_part_moves_and_the_background_only_shakes() {
        let mut config = small();
        config.motion.drift_px_per_s = 200.0;
        config.shake.steps = vec![Step {
            t_s: -1.0,
            value: 0.5,
        }];
        config.vibrating = Some(Rect {
            x: 30,
            y: 10,
            w: 40,
            h: 20,
        });
        config.background_cols = 35;
        let camera = Camera::new(config).expect("good");
        let slot = camera.slots()[2];
        for (row, moving) in [(5usize, 0..0usize), (15, 35..70), (30, 0..0)] {
            let got = camera.noise_free_row(slot, row as u32);
            let shaken = camera.texture().row(row, 0..96, 0.5);
            for x in 0..96 {
                assert_eq!(
                    (got[x] - shaken[x]).abs() < 1e-5,
                    !moving.contains(&x),
                    "row {row} column {x}"
                );
            }
        }
    }

    #[test]
    fn disturbances_do_what_they_say() {
        let mut config = small();
        let d = &mut config.disturbances;
        (d.dead_cols, d.saturated_rows, d.black_rows) = (vec![7], vec![3], vec![4]);
        d.scene_change_s = Some(0.02);
        d.gain_steps = vec![Step {
            t_s: 0.01,
            value: 0.5,
        }];
        d.hand = Some(Hand {
            start_s: 0.04,
            duration_s: 1.0,
            width_px: 4000.0,
            level: 0.1,
        });
        let camera = Camera::new(config).expect("good");
        let frames: Vec<Vec<u8>> = camera
            .frames()
            .map(|f| match f.pixels {
                PixelBuffer::U8(p) => p,
                PixelBuffer::U16(_) => panic!("8 bits"),
            })
            .collect();
        let row = |f: usize, y: usize| &frames[f][y * 96..][..96];
        let mean = |f: usize, y: usize| row(f, y).iter().map(|&v| f64::from(v)).sum::<f64>() / 96.0;
        assert!(
            row(0, 3)
                .iter()
                .enumerate()
                .all(|(x, &v)| v == if x == 7 { 0 } else { 255 })
        );
        assert!(row(0, 4).iter().all(|&v| v < 4));
        assert!((0..40).all(|y| row(0, y)[7] == 0));
        assert!((mean(1, 10) / mean(0, 10) - 0.5).abs() < 0.02);
        let differs = |a: usize, b: usize| {
            row(a, 20)
                .iter()
                .zip(row(b, 20))
                .filter(|(a, b)| a.abs_diff(**b) > 25)
                .count()
        };
        assert!(differs(1, 2) > 30 && differs(1, 1) == 0);
        // The hand comes in from the left and hides what lies there.
        let t = (camera.slots()[3].start_ns as f64 * 1e-9 - 0.04) * 4096.0;
        assert!(
            t > 40.0
                && row(3, 20)[2..20]
                    .iter()
                    .enumerate()
                    .all(|(k, &v)| k == 5 || v.abs_diff(13) < 8)
        );
    }

    #[test]
    fn read_from_the_bottom_the_last_row_comes_first() {
        let mut config = small();
        config.sensor.bottom_up = true;
        config.sensor.bits = 10;
        let camera = Camera::new(config).expect("good");
        let frame = camera.frames().next().expect("four frames");
        assert_eq!(frame.line(39).expect("last").start_ns, 0);
        assert_eq!(frame.line(0).expect("first").start_ns, 39 * 40_000);
        assert_eq!(frame.line(40), None);
        let LinePixels::U16(p) = frame.line(0).expect("first").pixels else {
            panic!("10 bits")
        };
        assert!(p.iter().all(|&v| v < 1024) && p.iter().any(|&v| v > 600));
        assert_eq!(camera.row_truth(camera.slots()[0], 39).middle_ns, 250_000);
    }
}
