//! Whether the machine runs.

use super::{Gate, Reading};
use crate::report::Report;

/// It has stopped where the gate's quantity is less than this share of its limit.
const STOPPED: f32 = 0.8;
/// Windows, one after the other, that start or stop it: one alone may be a knock.
const WINDOWS: u8 = 2;

/// A gate's memory.
#[derive(Clone, Debug)]
pub(super) struct GateWatch {
    gate: Gate,
    running: bool,
    /// Windows one after the other that speak against `running`.
    against: u8,
    /// Windows until it is judged.
    settling: u16,
}

impl GateWatch {
    pub(super) fn new(gate: Gate) -> Self {
        Self {
            gate,
            running: false,
            against: 0,
            settling: 0,
        }
    }

    pub(super) fn is_running(&self) -> bool {
        self.running
    }

    pub(super) fn is_settled(&self) -> bool {
        self.running && self.settling == 0
    }

    /// Takes a window; whether it runs now, where that has changed. A window that tells nothing changes nothing.
    pub(super) fn window(&mut self, report: &Report) -> Option<bool> {
        self.settling = self.settling.saturating_sub(1);
        let (limit, stopped) = (self.gate.above, STOPPED * self.gate.above);
        let runs = match self.gate.quantity.of(report) {
            Reading::Value(v) | Reading::AtLeast(v) if v >= limit => true,
            Reading::Value(v) | Reading::AtMost(v) if v < stopped => false,
            Reading::Unknown => return None,
            _ => self.running,
        };
        if runs == self.running {
            self.against = 0;
            return None;
        }
        self.against += 1;
        if self.against < WINDOWS {
            return None;
        }
        self.against = 0;
        self.running = runs;
        self.settling = if runs {
            self.gate.settle_windows.saturating_add(1)
        } else {
            0
        };
        self.settling = self.settling.saturating_sub(1);
        Some(runs)
    }
}
