//! What the reader of a report should know about its window, as a set.

use serde::{Deserialize, Serialize};

/// Something the reader should know about a window. The value is the warning's bit in [`Warnings`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Warning {
    /// A vibration near a multiple of the frame rate could hide, and the report's figures depend on it.
    HiddenNearFrameRate = 0,
    /// Frames were lost.
    LostFrames = 1,
    /// The window is shorter than asked for.
    ShortWindow = 2,
    /// Rows were rejected: something passed before the part.
    Occluded = 3,
    /// The scene changed and the reference was learned again.
    Relearned = 4,
    /// Less than half of the rows have texture to measure.
    LittleTexture = 5,
    /// There were more tones than the report holds.
    MoreTones = 6,
    /// The picture is too dark or saturated in most rows.
    BadLight = 7,
    /// The first report since the watchdog reset the board.
    WatchdogReset = 8,
    /// The first report since the board's firmware failed and reset it.
    PanicReset = 9,
    /// The first report since the board was told to start again.
    CommandReset = 10,
    /// Groups of rows lacked rows that they have as a rule, and were rejected.
    ThinGroups = 11,
    /// Samples were dropped: they came late, or the computing side was busy.
    DroppedSamples = 12,
    /// A window before this one was complete but never computed.
    DroppedWindows = 13,
    /// The camera itself moves.
    CameraMoves = 14,
    /// The motion contradicts the product of frame rate and line time.
    TimingContradiction = 15,
    /// The pictures were compressed: amplitudes are lower bounds.
    Compressed = 16,
    /// Frames came more than once.
    RepeatedFrames = 17,
    /// The exposure is unknown: amplitudes are as filmed.
    ExposureUnknown = 18,
    /// The times of the frames are coarser than the frequencies' standard deviations.
    CoarseTimes = 19,
}

impl Warning {
    /// Every warning, in the order of the bits.
    pub const ALL: [Self; 20] = [
        Self::HiddenNearFrameRate,
        Self::LostFrames,
        Self::ShortWindow,
        Self::Occluded,
        Self::Relearned,
        Self::LittleTexture,
        Self::MoreTones,
        Self::BadLight,
        Self::WatchdogReset,
        Self::PanicReset,
        Self::CommandReset,
        Self::ThinGroups,
        Self::DroppedSamples,
        Self::DroppedWindows,
        Self::CameraMoves,
        Self::TimingContradiction,
        Self::Compressed,
        Self::RepeatedFrames,
        Self::ExposureUnknown,
        Self::CoarseTimes,
    ];

    /// The warning's word in JSON and in logs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::HiddenNearFrameRate => "hidden_near_frame_rate",
            Self::LostFrames => "lost_frames",
            Self::ShortWindow => "short_window",
            Self::Occluded => "occluded",
            Self::Relearned => "relearned",
            Self::LittleTexture => "little_texture",
            Self::MoreTones => "more_tones",
            Self::BadLight => "bad_light",
            Self::WatchdogReset => "watchdog_reset",
            Self::PanicReset => "panic_reset",
            Self::CommandReset => "command_reset",
            Self::ThinGroups => "thin_groups",
            Self::DroppedSamples => "dropped_samples",
            Self::DroppedWindows => "dropped_windows",
            Self::CameraMoves => "camera_moves",
            Self::TimingContradiction => "timing_contradiction",
            Self::Compressed => "compressed",
            Self::RepeatedFrames => "repeated_frames",
            Self::ExposureUnknown => "exposure_unknown",
            Self::CoarseTimes => "coarse_times",
        }
    }

    const fn bit(self) -> u32 {
        1 << self as u8
    }
}

/// A set of [`Warning`]s.
///
/// ```
/// use rowtone::report::{Warning, Warnings};
/// let mut warnings = Warnings::NONE;
/// warnings.insert(Warning::LostFrames);
/// warnings.insert_if(true, Warning::Occluded);
/// assert!(warnings.contains(Warning::Occluded) && !warnings.contains(Warning::Relearned));
/// assert!(warnings.names().eq(["lost_frames", "occluded"]));
/// ```
///
/// As a field of a serialised report it is the set's lower 16 bits: wires of version 1 have no more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "u16", from = "u16")]
pub struct Warnings(u32);

impl Warnings {
    /// The empty set.
    pub const NONE: Self = Self(0);

    /// The set of one warning.
    pub const fn of(warning: Warning) -> Self {
        Self(warning.bit())
    }

    /// The set without those of another.
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// The set with these bits, those without a meaning too (a newer sender may know more).
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The set as bits: 1 << n is the warning whose value is n.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The first sixteen bits: all that wires of version 1 carry.
    pub(crate) const fn lower_bits(self) -> u16 {
        self.0 as u16
    }

    /// Adds a warning.
    pub const fn insert(&mut self, warning: Warning) {
        self.0 |= warning.bit();
    }

    /// Adds a warning where its condition is met.
    pub const fn insert_if(&mut self, met: bool, warning: Warning) {
        if met {
            self.insert(warning);
        }
    }

    /// Takes a warning out.
    pub const fn remove(&mut self, warning: Warning) {
        self.0 &= !warning.bit();
    }

    /// The warnings of both sets.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether a warning is in the set.
    pub const fn contains(self, warning: Warning) -> bool {
        self.0 & warning.bit() != 0
    }

    /// Whether there is nothing to warn of.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The warnings in the set, in the order of the bits.
    pub fn iter(self) -> impl Iterator<Item = Warning> {
        let all = Warning::ALL.into_iter();
        all.filter(move |&warning| self.contains(warning))
    }

    /// The words of the warnings in the set, in the order of the bits.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        self.iter().map(Warning::name)
    }
}

impl From<Warnings> for u16 {
    fn from(warnings: Warnings) -> Self {
        warnings.lower_bits()
    }
}

impl From<u16> for Warnings {
    fn from(bits: u16) -> Self {
        Self(bits.into())
    }
}

impl FromIterator<Warning> for Warnings {
    fn from_iter<I: IntoIterator<Item = Warning>>(warnings: I) -> Self {
        let mut set = Self::NONE;
        warnings.into_iter().for_each(|warning| set.insert(warning));
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_warning_has_its_own_bit_and_name() {
        for (n, &warning) in Warning::ALL.iter().enumerate() {
            assert_eq!(warning as usize, n);
            let set = Warnings::of(warning);
            assert_eq!(set.bits(), 1 << n);
            assert!(set.iter().eq([warning]), "{warning:?}");
            let same_name = |other: &&Warning| other.name() == warning.name();
            assert_eq!(Warning::ALL.iter().filter(same_name).count(), 1);
        }
    }

    #[test]
    fn a_set_holds_what_was_put_in() {
        let mut set: Warnings = [Warning::CoarseTimes, Warning::LostFrames]
            .into_iter()
            .collect();
        assert!(set.names().eq(["lost_frames", "coarse_times"]));
        assert_eq!(set.lower_bits(), 2);
        set.remove(Warning::LostFrames);
        assert_eq!(set, Warnings::of(Warning::CoarseTimes));
        set.insert_if(false, Warning::LostFrames);
        assert!(!set.contains(Warning::LostFrames) && !set.is_empty());
        assert_eq!(Warnings::from_bits(set.bits()), set);
        assert!(set.union(set) == set && Warnings::NONE.is_empty());
    }
}
