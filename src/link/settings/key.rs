//! One setting as text: its name and its value.

use core::fmt;

use super::real;
use super::{Region, Settings};
use crate::wire::Format;

/// Name of a setting; the same names as the options of the command `rowtone`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// [`Settings::window_s`]
    Window,
    /// [`Settings::hop_s`]
    Hop,
    /// [`Settings::max_peaks`]
    MaxPeaks,
    /// [`Settings::false_alarm`]
    FalseAlarm,
    /// [`Settings::um_per_px`]
    UmPerPx,
    /// [`Settings::roi`]
    Roi,
    /// [`Settings::min_hz`]
    MinHz,
    /// [`Settings::max_hz`]
    MaxHz,
    /// [`Settings::wire`]
    Wire,
    /// [`Settings::unit`]
    Unit,
}

/// A value that the setting cannot read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ValueError(pub Key);

impl fmt::Display for ValueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Key::Window | Key::Hop => "a number of seconds",
            Key::MaxPeaks => "a whole number",
            Key::FalseAlarm => "a chance, like 0.001",
            Key::UmPerPx => "a number of micrometres, or none",
            Key::Roi => "x,y,width,height in px, or none",
            Key::MinHz | Key::MaxHz => "a number of Hz, or none",
            Key::Wire => "text, binary or modbus",
            Key::Unit => "a whole number from 1 to 247",
        })
    }
}

impl core::error::Error for ValueError {}

impl Key {
    /// Every setting.
    pub const ALL: [Self; 10] = [
        Self::Window,
        Self::Hop,
        Self::MaxPeaks,
        Self::FalseAlarm,
        Self::UmPerPx,
        Self::Roi,
        Self::MinHz,
        Self::MaxHz,
        Self::Wire,
        Self::Unit,
    ];

    /// As it is written in a command.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Window => "window",
            Self::Hop => "hop",
            Self::MaxPeaks => "max-peaks",
            Self::FalseAlarm => "false-alarm",
            Self::UmPerPx => "um-per-px",
            Self::Roi => "roi",
            Self::MinHz => "min-hz",
            Self::MaxHz => "max-hz",
            Self::Wire => "wire",
            Self::Unit => "unit",
        }
    }

    /// The setting of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|key| key.name() == name)
    }

    /// Reads `text` and puts it into `settings`, unchecked: [`Settings::check`] follows once all
    /// changes are made.
    ///
    /// # Errors
    /// The text is not a value of this setting; `settings` is as before.
    pub fn set(self, settings: &mut Settings, text: &str) -> Result<(), ValueError> {
        let wrong = ValueError(self);
        let number = |text: &str| real::parse(text).ok_or(wrong);
        let byte = |text: &str| {
            let whole = real::whole(text).and_then(|n| u8::try_from(n).ok());
            whole.ok_or(wrong)
        };
        let optional = |text: &str| match text {
            "none" => Ok(None),
            text => number(text).map(Some),
        };
        match self {
            Self::Window => settings.window_s = number(text)?,
            Self::Hop => settings.hop_s = number(text)?,
            Self::MaxPeaks => settings.max_peaks = byte(text)?,
            Self::FalseAlarm => settings.false_alarm = number(text)?,
            Self::UmPerPx => settings.um_per_px = optional(text)?,
            Self::Roi => {
                settings.roi = match text {
                    "none" => None,
                    text => Some(parse_region(text).ok_or(wrong)?),
                }
            }
            Self::MinHz => settings.min_hz = optional(text)?,
            Self::MaxHz => settings.max_hz = optional(text)?,
            Self::Wire => {
                settings.wire = Format::named(text).ok_or(wrong)?;
            }
            Self::Unit => settings.unit = byte(text)?,
        }
        Ok(())
    }

    /// Writes `name=value`, the value as [`Key::set`] reads it.
    ///
    /// # Errors
    /// Only where `out` refuses.
    pub fn write(self, settings: &Settings, out: &mut impl fmt::Write) -> fmt::Result {
        write!(out, "{}=", self.name())?;
        let optional = |out: &mut dyn fmt::Write, value: Option<f32>| match value {
            Some(value) => write!(out, "{value}"),
            None => out.write_str("none"),
        };
        match self {
            Self::Window => write!(out, "{}", settings.window_s),
            Self::Hop => write!(out, "{}", settings.hop_s),
            Self::MaxPeaks => write!(out, "{}", settings.max_peaks),
            Self::FalseAlarm => write!(out, "{}", settings.false_alarm),
            Self::UmPerPx => optional(out, settings.um_per_px),
            Self::Roi => match settings.roi {
                Some(r) => write!(out, "{},{},{},{}", r.x, r.y, r.width, r.height),
                None => out.write_str("none"),
            },
            Self::MinHz => optional(out, settings.min_hz),
            Self::MaxHz => optional(out, settings.max_hz),
            Self::Wire => out.write_str(settings.wire.name()),
            Self::Unit => write!(out, "{}", settings.unit),
        }
    }
}

fn parse_region(text: &str) -> Option<Region> {
    let mut parts = text.split(',');
    let mut next = || u16::try_from(real::whole(parts.next()?)?).ok();
    let region = Region {
        x: next()?,
        y: next()?,
        width: next()?,
        height: next()?,
    };
    parts.next().is_none().then_some(region)
}
