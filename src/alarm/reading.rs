//! What one window says about one quantity.

use crate::report::{Figure, Report, Warning, Warnings};

/// What a window tells about a quantity, in the quantity's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// It is this much.
    Value(f32),
    /// It is within the noise, and no more than this.
    AtMost(f32),
    /// It is this much or more: part of the motion was lost on the way.
    AtLeast(f32),
    /// The window tells nothing.
    Unknown,
}

/// Windows with one of these tell nothing about the machine.
const SPOILT: Warnings = Warnings::from_bits(
    Warnings::of(Warning::ShortWindow).bits()
        | Warnings::of(Warning::Occluded).bits()
        | Warnings::of(Warning::Relearned).bits()
        | Warnings::of(Warning::LittleTexture).bits()
        | Warnings::of(Warning::BadLight).bits()
        | Warnings::of(Warning::CameraMoves).bits()
        | Warnings::of(Warning::TimingContradiction).bits(),
);

/// Windows with one of these may have lost a part of the motion.
const LESSENED: Warnings = Warnings::from_bits(
    Warnings::of(Warning::Compressed).bits() | Warnings::of(Warning::CoarseTimes).bits(),
);

impl Reading {
    /// A figure's reading.
    pub(super) fn of_figure(figure: Figure) -> Self {
        match figure.is_limit() {
            true => Self::AtMost(figure.at_most),
            false => Self::Value(figure.value),
        }
    }

    /// The same, so many times as large.
    pub(super) fn scaled(self, by: f32) -> Self {
        match self {
            Self::Value(v) => Self::Value(v * by),
            Self::AtMost(v) => Self::AtMost(v * by),
            Self::AtLeast(v) => Self::AtLeast(v * by),
            Self::Unknown => Self::Unknown,
        }
    }

    /// What is left of it in the light of the report's warnings. No number that is not finite, or less than 0, comes out.
    pub(super) fn vetted(self, report: &Report) -> Self {
        let any = |of: Warnings| report.warnings.bits() & of.bits() != 0;
        if any(SPOILT) {
            return Self::Unknown;
        }
        let sane = |v: f32| v.is_finite() && v >= 0.0;
        match self {
            Self::Value(v) if sane(v) && any(LESSENED) => Self::AtLeast(v),
            Self::AtMost(_) if any(LESSENED) => Self::Unknown,
            Self::Value(v) | Self::AtMost(v) | Self::AtLeast(v) if sane(v) => self,
            _ => Self::Unknown,
        }
    }

    /// The number in it; `None` where it is unknown.
    pub fn number(self) -> Option<f32> {
        match self {
            Self::Value(v) | Self::AtMost(v) | Self::AtLeast(v) => Some(v),
            Self::Unknown => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spoilt_window_tells_nothing_and_a_lessened_one_only_the_least() {
        let with = |warning| Report {
            warnings: Warnings::of(warning),
            ..Report::EMPTY
        };
        let value = Reading::Value(3.0);
        assert_eq!(value.vetted(&Report::EMPTY), value);
        assert_eq!(value.vetted(&with(Warning::LostFrames)), value);
        assert_eq!(value.vetted(&with(Warning::Occluded)), Reading::Unknown);
        assert_eq!(
            value.vetted(&with(Warning::Compressed)),
            Reading::AtLeast(3.0)
        );
        let limit = Reading::AtMost(3.0);
        assert_eq!(limit.vetted(&with(Warning::Compressed)), Reading::Unknown);
        for wild in [f32::NAN, f32::INFINITY, -1.0] {
            for reading in [
                Reading::Value(wild),
                Reading::AtMost(wild),
                Reading::AtLeast(wild),
            ] {
                assert_eq!(reading.vetted(&Report::EMPTY), Reading::Unknown);
            }
        }
    }
}
