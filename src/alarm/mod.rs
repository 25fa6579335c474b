//! Alarms: from one report a window to *normal*, *warning* and *trip*.
//!
//! Beside the pipeline, behind [`mod@crate::report`]: [`Alarms::window`] takes each report as it comes and says what has
//! changed. Nothing here knows a clock; all delays are counted in windows.
//!
//! - A [`Rule`] names a [`Quantity`] of the report and its limits, fixed ones or such as are learned from the machine
//!   ([`Limit`]).
//! - A window is evidence or it is none. What could not be measured (no scale, no picture, an ambiguous tone, a number
//!   that is not finite) neither raises nor clears an alarm; where nothing is known for long the alarm is *blind*, and
//!   says so.
//! - A limit is passed when so many of the last windows are above it ([`Rule::delay`]): single windows, such as those of a
//!   passing truck, are outvoted.
//! - A latched alarm stays until it is acknowledged, though its cause be gone.
//! - While the machine does not run ([`Gate`]) nothing is judged and nothing learned.
//!
//! ```
//! use rowtone::alarm::{Alarms, Config, Level, Limit, Rule};
//! use rowtone::report::Report;
//!
//! let rule = Rule { warning: Some(Limit::Fixed(4.5)), trip: Some(Limit::Fixed(7.1)), delay: 2, ..Rule::velocity("fan") };
//! let config = Config { rules: [rule].into_iter().collect(), ..Config::default() };
//! let mut alarms = Alarms::new(config)?;
//! let shaking = Report { um_per_px: Some(10.0), velocity_mm_s_rms: Some(5.0), ..Report::default() };
//! assert!(alarms.window(&shaking).is_empty()); // one window is none
//! assert_eq!(alarms.window(&shaking).len(), 1); // two are
//! assert_eq!(alarms.level(), Level::Warning);
//! # Ok::<(), rowtone::alarm::RuleError>(())
//! ```

mod baseline;
mod event;
mod gate;
mod limit;
mod quantity;
mod reading;
mod rule;
#[cfg(test)]
mod tests;
mod watch;

use heapless::Vec;

pub use baseline::{Baseline, LEARN_WINDOWS};
pub use event::{Event, Happening, MAX_EVENTS};
pub use quantity::{Band, Part, Quantity, ToneMeasure};
pub use reading::Reading;
pub use rule::{Config, Gate, Limit, MAX_DELAY, MAX_NAME, MAX_RULES, Rule, RuleError};
pub use watch::{Level, Status};

use crate::report::Report;
use gate::GateWatch;
use watch::Watch;

/// All alarms of one machine.
#[derive(Clone, Debug)]
pub struct Alarms {
    gate: Option<GateWatch>,
    watches: Vec<Watch, MAX_RULES>,
    blind_windows: u16,
}

/// What happened in one window, or upon one command.
pub type Events = Vec<Event, MAX_EVENTS>;

impl Alarms {
    /// Alarms that have seen nothing yet.
    ///
    /// # Errors
    /// [`RuleError`] for rules that contradict themselves or each other.
    pub fn new(config: Config) -> Result<Self, RuleError> {
        config.check()?;
        Ok(Self {
            gate: config.running.map(GateWatch::new),
            blind_windows: config.blind_windows,
            watches: config
                .rules
                .into_iter()
                .map(|rule| Watch::new(rule, config.learn_windows))
                .collect(),
        })
    }

    /// Takes the next window's report and says what has changed by it, in the order of the rules.
    pub fn window(&mut self, report: &Report) -> Events {
        let mut events = Events::new();
        let mut tell = |rule: Option<usize>, happening| {
            // There is room for all that one window can do.
            let _ = events.push(Event::of(report, rule, happening));
        };
        let runs = match &mut self.gate {
            None => true,
            Some(gate) => {
                if let Some(runs) = gate.window(report) {
                    let change = if runs {
                        Happening::Started
                    } else {
                        Happening::Stopped
                    };
                    tell(None, change);
                    for (n, watch) in self.watches.iter_mut().enumerate().filter(|_| !runs) {
                        watch.rest(|happening| tell(Some(n), happening));
                    }
                }
                gate.is_settled()
            }
        };
        if runs {
            for (n, watch) in self.watches.iter_mut().enumerate() {
                watch.window(report, self.blind_windows, |happening| {
                    tell(Some(n), happening)
                });
            }
        }
        events
    }

    /// Acknowledges one rule's alarm, counted from 0, or all: a latched one whose cause is gone clears.
    pub fn acknowledge(&mut self, rule: Option<usize>) -> Events {
        let mut events = Events::new();
        for (n, watch) in self.watches.iter_mut().enumerate() {
            if rule.is_none_or(|rule| rule == n) {
                watch.acknowledge(|happening| {
                    let _ = events.push(Event::of(&Report::EMPTY, Some(n), happening));
                });
            }
        }
        events
    }

    /// Learns one rule's baseline anew, or all: after the machine was repaired, or runs otherwise.
    pub fn learn_again(&mut self, rule: Option<usize>) {
        for (n, watch) in self.watches.iter_mut().enumerate() {
            if rule.is_none_or(|rule| rule == n) {
                watch.set_baseline(None);
            }
        }
    }

    /// Gives a rule the baseline that was learned before a restart; a rule that is not there is passed over.
    pub fn set_baseline(&mut self, rule: usize, baseline: Baseline) {
        if let Some(watch) = self.watches.get_mut(rule) {
            watch.set_baseline(Some(baseline));
        }
    }

    /// The worst level of all rules, latched ones included: what a relay or a lamp shows.
    pub fn level(&self) -> Level {
        let levels = self.watches.iter().map(|watch| watch.status().shown);
        levels.max().unwrap_or(Level::Normal)
    }

    /// Some rule has had no evidence for [`Config::blind_windows`] while the machine ran: silence says nothing now.
    pub fn is_blind(&self) -> bool {
        self.watches.iter().any(|watch| watch.status().blind)
    }

    /// The machine runs, as far as the gate tells; always without a gate.
    pub fn is_running(&self) -> bool {
        self.gate.as_ref().is_none_or(GateWatch::is_running)
    }

    /// The rules and how each stands, in their order.
    pub fn statuses(&self) -> impl Iterator<Item = (&Rule, Status)> {
        self.watches
            .iter()
            .map(|watch| (watch.rule(), watch.status()))
    }
}
