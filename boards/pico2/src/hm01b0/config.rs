//! How the camera is to run, and what it cannot do.

use super::{MIN_FRAME_LENGTH, MIN_LINE_LENGTH};
use core::fmt;

/// How many data pins are wired.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bus {
    /// D0 only; eight pixel clocks a pixel, least significant bit first.
    Bits1,
    /// D0 to D3; two pixel clocks a pixel, lower half first.
    Bits4,
    /// D0 to D7; one pixel clock a pixel.
    Bits8,
}

impl Bus {
    /// Data pins, and bits a pixel clock.
    pub const fn bits(self) -> u8 {
        match self {
            Self::Bits1 => 1,
            Self::Bits4 => 4,
            Self::Bits8 => 8,
        }
    }

    /// Pixel clocks a pixel.
    pub const fn clocks_per_pixel(self) -> u32 {
        8 / self.bits() as u32
    }

    /// BIT_CONTROL: bit 6 four-bit mode, bit 5 serial mode, bits 4..0 as the datasheet asks.
    pub(super) const fn bit_control(self) -> u8 {
        match self {
            Self::Bits1 => 0x22,
            Self::Bits4 => 0x42,
            Self::Bits8 => 0x02,
        }
    }
}

/// Master clock over pixel clock (register 0x3060, bits 1..0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockDivider {
    /// Pixel clock = master clock.
    By1,
    /// Half of it.
    By2,
    /// A quarter.
    By4,
    /// An eighth.
    By8,
}

impl ClockDivider {
    /// The factor.
    pub const fn factor(self) -> u32 {
        match self {
            Self::By1 => 1,
            Self::By2 => 2,
            Self::By4 => 4,
            Self::By8 => 8,
        }
    }

    pub(super) const fn bits(self) -> u8 {
        match self {
            Self::By1 => 0b11,
            Self::By2 => 0b10,
            Self::By4 => 0b01,
            Self::By8 => 0b00,
        }
    }
}

/// How the camera is to run. Checked by [`Config::check`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// Data pins.
    pub bus: Bus,
    /// Master clock, Hz: the module's own oscillator, or what the board puts on MCLK.
    pub mclk_hz: u32,
    /// Master clock over pixel clock.
    pub divider: ClockDivider,
    /// Pixels from the start of one line to the next, at least [`MIN_LINE_LENGTH`].
    pub line_length_px: u16,
    /// Lines from the start of one frame to the next, at least [`MIN_FRAME_LENGTH`].
    pub frame_length_lines: u16,
    /// Exposure in lines, 2 to `frame_length_lines` − 2.
    pub exposure_lines: u16,
    /// Analog gain: 2 to this power, 0 to 3.
    pub analog_gain_log2: u8,
}

impl Config {
    /// 57 frames a second of 67.2 µs lines from a 25 MHz master clock, exposed for 0.5 ms, all data pins.
    pub const QVGA_8BIT: Self = Self {
        bus: Bus::Bits8,
        mclk_hz: 25_000_000,
        divider: ClockDivider::By4,
        line_length_px: 420,
        frame_length_lines: MIN_FRAME_LENGTH,
        exposure_lines: 8,
        analog_gain_log2: 0,
    };

    /// The same on four data pins: the pixel clock is twice as fast.
    pub const QVGA_4BIT: Self = Self {
        bus: Bus::Bits4,
        divider: ClockDivider::By2,
        ..Self::QVGA_8BIT
    };

    /// The modules with eight pins and an oscillator of 24 MHz: one data pin, 125 µs lines, 31 frames a second.
    pub const QVGA_1BIT: Self = Self {
        bus: Bus::Bits1,
        mclk_hz: 24_000_000,
        divider: ClockDivider::By1,
        line_length_px: MIN_LINE_LENGTH,
        exposure_lines: 4,
        ..Self::QVGA_8BIT
    };

    /// Time from one row to the next, ps, as the clocks should make it; what they do make is measured
    /// (see [`crate::clock`]).
    pub const fn line_time_ps(&self) -> u64 {
        let clocks = self.line_length_px as u64
            * self.bus.clocks_per_pixel() as u64
            * self.divider.factor() as u64;
        clocks * 1_000_000_000_000 / self.mclk_hz as u64
    }

    /// Refuse what the sensor cannot do.
    ///
    /// # Errors
    /// [`ConfigError`] names the field and its value.
    pub const fn check(&self) -> Result<(), ConfigError> {
        // The upper limit keeps the product in `line_time_ps` and the sensor's own PLL-less clock tree in range.
        if self.mclk_hz < 3_000_000 || self.mclk_hz > 50_000_000 {
            return Err(ConfigError::MclkHz(self.mclk_hz));
        }
        if self.line_length_px < MIN_LINE_LENGTH {
            return Err(ConfigError::LineLength(self.line_length_px));
        }
        if self.frame_length_lines < MIN_FRAME_LENGTH {
            return Err(ConfigError::FrameLength(self.frame_length_lines));
        }
        if self.exposure_lines < 2 || self.exposure_lines > self.frame_length_lines - 2 {
            return Err(ConfigError::Exposure(self.exposure_lines));
        }
        if self.analog_gain_log2 > 3 {
            return Err(ConfigError::AnalogGain(self.analog_gain_log2));
        }
        Ok(())
    }
}

/// Why a [`Config`] was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigError {
    /// Master clock outside 3 to 50 MHz.
    MclkHz(u32),
    /// Line shorter than [`MIN_LINE_LENGTH`].
    LineLength(u16),
    /// Frame shorter than [`MIN_FRAME_LENGTH`].
    FrameLength(u16),
    /// Exposure outside 2 lines to the frame less 2.
    Exposure(u16),
    /// Gain above 2³.
    AnalogGain(u8),
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, value) = match *self {
            Self::MclkHz(hz) => ("master clock in Hz", hz),
            Self::LineLength(px) => ("line length", px.into()),
            Self::FrameLength(lines) => ("frame length", lines.into()),
            Self::Exposure(lines) => ("exposure in lines", lines.into()),
            Self::AnalogGain(log2) => ("analog gain", log2.into()),
        };
        write!(f, "{what} cannot be {value}")
    }
}
