//! Holding registers: the settings.

use crate::link::settings::{Region, Settings};
use crate::wire::Format;

use crate::wire::modbus::half;

/// How many there are.
pub(crate) const HOLDING_LEN: u16 = 20;

/// Address of the register that takes commands: 1 saves the settings, 2 goes back to the defaults.
/// It reads as 0.
pub(crate) const COMMAND_AT: u16 = 7;

/// Address of the lock, two registers: a number written there locks the settings, or unlocks them
/// where it locked them. It reads as 1 where they are locked, else as 0.
pub(crate) const LOCK_AT: u16 = 30;

/// All holding registers at once: changed here, and only then made settings again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Image([u16; HOLDING_LEN as usize]);

impl Image {
    pub(super) fn of(settings: &Settings) -> Self {
        let mut image = Self([0; HOLDING_LEN as usize]);
        let optional = |value: Option<f32>| value.unwrap_or(0.0);
        for (at, value) in [
            (0, settings.window_s),
            (2, settings.hop_s),
            (8, settings.false_alarm),
            (10, optional(settings.um_per_px)),
            (12, optional(settings.min_hz)),
            (14, optional(settings.max_hz)),
        ] {
            image.put(at, half(value.to_bits(), 0));
            image.put(at + 1, half(value.to_bits(), 1));
        }
        image.put(4, u16::from(settings.max_peaks));
        image.put(5, settings.wire.register());
        image.put(6, u16::from(settings.unit));
        if let Some(roi) = settings.roi {
            for (at, value) in (16..).zip([roi.x, roi.y, roi.width, roi.height]) {
                image.put(at, value);
            }
        }
        image
    }

    /// The settings, unchecked; `None` where a register holds no value of its setting at all.
    pub(super) fn settings(&self) -> Option<Settings> {
        let real = |at: u16| {
            Some(f32::from_bits(
                (u32::from(self.register(at)?) << 16) | u32::from(self.register(at + 1)?),
            ))
        };
        // 0 stands for none, in either sign.
        let optional = |at: u16| real(at).map(|value| (value != 0.0).then_some(value));
        let roi = Region {
            x: self.register(16)?,
            y: self.register(17)?,
            width: self.register(18)?,
            height: self.register(19)?,
        };
        let whole = roi.width == 0 && roi.height == 0 && roi.x == 0 && roi.y == 0;
        Some(Settings {
            window_s: real(0)?,
            hop_s: real(2)?,
            max_peaks: u8::try_from(self.register(4)?).ok()?,
            wire: Format::of_register(self.register(5)?)?,
            unit: u8::try_from(self.register(6)?).ok()?,
            false_alarm: real(8)?,
            um_per_px: optional(10)?,
            min_hz: optional(12)?,
            max_hz: optional(14)?,
            roi: (!whole).then_some(roi),
            lock: None,
        })
    }

    /// The register at an address, or `None` where there is none.
    pub(super) fn register(&self, at: u16) -> Option<u16> {
        self.0.get(usize::from(at)).copied()
    }

    /// Changes one; does nothing where there is none.
    pub(super) fn put(&mut self, at: u16, value: u16) {
        if let Some(register) = self.0.get_mut(usize::from(at)) {
            *register = value;
        }
    }
}

/// Whether the register is half of a 32-bit value, and which half.
fn half_of_pair(at: u16) -> Option<u16> {
    matches!(at, 0..4 | 8..16 ).then_some(at & 1)
}

/// Whether a write from `at` on cuts a 32-bit value in two.
pub(super) fn cuts_a_value(at: u16, count: u16) -> bool {
    let last = at.saturating_add(count).saturating_sub(1);
    half_of_pair(at) == Some(1) || half_of_pair(last) == Some(0)
}
