//! Rules as plain data, and what is wrong with those that cannot be.

use core::fmt;

use heapless::{String, Vec};

use super::baseline::LEARN_WINDOWS;
use super::quantity::{Band, Part, Quantity};

/// Most rules of one machine.
pub const MAX_RULES: usize = 8;
/// Longest name of a rule, bytes.
pub const MAX_NAME: usize = 24;
/// Most windows that a limit can wait for.
pub const MAX_DELAY: u8 = 16;

/// Where a level begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// At this value, in the quantity's unit.
    Fixed(f32),
    /// So far above what is usual: the larger of `share` of the baseline and `spreads` of its spreads.
    Learned {
        /// Share of the baseline, 0.02 or greater: 0.12 is 12 % above it.
        share: f32,
        /// So many spreads (standard deviations from window to window), 2 or greater.
        spreads: f32,
    },
}

impl Limit {
    /// A warning: 12 % above what is usual, or three spreads. With the usual delay ten days of a steady machine
    /// pass it by chance in no window, and a step of 25 % is found where windows scatter by 5 % or less (`rowtone sweep alarms`).
    pub const LEARNED_WARNING: Self = Self::Learned {
        share: 0.12,
        spreads: 3.0,
    };
}

/// What is watched, and from where on it is too much.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// What people call it: printable ASCII without `"`, `,`, `$` and `*`, unique among the rules.
    pub name: String<MAX_NAME>,
    /// What is watched.
    pub quantity: Quantity,
    /// From here on it is a warning.
    pub warning: Option<Limit>,
    /// From here on it is a trip.
    pub trip: Option<Limit>,
    /// A level is raised once so many of the last `2·delay − 1` windows that told something are above its limit, and
    /// cleared in the same way: 1 to [`MAX_DELAY`]. It is the median of these windows that decides.
    pub delay: u8,
    /// A level clears this share of the limit below it, of the distance to the baseline where it is learned: 0 to 0.9.
    pub hysteresis: f32,
    /// A level stays until it is acknowledged, though its cause be gone.
    pub latch: bool,
}

impl Rule {
    /// The velocity over 10–1000 Hz in mm/s RMS, without limits: what most rules begin with. A name that is too long is
    /// cut.
    pub fn velocity(name: &str) -> Self {
        Self {
            name: name.chars().take(MAX_NAME).filter(char::is_ascii).collect(),
            quantity: Quantity {
                part: Part::Band(Band::Velocity),
                scaled: true,
            },
            warning: None,
            trip: None,
            delay: 5,
            hysteresis: 0.1,
            latch: false,
        }
    }

    /// Whether it can be used.
    ///
    /// # Errors
    /// [`RuleError`], what is wrong with it first.
    pub fn check(&self) -> Result<(), RuleError> {
        let name = self.name.as_str();
        let printable = |c: char| c.is_ascii_graphic() || c == ' ';
        let reserved = |c: char| ['"', ',', '$', '*'].contains(&c);
        if name.is_empty() || !name.chars().all(|c| printable(c) && !reserved(c)) {
            return Err(RuleError::Name);
        }
        let quantity = self.quantity.part.is_possible();
        (1..=MAX_DELAY)
            .contains(&self.delay)
            .or_else_err(RuleError::Delay)?;
        (0.0..=0.9)
            .contains(&self.hysteresis)
            .or_else_err(RuleError::Hysteresis)?;
        quantity.or_else_err(RuleError::Frequency)?;
        let limits = [self.warning, self.trip];
        if limits == [None; 2] {
            return Err(RuleError::NoLimit);
        }
        for limit in limits.into_iter().flatten() {
            limit.is_possible().or_else_err(RuleError::Limit)?;
        }
        match limits {
            [Some(Limit::Fixed(warning)), Some(Limit::Fixed(trip))] if warning >= trip => {
                Err(RuleError::Order)
            }
            [
                Some(Limit::Learned { share, spreads }),
                Some(Limit::Learned {
                    share: far,
                    spreads: many,
                }),
            ] if share > far || spreads > many => Err(RuleError::Order),
            _ => Ok(()),
        }
    }
}

/// Turns a condition into a result.
trait OrElseErr {
    fn or_else_err(self, error: RuleError) -> Result<(), RuleError>;
}

impl OrElseErr for bool {
    fn or_else_err(self, error: RuleError) -> Result<(), RuleError> {
        if self { Ok(()) } else { Err(error) }
    }
}

impl Limit {
    fn is_possible(self) -> bool {
        match self {
            Self::Fixed(value) => value.is_finite() && value > 0.0,
            Self::Learned { share, spreads } => {
                (0.02..=100.0).contains(&share) && (2.0..=100.0).contains(&spreads)
            }
        }
    }
}

impl Part {
    fn is_possible(self) -> bool {
        match self {
            Self::Band(_) => true,
            Self::Tone { from_hz, to_hz, .. } => {
                from_hz >= 0.0 && from_hz < to_hz && to_hz.is_finite()
            }
            Self::Order { order, .. } => order > 0,
        }
    }
}

/// How the machine's running is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// Runs where this …
    pub quantity: Quantity,
    /// … is so much or more, in its unit; it has stopped where it is less than 0.8 of it.
    pub above: f32,
    /// So many windows after the start are not judged: the run-up passes through resonances.
    pub settle_windows: u16,
}

/// All rules of a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// The rules.
    pub rules: Vec<Rule, MAX_RULES>,
    /// Judge only while the machine runs; `None`: always.
    pub running: Option<Gate>,
    /// Windows from which a baseline is learned: 20 to [`LEARN_WINDOWS`].
    pub learn_windows: u16,
    /// A rule is blind after so many windows, one after the other, that told nothing; 0: never.
    pub blind_windows: u16,
}

impl Default for Config {
    /// No rules; a baseline of 300 windows; blind after 60.
    fn default() -> Self {
        Self {
            rules: Vec::new(),
            running: None,
            learn_windows: LEARN_WINDOWS as u16,
            blind_windows: 60,
        }
    }
}

impl Config {
    /// Whether it can be used.
    ///
    /// # Errors
    /// [`RuleError`], what is wrong with it first.
    pub fn check(&self) -> Result<(), RuleError> {
        (20..=LEARN_WINDOWS)
            .contains(&self.learn_windows.into())
            .or_else_err(RuleError::LearnWindows)?;
        if let Some(gate) = &self.running {
            let possible =
                gate.quantity.part.is_possible() && Limit::Fixed(gate.above).is_possible();
            possible.or_else_err(RuleError::Gate)?;
        }
        for (n, rule) in self.rules.iter().enumerate() {
            rule.check()?;
            let twice = self
                .rules
                .iter()
                .take(n)
                .any(|other| other.name == rule.name);
            (!twice).or_else_err(RuleError::Name)?;
        }
        Ok(())
    }
}

/// Why rules cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RuleError {
    /// A name that is empty, there twice, or not printable ASCII without `"`, `,`, `$` and `*`.
    Name,
    /// A rule without a limit.
    NoLimit,
    /// A limit that is not greater than 0, or a learned one within 2 % or two spreads.
    Limit,
    /// The warning is not below the trip.
    Order,
    /// A delay other than 1 to 16 windows.
    Delay,
    /// A hysteresis other than 0 to 0.9.
    Hysteresis,
    /// A range of frequencies that is none, or an order 0.
    Frequency,
    /// A gate of which the same is true.
    Gate,
    /// Other than 20 to 300 windows to learn from.
    LearnWindows,
}

impl fmt::Display for RuleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Name => "each name must be another, of printable ASCII without \" , $ and *",
            Self::NoLimit => "it has neither a warning nor a trip",
            Self::Limit => {
                "a limit must be greater than 0, a learned one 0.02 and 2 spreads or more"
            }
            Self::Order => "the warning must be below the trip",
            Self::Delay => "delay must be 1 to 16 windows",
            Self::Hysteresis => "hysteresis must be 0 to 0.9",
            Self::Frequency => "its frequencies must rise from 0, its order be 1 or more",
            Self::Gate => "what tells that the machine runs has no possible quantity or limit",
            Self::LearnWindows => "learn_windows must be 20 to 300",
        })
    }
}

impl core::error::Error for RuleError {}
