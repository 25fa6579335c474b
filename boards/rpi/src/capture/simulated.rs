//! A camera that is none: textured rows, each moved as the machine was at its own time.
//!
//! For `--simulate` and the tests. It is far simpler than host-sim's camera (no noise model, no exposure) and
//! has what those lack: faults on demand.

use std::f64::consts::TAU;
use std::time::Duration;

use rowtone::camera::RawFormat;

use super::{CameraError, Facts, Frame, Shape, Source};

/// A tone of the simulated machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Frequency, Hz.
    pub hz: f64,
    /// Zero to peak, px.
    pub px: f64,
}

/// What to simulate.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// From one row to the next, s.
    pub line_time_s: f64,
    /// Exposure of a row, s: the motion is averaged over it.
    pub exposure_s: f64,
    /// From one frame to the next, ns.
    pub frame_period_ns: i64,
    /// Motion.
    pub tones: Vec<Tone>,
    /// Frames after which the camera is gone; never where there is none.
    pub frames: Option<u32>,
    /// Frames after which the camera is there and gives no more; never where there is none.
    pub stuck_after: Option<u32>,
    /// Every so many frames one is lost; never where there is none.
    pub lose_every: Option<u32>,
    /// Every so many frames one is corrupt; never where there is none.
    pub spoil_every: Option<u32>,
    /// Wait for each frame's time, as a camera does.
    pub paced: bool,
}

impl Default for Scene {
    /// 320 x 240 at 60 frames/s, 97.3 Hz with 0.4 px and 211.7 Hz with 0.1 px.
    fn default() -> Self {
        Self {
            width: 320,
            height: 240,
            line_time_s: 66e-6,
            exposure_s: 0.0,
            frame_period_ns: 16_666_667,
            tones: vec![Tone { hz: 97.3, px: 0.4 }, Tone { hz: 211.7, px: 0.1 }],
            frames: None,
            stuck_after: None,
            lose_every: None,
            spoil_every: None,
            paced: true,
        }
    }
}

impl Scene {
    /// Where the machine is on average over an exposure that starts at `time_s`, px.
    pub fn shift_px(&self, time_s: f64) -> f64 {
        let middle_s = time_s + 0.5 * self.exposure_s;
        let tones = self.tones.iter().map(|t| {
            let half_turn = TAU / 2.0 * t.hz * self.exposure_s;
            let averaged = if half_turn == 0.0 {
                1.0
            } else {
                half_turn.sin() / half_turn
            };
            averaged * t.px * (TAU * t.hz * middle_s).sin()
        });
        tones.sum()
    }

    /// One frame, 8-bit, row by row.
    pub fn draw(&self, start_ns: i64, seed: u32, to: &mut Vec<u8>) {
        to.clear();
        let mut noise = seed.wrapping_mul(2_654_435_761) | 1;
        for y in 0..self.height {
            let time_s = start_ns as f64 * 1e-9 + f64::from(y) * self.line_time_s;
            let d = self.shift_px(time_s);
            // Three waves whose phases differ from row to row: nothing a row could be confused with.
            let row = f64::from(y);
            let mut waves = [
                Wave::new(45.0, 13.7, 0.9 * row, d),
                Wave::new(30.0, 29.3, -0.31 * row, d),
                Wave::new(20.0, 8.9, 1.7 * row + TAU / 4.0, d),
            ];
            for _ in 0..self.width {
                let light = 120.0 + waves.iter_mut().map(Wave::next).sum::<f64>();
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let dither = f64::from(noise >> 8) / f64::from(1u32 << 24);
                to.push((light + dither) as u8);
            }
        }
    }
}

/// A sine along a row, pixel by pixel: a pointer that turns, for a sine each would take most of the time.
struct Wave {
    height: f64,
    at: (f64, f64),
    turn: (f64, f64),
}

impl Wave {
    fn new(height: f64, length_px: f64, phase: f64, shift_px: f64) -> Self {
        Self {
            height,
            at: (phase - TAU * shift_px / length_px).sin_cos(),
            turn: (TAU / length_px).sin_cos(),
        }
    }

    fn next(&mut self) -> f64 {
        let ((sin, cos), (ds, dc)) = (self.at, self.turn);
        self.at = (sin * dc + cos * ds, cos * dc - sin * ds);
        self.height * sin
    }
}

/// See the [module](self).
#[derive(Debug)]
pub struct Simulated {
    scene: Scene,
    facts: Facts,
    sequence: u32,
    start_ns: i64,
    bytes: Vec<u8>,
    /// A frame period asked for, and from which frame on it holds.
    asked: Option<(u32, i64)>,
}

/// Frames that still come at the rate before, as sensors have it.
const RATE_DELAY: u32 = 3;

impl Simulated {
    /// A camera that starts at frame 0.
    pub fn new(scene: Scene) -> Self {
        let shape = Shape {
            width: scene.width,
            height: scene.height,
            stride: usize::from(scene.width),
            format: RawFormat::Raw8,
            bayer: false,
        };
        Self {
            facts: Facts {
                id: "simulated".to_owned(),
                shape,
                line_time: Some((scene.line_time_s, "the simulation")),
                frame_period_ns: Some(scene.frame_period_ns),
                shortest_frame_s: None,
                reasons: String::new(),
            },
            scene,
            sequence: 0,
            start_ns: 0,
            bytes: Vec::new(),
            asked: None,
        }
    }
}

impl Source for Simulated {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn next(
        &mut self,
        patience: Duration,
        take: &mut dyn FnMut(Frame<'_>),
    ) -> Result<(), CameraError> {
        if self
            .scene
            .frames
            .is_some_and(|frames| self.sequence >= frames)
        {
            return Err(CameraError::Gone);
        }
        if self.scene.stuck_after.is_some_and(|n| self.sequence >= n) {
            std::thread::sleep(patience);
            return Err(CameraError::Silent(patience));
        }
        if let Some((from, period_ns)) = self.asked
            && self.sequence >= from
        {
            self.scene.frame_period_ns = period_ns;
            self.asked = None;
        }
        if self.scene.paced {
            std::thread::sleep(Duration::from_nanos(self.scene.frame_period_ns as u64));
        }
        let due = |every: Option<u32>, sequence: u32| {
            every.is_some_and(|every| sequence % every == every - 1)
        };
        if due(self.scene.lose_every, self.sequence) {
            self.sequence += 1;
            self.start_ns += self.scene.frame_period_ns;
        }
        self.scene
            .draw(self.start_ns, self.sequence, &mut self.bytes);
        take(Frame {
            sequence: self.sequence,
            start_ns: Some(self.start_ns),
            bytes: &self.bytes,
            intact: !due(self.scene.spoil_every, self.sequence),
        });
        self.sequence += 1;
        self.start_ns += self.scene.frame_period_ns;
        Ok(())
    }

    fn set_frame_period(&mut self, period_ns: i64) {
        self.asked = Some((self.sequence.saturating_add(RATE_DELAY), period_ns));
    }
}
