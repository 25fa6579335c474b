//! The camera: frames out, truth beside them.

use rand_chacha::rand_core::RngCore;
use rand_distr::{Distribution, StandardNormal};
use rowtone::camera::Timing;

use super::config::{Config, Hand, Shadow};
use super::error::{SimError, check};
use super::exposure::{Quadrature, Seen};
use super::field::Player;
use super::frame::{Frame, PixelBuffer};
use super::motion::step_value;
use super::noise::Pixels;
use super::pattern::Pattern;
use super::plane::SPARE_ROWS;
use super::random::stream;
use super::schedule::{Slot, slots};
use super::startup;
use super::texture::Texture;

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
    players: Vec<Player>,
    pattern: Pattern,
    /// Row of the texture that the picture's first row shows at rest.
    first_row: usize,
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
        let modes = config.modes.iter().map(|mode| mode.reach_px());
        let [modes_x, modes_y] = modes.fold([0.0; 2], |sum, m| [sum[0] + m[0], sum[1] + m[1]]);
        let reach = config.motion.reach_px(seconds) + config.shake.reach_px(seconds) + modes_x;
        let first_row = match config.modes.is_empty() {
            true => 0,
            false => SPARE_ROWS + modes_y.ceil() as usize,
        };
        let rows = rows + 2 * first_row;
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
        let players = config.modes.iter().map(Player::new).collect();
        let pattern = Pattern::new(&config);
        Ok(Self {
            slots,
            texture,
            texture_after,
            quadrature: Quadrature::default(),
            pixels,
            players,
            pattern,
            first_row,
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
        let source = self.shown_in(slot);
        let mixture = self.config.defects.mixture();
        let mut levels = match mixture.len() {
            1 => self.read(source),
            _ => self.mixed(source, &mixture),
        };
        if self.arriving().next() == Some(slot)
            && let Some(kind) = self.config.faults.first_frame
        {
            startup::spoil(kind, &self.config, &mut levels);
        }
        let pixels = match sensor.bits {
            8 => PixelBuffer::U8(levels.iter().map(|&v| v as u8).collect()),
            _ => PixelBuffer::U16(levels.iter().map(|&v| v as u16).collect()),
        };
        Frame {
            number: slot.number,
            start_ns: slot.start_ns,
            cols: sensor.cols,
            pixels,
            line_time_ps: sensor.line_time_ps,
            rows: sensor.rows,
            bottom_up: sensor.bottom_up,
        }
    }

    /// The frame whose pixels the frame of `slot` shows: its own, but for a copy.
    fn shown_in(&self, slot: Slot) -> Slot {
        let copies = &self.config.faults.copies;
        let mut number = slot.number;
        while number > 0 && copies.contains(&number) {
            number -= 1;
        }
        self.slots.get(number as usize).copied().unwrap_or(slot)
    }

    /// The values that the sensor reads in a frame, row by row, DN.
    fn read(&self, slot: Slot) -> Vec<f32> {
        let sensor = &self.config.sensor;
        let mut rng = stream(self.config.seed, 0, slot.number);
        let frame_s = slot.start_ns as f64 * 1e-9;
        let gain = step_value(&self.config.disturbances.gain_steps, frame_s, 1.0) as f32;
        let (mut seen, mut normals) = (Seen::default(), Vec::new());
        let mut own = stream(self.config.seed, 7, slot.number);
        let row_noise = self.config.defects.row_noise as f32;
        let cols = sensor.cols as usize;
        let mut values = vec![0.0; cols * sensor.rows as usize];
        for (row, levels) in (0..sensor.rows).zip(values.chunks_mut(cols)) {
            self.light_row(frame_s, row, &mut seen, levels);
            let normal: f32 = match row_noise > 0.0 {
                true => StandardNormal.sample(&mut own),
                false => 0.0,
            };
            self.pattern.put(row, row_noise * normal, levels);
            self.pixels.read(levels, gain, &mut rng, &mut normals);
            for &dead in &self.config.disturbances.dead_cols {
                levels[dead as usize] = 0.0;
            }
        }
        values
    }

    /// What a phone's denoiser makes of a frame and those before it, in these shares.
    fn mixed(&self, slot: Slot, mixture: &[f32]) -> Vec<f32> {
        let newest = slot.number as usize;
        let before = self.slots.get(..=newest).unwrap_or_default();
        let mut mixed =
            vec![0.0; self.config.sensor.cols as usize * self.config.sensor.rows as usize];
        let mut left = 1.0;
        for (k, (&frame, &share)) in before.iter().rev().zip(mixture).enumerate() {
            // Before the recording began there was the first frame.
            let share = if k == newest { left } else { share };
            left -= share;
            for (mixed, value) in mixed.iter_mut().zip(self.read(frame)) {
                *mixed += share * value;
            }
        }
        mixed.iter_mut().for_each(|v| *v = v.round());
        mixed
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
        if self.players.is_empty() {
            self.light_row_alike(row, seen, levels);
        } else {
            self.light_row_by_place(row, seen, levels);
        }
        if let Some(uneven) = config.light.at_place(cols, y, config.sensor.rows as usize) {
            levels
                .iter_mut()
                .enumerate()
                .for_each(|(x, v)| *v *= uneven(x) as f32);
        }
        if let Some(shadow) = &config.disturbances.shadow {
            dim(shadow, from_s + 0.5 * exposure_s, levels);
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

impl Camera {
    /// Light of a row whose moving columns all move alike, along the row.
    fn light_row_alike(&self, row: u32, seen: &Seen, levels: &mut [f32]) {
        let (y, cols) = (row as usize, levels.len());
        let moving = self
            .config
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
    }

    /// Light of a row whose pixels move each in its own way.
    fn light_row_by_place(&self, row: u32, seen: &Seen, levels: &mut [f32]) {
        let config = &self.config;
        let r = place(row, config.sensor.rows);
        let moving = config.moving_cols(row).unwrap_or(0..0);
        let home = (self.first_row + row as usize) as f64;
        // What does not depend on the column: an instant's weight, motion, and waves.
        let instants: Vec<(f64, f64, f64, &Texture)> = seen
            .instants()
            .iter()
            .map(|&(t, share)| {
                let changed = config.disturbances.scene_change_s.is_some_and(|c| t >= c);
                let after = self.texture_after.as_ref().filter(|_| changed);
                let weight = share * config.light.at(t);
                (
                    weight,
                    config.shake.at(t),
                    config.motion.at(t),
                    after.unwrap_or(&self.texture),
                )
            })
            .collect();
        let waves: Vec<Vec<[f64; 2]>> = self
            .players
            .iter()
            .map(|player| {
                let at = |&(t, _): &(f64, f64)| player.waves(t);
                seen.instants().iter().map(at).collect()
            })
            .collect();
        for (x, level) in (0..).zip(levels.iter_mut()) {
            let c = place(x, config.sensor.cols);
            let felt: Vec<([f64; 2], &Vec<[f64; 2]>)> = self
                .players
                .iter()
                .zip(&waves)
                .filter(|(player, _)| player.mode().is_felt_at(x, row))
                .map(|(player, waves)| {
                    let mode = player.mode();
                    ([mode.x.at(c, r), mode.y.at(c, r)], waves)
                })
                .collect();
            let moves = moving.contains(&x);
            let mut sum = 0.0;
            for (i, &(weight, shake, motion, texture)) in instants.iter().enumerate() {
                let (mut right, mut down) = (shake + if moves { motion } else { 0.0 }, 0.0);
                for (shape, waves) in &felt {
                    right += shape[0] * waves[i][0];
                    down += shape[1] * waves[i][1];
                }
                sum += weight * texture.at(f64::from(x) - right, home - down);
            }
            *level = sum as f32;
        }
    }

    /// The row of the texture that `row` of the picture shows at rest.
    pub(super) fn texture_row(&self, row: u32) -> usize {
        self.first_row + row as usize
    }

    /// The fixed pattern of the sensor.
    pub(super) fn pattern(&self) -> &Pattern {
        &self.pattern
    }
}

/// Place of column or row `at` of `count`, −1 to 1.
fn place(at: u32, count: u32) -> f64 {
    (2.0 * f64::from(at) + 1.0) / f64::from(count) - 1.0
}

/// Takes the shadow's light; its place is that of the middle of the exposure.
fn dim(shadow: &Shadow, t_s: f64, levels: &mut [f32]) {
    let middle = (t_s - shadow.start_s) / shadow.duration_s * levels.len() as f64;
    for (x, v) in levels.iter_mut().enumerate() {
        let away = (x as f64 - middle) / shadow.width_px;
        *v *= (1.0 - shadow.depth * libm::exp(-0.5 * away * away)) as f32;
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
mod plane_tests;
#[cfg(test)]
mod tests;
