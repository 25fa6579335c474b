//! Which figure of a report a rule watches.

use core::f32::consts::{FRAC_1_SQRT_2, TAU};

use super::Reading;
use crate::math::sqrtf;
use crate::report::{Peak, Report, Warning};

/// A figure of a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Which one.
    pub part: Part,
    /// In the machine's units (µm, mm/s, m/s²), which a report without a scale does not have; else in the picture's (px,
    /// px/s, px/s²).
    pub scaled: bool,
}

/// What of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// All motion, both axes as a vector.
    Band(Band),
    /// The largest tone in a range of frequencies: near one frequency, or in a band.
    Tone {
        /// Where the range begins, Hz.
        from_hz: f32,
        /// Where it ends, Hz.
        to_hz: f32,
        /// What of the tone.
        measure: ToneMeasure,
    },
    /// A harmonic of the running speed that the report tells.
    Order {
        /// Which one, from 1.
        order: u8,
        /// What of the tone.
        measure: ToneMeasure,
    },
}

/// A broad-band measure ([`crate::report::Measures`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Band {
    /// Velocity from 10 Hz on, mm/s or px/s RMS.
    Velocity,
    /// Velocity from 2 Hz on, mm/s or px/s RMS.
    VelocityFrom2Hz,
    /// Displacement, µm or px RMS.
    Displacement,
    /// Displacement peak to peak, µm or px.
    PeakToPeak,
    /// Acceleration, m/s² or px/s² RMS.
    Acceleration,
    /// Crest factor of the displacement, without a unit.
    CrestFactor,
}

/// A measure of a tone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToneMeasure {
    /// Displacement, µm or px zero to peak.
    Amplitude,
    /// Velocity, mm/s or px/s RMS.
    Velocity,
}

/// An amplitude of so many standard deviations is found for sure: what is not found is less.
const FOUND_SDS: f32 = 6.0;

impl Quantity {
    /// What this report tells about it.
    pub fn of(&self, report: &Report) -> Reading {
        let in_px = match self.part {
            Part::Band(band) => return self.band(band, report).vetted(report),
            Part::Tone {
                from_hz,
                to_hz,
                measure,
            } => tone(report, from_hz, to_hz, measure),
            Part::Order { order, measure } => self::order(report, order, measure),
        };
        let unit = match self.measure() {
            Some(ToneMeasure::Velocity) => 1e-3,
            _ => 1.0,
        };
        self.in_unit(in_px, report, unit).vetted(report)
    }

    fn measure(&self) -> Option<ToneMeasure> {
        match self.part {
            Part::Band(_) => None,
            Part::Tone { measure, .. } | Part::Order { measure, .. } => Some(measure),
        }
    }

    /// The unit's name, as reports have it; empty where there is none.
    pub fn unit(&self) -> &'static str {
        let (scaled, plain) = match self.part {
            Part::Band(Band::CrestFactor) => ("", ""),
            Part::Band(Band::Acceleration) => ("m/s2", "px/s2"),
            Part::Band(Band::Velocity | Band::VelocityFrom2Hz) => ("mm/s", "px/s"),
            Part::Band(Band::Displacement | Band::PeakToPeak) => ("um", "px"),
            Part::Tone { measure, .. } | Part::Order { measure, .. } => match measure {
                ToneMeasure::Amplitude => ("um", "px"),
                ToneMeasure::Velocity => ("mm/s", "px/s"),
            },
        };
        if self.scaled { scaled } else { plain }
    }

    /// A reading in px (px/s, px/s²), in what was asked for; `per_um` is that unit of a µm (µm/s, µm/s²).
    fn in_unit(&self, px: Reading, report: &Report, per_um: f32) -> Reading {
        match (self.scaled, report.um_per_px) {
            (false, _) => px,
            (true, None) => Reading::Unknown,
            (true, Some(um_per_px)) => px.scaled(um_per_px * per_um),
        }
    }

    fn band(&self, band: Band, report: &Report) -> Reading {
        let Some(broad) = &report.broad_band else {
            // What a wire of version 1 carries.
            return match report.velocity_mm_s_rms {
                Some(mm_s) if self.scaled && band == Band::Velocity => Reading::Value(mm_s),
                _ => Reading::Unknown,
            };
        };
        let sum = &broad.sum;
        let (figure, per_um) = match band {
            Band::Velocity => (sum.velocity_px_s, 1e-3),
            Band::VelocityFrom2Hz => (sum.velocity_from_2_hz_px_s, 1e-3),
            Band::Displacement => (sum.displacement_px, 1.0),
            Band::PeakToPeak => (sum.peak_to_peak_px, 1.0),
            Band::Acceleration => (sum.acceleration_px_s2, 1e-6),
            Band::CrestFactor => {
                return sum
                    .crest_factor
                    .map_or(Reading::Unknown, Reading::of_figure);
            }
        };
        let reading = figure.map_or(Reading::Unknown, Reading::of_figure);
        self.in_unit(reading, report, per_um)
    }
}

/// The largest tone between two frequencies, in px.
fn tone(report: &Report, from_hz: f32, to_hz: f32, measure: ToneMeasure) -> Reading {
    let within = |peak: &&Peak| (from_hz..=to_hz).contains(&peak.hz);
    largest(report.peaks.iter().filter(within), measure)
        .unwrap_or_else(|| unseen(report, from_hz, to_hz, measure))
}

/// A harmonic of the running speed, in px. Where no running speed is known, neither are its orders.
fn order(report: &Report, order: u8, measure: ToneMeasure) -> Reading {
    let of_speed = |peak: &Peak| Some(peak.hz / f32::from(peak.harmonic?.max(1)));
    let Some(speed_hz) = report.peaks.iter().find_map(of_speed) else {
        return Reading::Unknown;
    };
    let is_it = |peak: &&Peak| peak.harmonic == Some(order);
    let hz = speed_hz * f32::from(order);
    largest(report.peaks.iter().filter(is_it), measure)
        .unwrap_or_else(|| unseen(report, hz, hz, measure))
}

/// The largest of these; unknown where one of them is ambiguous and larger than all that are sure.
fn largest<'a>(peaks: impl Iterator<Item = &'a Peak>, measure: ToneMeasure) -> Option<Reading> {
    let size = |peak: &Peak| of_tone(peak.amplitude_px, peak.hz, measure);
    let largest = peaks.max_by(|a, b| size(a).total_cmp(&size(b)))?;
    Some(match largest.ambiguous {
        true => Reading::Unknown,
        false => Reading::Value(size(largest)),
    })
}

fn of_tone(amplitude_px: f32, hz: f32, measure: ToneMeasure) -> f32 {
    match measure {
        ToneMeasure::Amplitude => amplitude_px,
        ToneMeasure::Velocity => TAU * hz * amplitude_px * FRAC_1_SQRT_2,
    }
}

/// What a tone that was not found is at most, px: what noise of this level hides. A tone's amplitude has the standard
/// deviation σ·√(2/N), or the density of the noise over the root of the window's length.
fn unseen(report: &Report, from_hz: f32, to_hz: f32, measure: ToneMeasure) -> Reading {
    let resolved_hz = 1.0 / report.window_s;
    let nearest = libm::roundf(0.5 * (from_hz + to_hz) / report.fps) * report.fps;
    let hides = nearest > 0.0 && (from_hz - resolved_hz..=to_hz + resolved_hz).contains(&nearest);
    if hides || report.warnings.contains(Warning::MoreTones) {
        return Reading::Unknown;
    }
    let white_px = report.noise_px * sqrtf(2.0 / report.lines as f32);
    let reaches = |to: f32| to >= from_hz;
    let floor = report
        .noise_floor
        .iter()
        .filter(|point| reaches(point.to_hz));
    let densest = floor.map(|point| point.px_per_sqrt_hz).fold(0.0, f32::max);
    let sd_px = white_px.max(densest * sqrtf(resolved_hz));
    Reading::AtMost(of_tone(FOUND_SDS * sd_px, to_hz, measure))
}
