//! Phases from the start of the picture's first frame, where a part of it was measured.
//!
//! The core's clock starts with the first row that it is given. A part that begins further down is exposed later.

use core::f64::consts::TAU;

use rowtone::camera::Timing;
use rowtone::report::{PeakShape, Report};

/// How much later than the picture's first row a part's is exposed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Later {
    seconds: f64,
}

impl Later {
    /// Of a part that begins at this row.
    pub(crate) fn of_row(row: usize, timing: Timing) -> Self {
        let line_time_s = f64::from(timing.line_time_ps()) * 1e-12;
        Self {
            seconds: row as f64 * line_time_s,
        }
    }

    /// Turns a phase of x·sin(2πf·t + phase), t from the part's first row, to t from the picture's.
    fn turn(self, hz: f32, phase_rad: &mut f32) {
        let phase = f64::from(*phase_rad) - TAU * f64::from(hz) * self.seconds;
        *phase_rad = (phase - TAU * (phase / TAU).round()) as f32;
    }

    /// The same of all phases of a window.
    pub(crate) fn turn_all(self, report: &mut Report, shapes: &mut [PeakShape]) {
        if self.seconds == 0.0 {
            return;
        }
        for peak in &mut report.peaks {
            if let Some(motion) = &mut peak.motion {
                self.turn(peak.hz, &mut motion.phase_rad);
                if let Some(phase) = &mut motion.y_phase_rad {
                    self.turn(peak.hz, phase);
                }
            }
        }
        for shape in shapes {
            for row in &mut shape.rows {
                self.turn(shape.hz, &mut row.x_phase_rad);
                self.turn(shape.hz, &mut row.y_phase_rad);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_that_is_exposed_a_quarter_period_later_is_ahead_by_as_much() {
        // 100 Hz turn by a quarter in 2.5 ms: 25 rows of 100 us.
        let timing = Timing::new(100_000_000, 0, 50).unwrap();
        let mut phase_rad = 0.5;
        Later::of_row(25, timing).turn(100.0, &mut phase_rad);
        assert!((phase_rad - (0.5 - core::f32::consts::FRAC_PI_2)).abs() < 1e-6);
        let mut turned = 3.0;
        Later::of_row(75, timing).turn(100.0, &mut turned);
        // 3 - 3π/2, which is within half a turn.
        assert!(
            (turned - (3.0 - 3.0 * core::f32::consts::FRAC_PI_2)).abs() < 1e-6,
            "{turned}"
        );
    }
}
