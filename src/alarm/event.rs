//! What an alarm tells.

use super::{Level, MAX_RULES};
use crate::report::Report;

/// Most events of one window: three a rule, and one of the gate.
pub const MAX_EVENTS: usize = 3 * MAX_RULES + 1;

/// Something that happened in a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Which rule, counted from 0; `None` of the machine as a whole.
    pub rule: Option<u8>,
    /// What happened.
    pub happening: Happening,
    /// Number of the report that brought it; 0 where a command did.
    pub seq: u32,
    /// End of that report's window, ms since the board or the recording started; 0 where a command brought it.
    pub time_ms: u64,
}

/// Kinds of events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Happening {
    /// The rule's level changed, its latch included.
    Level {
        /// What it was.
        from: Level,
        /// What it is.
        to: Level,
        /// What the last window measured, in the quantity's unit, where it did.
        value: Option<f32>,
    },
    /// Somebody has seen an alarm whose cause is not gone.
    Acknowledged,
    /// The baseline is learned; the rule's learned limits hold from now on.
    Learned {
        /// The usual value, in the quantity's unit.
        centre: f32,
        /// Its usual standard deviation from window to window.
        spread: f32,
    },
    /// No window told anything for so long that silence is no good news.
    Blind,
    /// Windows tell something again.
    Sighted,
    /// The machine has started.
    Started,
    /// The machine has stopped: nothing is judged, and what is not latched clears.
    Stopped,
}

impl Event {
    pub(super) fn of(report: &Report, rule: Option<usize>, happening: Happening) -> Self {
        Self {
            // At most MAX_RULES.
            rule: rule.map(|n| n as u8),
            happening,
            seq: report.seq,
            time_ms: report.time_ms,
        }
    }
}
