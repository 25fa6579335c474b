//! One rule and how it stands.

use super::baseline::{Baseline, Learner};
use super::limit::LimitWatch;
use super::{Happening, Reading, Rule};
use crate::report::Report;

/// How bad it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nothing to do.
    #[default]
    Normal,
    /// Somebody should look.
    Warning,
    /// The machine should stop.
    Trip,
}

impl Level {
    /// The level's word in JSON and in logs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Warning => "warning",
            Self::Trip => "trip",
        }
    }
}

/// How a rule stands after its last window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// What the last windows say.
    pub active: Level,
    /// The same, or what is latched: what a lamp shows.
    pub shown: Level,
    /// Somebody has acknowledged what is shown.
    pub acknowledged: bool,
    /// No window has told anything for too long.
    pub blind: bool,
    /// What the last window told.
    pub reading: Reading,
    /// Where the warning is now, in the quantity's unit; `None` without one, or while its baseline is learned.
    pub warning_at: Option<f32>,
    /// Where the trip is now, in the same way.
    pub trip_at: Option<f32>,
    /// Windows still to be learned from; 0 where nothing is to be learned.
    pub learning: u16,
    /// What was learned, to be kept over a restart.
    pub baseline: Option<Baseline>,
}

/// A rule's state.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    rule: Rule,
    warning: Option<LimitWatch>,
    trip: Option<LimitWatch>,
    learner: Learner,
    shown: Level,
    acknowledged: bool,
    unknown: u16,
    blind: bool,
    reading: Reading,
}

impl Watch {
    pub(super) fn new(rule: Rule, learn_windows: u16) -> Self {
        Self {
            warning: rule.warning.map(LimitWatch::new),
            trip: rule.trip.map(LimitWatch::new),
            rule,
            learner: Learner::new(learn_windows),
            shown: Level::Normal,
            acknowledged: false,
            unknown: 0,
            blind: false,
            reading: Reading::Unknown,
        }
    }

    pub(super) fn rule(&self) -> &Rule {
        &self.rule
    }

    /// Takes a window and tells what has changed: at most three things.
    pub(super) fn window(
        &mut self,
        report: &Report,
        blind_windows: u16,
        mut tell: impl FnMut(Happening),
    ) {
        self.reading = self.rule.quantity.of(report);
        let learned = self.learn();
        if let Some(Baseline { centre, spread }) = learned {
            tell(Happening::Learned { centre, spread });
        }
        let told = self.judge() || self.learner_takes();
        self.unknown = if told {
            0
        } else {
            self.unknown.saturating_add(1)
        };
        let blind = blind_windows > 0 && self.unknown >= blind_windows;
        if blind != self.blind {
            self.blind = blind;
            tell(if blind {
                Happening::Blind
            } else {
                Happening::Sighted
            });
        }
        self.show(tell);
    }

    /// The machine has stopped: what is not latched clears.
    pub(super) fn rest(&mut self, tell: impl FnMut(Happening)) {
        for limit in [&mut self.warning, &mut self.trip].into_iter().flatten() {
            limit.clear();
        }
        (self.unknown, self.blind, self.reading) = (0, false, Reading::Unknown);
        self.show(tell);
    }

    pub(super) fn acknowledge(&mut self, mut tell: impl FnMut(Happening)) {
        if self.shown == Level::Normal || self.acknowledged {
            return;
        }
        self.acknowledged = true;
        tell(Happening::Acknowledged);
        self.show(tell);
    }

    pub(super) fn set_baseline(&mut self, baseline: Option<Baseline>) {
        self.learner.set(baseline);
        for limit in [&mut self.warning, &mut self.trip].into_iter().flatten() {
            if limit.is_learned() {
                limit.clear();
            }
        }
    }

    pub(super) fn status(&self) -> Status {
        let baseline = self.learner.learned();
        let at = |limit: &Option<LimitWatch>| {
            Some(limit.as_ref()?.at(baseline, self.rule.hysteresis)?.0)
        };
        Status {
            active: self.active(),
            shown: self.shown,
            acknowledged: self.acknowledged,
            blind: self.blind,
            reading: self.reading,
            warning_at: at(&self.warning),
            trip_at: at(&self.trip),
            learning: if self.learns() {
                self.learner.missing()
            } else {
                0
            },
            baseline,
        }
    }

    fn learns(&self) -> bool {
        let limits = [&self.warning, &self.trip];
        limits.into_iter().flatten().any(LimitWatch::is_learned)
    }

    /// The last window is one to learn from. Of what is within the noise, that counts which it is at most.
    fn learner_takes(&self) -> bool {
        let exact = matches!(self.reading, Reading::Value(_) | Reading::AtMost(_));
        exact && self.learns() && self.learner.missing() > 0
    }

    fn learn(&mut self) -> Option<Baseline> {
        // Windows in which a fixed limit is passed are not usual.
        if !self.learner_takes() || self.active() != Level::Normal {
            return None;
        }
        self.learner.take(self.reading.number()?)
    }

    /// Whether the window was evidence for any of the limits.
    fn judge(&mut self) -> bool {
        let (baseline, rule) = (self.learner.learned(), &self.rule);
        let mut told = false;
        for limit in [&mut self.warning, &mut self.trip].into_iter().flatten() {
            if let Some(at) = limit.at(baseline, rule.hysteresis) {
                told |= limit.window(self.reading, at, rule.delay);
            }
        }
        told
    }

    fn active(&self) -> Level {
        let passed = |limit: &Option<LimitWatch>| limit.as_ref().is_some_and(LimitWatch::is_passed);
        if passed(&self.trip) {
            Level::Trip
        } else if passed(&self.warning) {
            Level::Warning
        } else {
            Level::Normal
        }
    }

    /// Follows the active level as far as the latch lets it.
    fn show(&mut self, mut tell: impl FnMut(Happening)) {
        let (from, active) = (self.shown, self.active());
        let held = self.rule.latch && !self.acknowledged;
        let to = if held { active.max(from) } else { active };
        if to == from {
            return;
        }
        if to > from || to == Level::Normal {
            // A worse alarm is one that nobody has seen.
            self.acknowledged = false;
        }
        self.shown = to;
        tell(Happening::Level {
            from,
            to,
            value: self.reading.number(),
        });
    }
}
