//! Which row of which frame a line is, and when it was exposed.
//!
//! Runs where the interrupts run: a row is counted when its last word is in memory, whether or not anybody
//! has time for it, so that a dropped line never renumbers the ones after it.

use crate::clock::{FrameClock, FrameStart};

/// Where and when a line was taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Frame, as in [`rowtone::camera::Line`].
    pub frame: u32,
    /// Row, likewise.
    pub row: u16,
    /// Start of its frame, ns.
    pub frame_start_ns: i64,
}

/// What was lost, since the start. Each saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Frames of which nothing was seen.
    pub lost_frames: u32,
    /// Frames that had fewer rows than the camera has.
    pub incomplete_frames: u32,
    /// Lines beyond a frame's last row, or before the first VSYNC.
    pub stray_lines: u32,
}

/// Numbers lines.
#[derive(Clone, Debug)]
pub struct Frames {
    clock: FrameClock,
    sensor_rows: u16,
    frame: Option<FrameStart>,
    rows_seen: u16,
    losses: Losses,
}

fn count(counter: &mut u32, by: u32) {
    *counter = counter.saturating_add(by);
}

impl Frames {
    /// For a camera that sends `sensor_rows` rows a frame, every `nominal_ns`.
    pub const fn new(nominal_ns: i64, sensor_rows: u16) -> Self {
        Self {
            clock: FrameClock::new(nominal_ns),
            sensor_rows,
            frame: None,
            rows_seen: 0,
            losses: Losses {
                lost_frames: 0,
                incomplete_frames: 0,
                stray_lines: 0,
            },
        }
    }

    /// VSYNC rose.
    pub fn vsync(&mut self, now_ns: i64) {
        let Some(start) = self.clock.vsync(now_ns) else {
            return;
        };
        if self.frame.is_some() && self.rows_seen < self.sensor_rows {
            count(&mut self.losses.incomplete_frames, 1);
        }
        count(&mut self.losses.lost_frames, start.lost);
        (self.frame, self.rows_seen) = (Some(start), 0);
    }

    /// A line is complete; `None` when it belongs to no frame.
    pub fn line(&mut self) -> Option<Place> {
        match self.frame {
            Some(start) if self.rows_seen < self.sensor_rows => {
                let row = self.rows_seen;
                self.rows_seen += 1;
                Some(Place {
                    frame: start.frame,
                    row,
                    frame_start_ns: start.start_ns,
                })
            }
            _ => {
                count(&mut self.losses.stray_lines, 1);
                None
            }
        }
    }

    /// Lines may have been missed without notice: what still comes of this frame cannot be numbered.
    pub fn abandon(&mut self) {
        if self.frame.take().is_some() {
            count(&mut self.losses.incomplete_frames, 1);
        }
        self.rows_seen = 0;
    }

    /// The camera was started anew: the next line comes after the next VSYNC.
    pub fn restart(&mut self) {
        (self.frame, self.rows_seen) = (None, 0);
        self.clock.restart();
    }

    /// The frames' rhythm.
    pub const fn clock(&self) -> &FrameClock {
        &self.clock
    }

    /// What was lost.
    pub const fn losses(&self) -> Losses {
        self.losses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: i64 = 17_472_000;

    fn frame(frames: &mut Frames, n: i64, rows: u16) -> Vec<Option<Place>> {
        frames.vsync(n * PERIOD_NS);
        (0..rows).map(|_| frames.line()).collect()
    }

    #[test]
    fn rows_and_frames_are_numbered() {
        let mut frames = Frames::new(PERIOD_NS, 244);
        for n in 0..5 {
            let places = frame(&mut frames, n, 244);
            let last = places[243].unwrap();
            assert_eq!(
                (last.frame, last.row, last.frame_start_ns),
                (n as u32, 243, n * PERIOD_NS)
            );
        }
        assert_eq!(frames.losses(), Losses::default());
    }

    #[test]
    fn an_abandoned_frame_takes_no_more_lines() {
        let mut frames = Frames::new(PERIOD_NS, 244);
        frame(&mut frames, 0, 100);
        frames.abandon();
        assert_eq!(frames.line(), None);
        assert!(frame(&mut frames, 1, 244)[243].is_some());
        assert_eq!(
            frames.losses(),
            Losses {
                lost_frames: 0,
                incomplete_frames: 1,
                stray_lines: 1
            }
        );
    }

    #[test]
    fn losses_are_counted_and_do_not_shift_rows() {
        let mut frames = Frames::new(PERIOD_NS, 244);
        assert_eq!(frames.line(), None); // before any VSYNC
        frame(&mut frames, 0, 200); // 44 rows missing
        frame(&mut frames, 1, 245); // one too many
        let places = frame(&mut frames, 4, 244); // frames 2 and 3 missing
        assert_eq!((places[0].unwrap().frame, places[0].unwrap().row), (4, 0));
        assert_eq!(
            frames.losses(),
            Losses {
                lost_frames: 2,
                incomplete_frames: 1,
                stray_lines: 2
            }
        );
    }
}
