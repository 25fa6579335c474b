//! The displacement of the last frames, sample by sample.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use rowtone::timeline::Sample;
use serde::Serialize;

/// Most samples kept.
const KEPT: usize = 1 << 15;
/// Most that are waiting to be handed over.
const WAITING: usize = 4096;
/// Most points that are shown.
const SHOWN: usize = 2000;

/// One sample: rows of one frame, combined.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Moment {
    frame: u32,
    slot: u16,
    time_ns: i64,
    x_px: f32,
    y_px: Option<f32>,
}

/// The samples, on the side where they are read.
#[derive(Debug)]
pub struct Motion {
    moments: Mutex<VecDeque<Moment>>,
}

impl Default for Motion {
    /// With all its memory, so that whoever hands over never allocates.
    fn default() -> Self {
        Self {
            moments: Mutex::new(VecDeque::with_capacity(KEPT)),
        }
    }
}

/// The samples, on the side where they are made: it never waits.
#[derive(Debug)]
pub struct MotionWriter {
    waiting: Vec<Moment>,
}

impl Default for MotionWriter {
    fn default() -> Self {
        Self {
            waiting: Vec::with_capacity(WAITING),
        }
    }
}

impl MotionWriter {
    /// Notes a sample; the oldest that nobody took are left out where too many wait.
    pub fn sample(&mut self, sample: &Sample) {
        if self.waiting.len() == WAITING {
            self.waiting.clear();
        }
        let planar = sample
            .vertical
            .and_then(|v| v.solve(sample.shift_px, sample.information_per_px2));
        let (x_px, y_px) = planar.map_or((sample.shift_px, None), |p| (p.px[0], Some(p.px[1])));
        self.waiting.push(Moment {
            frame: sample.frame,
            slot: sample.slot,
            time_ns: sample.time_ns,
            x_px,
            y_px,
        });
    }

    /// Hands over what was noted, if nobody reads just now; else it is tried again with the next frame.
    pub fn hand_over(&mut self, motion: &Motion) {
        let Ok(mut moments) = motion.moments.try_lock() else {
            return;
        };
        let beyond = (moments.len() + self.waiting.len()).saturating_sub(KEPT);
        let beyond = beyond.min(moments.len());
        moments.drain(..beyond);
        moments.extend(self.waiting.drain(..));
    }
}

/// Points of a curve: times since the first of them, and displacements.
#[derive(Debug, Default, PartialEq, Serialize)]
pub struct Curve {
    /// Number of the frame.
    pub frame: Vec<u32>,
    /// Time, ms after the first point.
    pub t_ms: Vec<f32>,
    /// Displacement along the rows, px, its mean at each place taken out.
    pub x_px: Vec<f32>,
    /// Displacement along the columns, px; `None` where it is not known.
    pub y_px: Vec<Option<f32>>,
}

impl Motion {
    /// Forgets all samples.
    pub fn clear(&self) {
        self.lock().clear();
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, VecDeque<Moment>> {
        self.moments.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The last `frames` frames.
    pub fn last(&self, frames: u32) -> Curve {
        // Copied at once: whoever writes never waits, and is to be missed by little.
        let moments: Vec<Moment> = self.lock().iter().copied().collect();
        let Some(newest) = moments.iter().map(|m| m.frame).max() else {
            return Curve::default();
        };
        let slots = moments
            .iter()
            .map(|m| usize::from(m.slot) + 1)
            .max()
            .unwrap_or(0);
        // Each group of rows has an origin of its own: that of its reference.
        let mut means = vec![[0.0_f64; 4]; slots];
        for m in &moments {
            let [x, nx, y, ny] = &mut means[usize::from(m.slot)];
            *x += f64::from(m.x_px);
            *nx += 1.0;
            if let Some(y_px) = m.y_px {
                *y += f64::from(y_px);
                *ny += 1.0;
            }
        }
        let from = newest.saturating_sub(frames.saturating_sub(1));
        let mut shown: Vec<Moment> = moments.into_iter().filter(|m| m.frame >= from).collect();
        shown.sort_by_key(|m| m.time_ns);
        let beyond = shown.len().saturating_sub(SHOWN);
        let shown = shown.get(beyond..).unwrap_or_default();
        let first_ns = shown.first().map_or(0, |m| m.time_ns);
        let mut curve = Curve::default();
        for m in shown {
            let [x, nx, y, ny] = means[usize::from(m.slot)];
            curve.frame.push(m.frame);
            curve.t_ms.push((m.time_ns - first_ns) as f32 * 1e-6);
            curve.x_px.push((f64::from(m.x_px) - x / nx) as f32);
            curve
                .y_px
                .push(m.y_px.map(|v| (f64::from(v) - y / ny) as f32));
        }
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(frame: u32, slot: u16, shift_px: f32) -> Sample {
        Sample {
            frame,
            slot,
            time_ns: i64::from(frame) * 1_000_000 + i64::from(slot) * 1000,
            shift_px,
            information_per_px2: 1.0,
            vertical: None,
            curvature: Default::default(),
            spread: Default::default(),
        }
    }

    #[test]
    fn the_last_frames_come_without_each_groups_own_origin() {
        let (motion, mut writer) = (Motion::default(), MotionWriter::default());
        assert_eq!(motion.last(4), Curve::default());
        for frame in 0..10 {
            let swing = if frame % 2 == 0 { 0.5 } else { -0.5 };
            writer.sample(&sample(frame, 0, 7.0 + swing));
            writer.sample(&sample(frame, 1, -3.0 + swing));
            writer.hand_over(&motion);
        }
        let curve = motion.last(2);
        assert_eq!(curve.frame, [8, 8, 9, 9]);
        assert_eq!(curve.x_px, [0.5, 0.5, -0.5, -0.5]);
        assert_eq!(curve.y_px, [None; 4]);
        assert!((curve.t_ms[3] - 1.001).abs() < 1e-6);
    }

    #[test]
    fn whoever_measures_waits_for_nobody_and_memory_is_bounded() {
        let (motion, mut writer) = (Motion::default(), MotionWriter::default());
        let reading = motion.lock();
        for frame in 0..3 * WAITING as u32 {
            writer.sample(&sample(frame, 0, 0.0));
            writer.hand_over(&motion);
        }
        assert!(writer.waiting.len() <= WAITING && writer.waiting.capacity() == WAITING);
        drop(reading);
        for frame in 0..2 * KEPT as u32 {
            writer.sample(&sample(frame, 0, 0.0));
            writer.hand_over(&motion);
        }
        assert_eq!(motion.lock().len(), KEPT);
        assert!(motion.last(u32::MAX).frame.len() <= SHOWN);
    }
}
