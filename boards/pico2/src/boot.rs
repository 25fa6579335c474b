//! Why the board started, and how often, across resets.
//!
//! Two words in the watchdog's scratch registers, which every reset but a power cycle leaves alone
//! (RP2350 datasheet, section "Watchdog"; the boot ROM uses registers 4 to 7, so these are 0 to 2).

use core::fmt;
use rowtone::report::{Report, Warning, Warnings};

/// Why the board started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// Power came, or the RUN pin.
    PowerOn,
    /// Nobody fed the watchdog.
    Watchdog,
    /// The firmware panicked; its message went out on the UART.
    Panic,
    /// The firmware was told to.
    Command,
}

impl ResetCause {
    /// What the first report says of it; how often the board has started is the report's session. That power came needs
    /// no warning.
    pub const fn warnings(self) -> Warnings {
        match self {
            Self::PowerOn => Warnings::NONE,
            Self::Watchdog => Warnings::of(Warning::WatchdogReset),
            Self::Panic => Warnings::of(Warning::PanicReset),
            Self::Command => Warnings::of(Warning::CommandReset),
        }
    }
}

impl fmt::Display for ResetCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PowerOn => "power-on",
            Self::Watchdog => "watchdog",
            Self::Panic => "panic",
            Self::Command => "command",
        })
    }
}

/// This start of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boot {
    /// Why.
    pub cause: ResetCause,
    /// Starts since power came, this one included.
    pub starts: u32,
}

/// Scratch registers that are used.
pub const WORDS: usize = 3;

const MAGIC: u32 = 0x726F_7774; // "rowt"
const UNTOLD: u32 = 0;
const PANIC: u32 = 1;
const COMMAND: u32 = 2;

/// What the scratch registers say.
fn read(scratch: [u32; WORDS]) -> Option<(u32, u32)> {
    let [starts, said, check] = scratch;
    (check == checked(starts, said)).then_some((starts, said))
}

const fn checked(starts: u32, said: u32) -> u32 {
    MAGIC ^ starts.rotate_left(7) ^ said.rotate_left(19)
}

const fn words(starts: u32, said: u32) -> [u32; WORDS] {
    [starts, said, checked(starts, said)]
}

impl Boot {
    /// From the scratch registers as found at the start. Write [`Boot::scratch`] back.
    pub fn new(scratch: [u32; WORDS]) -> Self {
        match read(scratch) {
            None => Self {
                cause: ResetCause::PowerOn,
                starts: 1,
            },
            Some((starts, said)) => Self {
                cause: match said {
                    PANIC => ResetCause::Panic,
                    COMMAND => ResetCause::Command,
                    _ => ResetCause::Watchdog,
                },
                starts: starts.saturating_add(1),
            },
        }
    }

    /// What the scratch registers hold while the firmware runs.
    pub const fn scratch(&self) -> [u32; WORDS] {
        words(self.starts, UNTOLD)
    }
}

/// Marks the first report since the start with its cause, and no other.
#[derive(Clone, Copy, Debug)]
pub struct FirstReport {
    untold: Warnings,
}

impl FirstReport {
    /// None has been sent since this start.
    pub const fn new(boot: &Boot) -> Self {
        Self {
            untold: boot.cause.warnings(),
        }
    }

    /// Call it with each report, in the order in which they are sent.
    pub fn marked(&mut self, mut report: Report) -> Report {
        report.warnings = report.warnings.union(core::mem::take(&mut self.untold));
        report
    }
}

/// What a panic writes before it lets the watchdog reset the board.
pub fn panicking(scratch: [u32; WORDS]) -> [u32; WORDS] {
    words(read(scratch).map_or(1, |(starts, _)| starts), PANIC)
}

/// What a commanded restart writes before it.
pub fn restarting(scratch: [u32; WORDS]) -> [u32; WORDS] {
    words(read(scratch).map_or(1, |(starts, _)| starts), COMMAND)
}

impl fmt::Display for Boot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "started by {}, start {} since power-on",
            self.cause, self.starts
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_on_then_resets() {
        let first = Boot::new([0xDEAD_BEEF, 3, 0]);
        assert_eq!(
            first,
            Boot {
                cause: ResetCause::PowerOn,
                starts: 1
            }
        );
        let second = Boot::new(first.scratch());
        assert_eq!(
            second,
            Boot {
                cause: ResetCause::Watchdog,
                starts: 2
            }
        );
        let third = Boot::new(panicking(second.scratch()));
        assert_eq!(
            third,
            Boot {
                cause: ResetCause::Panic,
                starts: 3
            }
        );
        let fourth = Boot::new(restarting(third.scratch()));
        assert_eq!(
            fourth,
            Boot {
                cause: ResetCause::Command,
                starts: 4
            }
        );
        assert_eq!(
            fourth.to_string(),
            "started by command, start 4 since power-on"
        );
    }

    #[test]
    fn the_first_report_says_why_and_no_other_does() {
        let power_on = Boot::new([0; WORDS]);
        let watchdog = Boot::new(power_on.scratch());
        let panic = Boot::new(panicking(watchdog.scratch()));
        let command = Boot::new(restarting(panic.scratch()));
        let causes = [
            (power_on, Warnings::NONE),
            (watchdog, Warnings::of(Warning::WatchdogReset)),
            (panic, Warnings::of(Warning::PanicReset)),
            (command, Warnings::of(Warning::CommandReset)),
        ];
        for (boot, warning) in causes {
            let mut first = FirstReport::new(&boot);
            for expected in [warning, Warnings::NONE, Warnings::NONE] {
                let lost = Warnings::of(Warning::LostFrames);
                let report = first.marked(report(lost));
                assert_eq!(report.warnings, lost.union(expected), "{boot}");
            }
        }
    }

    fn report(warnings: Warnings) -> Report {
        Report {
            time_ms: 1000,
            window_s: 1.0,
            fps: 57.0,
            lines: 13_680,
            noise_px: 0.01,
            warnings,
            ..Report::EMPTY
        }
    }

    #[test]
    fn scratch_that_was_never_written_is_a_power_on() {
        for scratch in [[0; 3], [u32::MAX; 3], [1, 0, 1]] {
            assert_eq!(Boot::new(scratch).cause, ResetCause::PowerOn);
        }
    }
}
