//! The camera: Himax HM01B0, 324 x 324 px mono, rolling shutter, on I²C address 0x24.
//!
//! Register addresses and bit meanings are the datasheet's (*HM01B0-MNA*, section "Register table").
//! Only what measuring vibration needs is set: a fixed exposure and gain (an automatic exposure would
//! change the amplitude in the middle of a window), the QVGA window of 324 x 244 px, the width of the
//! data bus, and a pixel clock that runs on between the lines (a gated one would make a lost clock edge
//! undetectable, see [`crate::capture`]).

use core::fmt;
use embedded_hal::{delay::DelayNs, i2c::I2c};

/// 7-bit I²C address.
pub const ADDRESS: u8 = 0x24;
/// What the model registers read.
pub const MODEL_ID: u16 = 0x01B0;
/// Pixels of a row in the QVGA window.
pub const WIDTH: u16 = 324;
/// Rows of a frame in the QVGA window.
pub const ROWS: u16 = 244;
/// Shortest line, in pixel clocks: the datasheet's minimum for unbinned rows.
pub const MIN_LINE_LENGTH: u16 = 376;
/// Shortest frame of the QVGA window, in lines.
pub const MIN_FRAME_LENGTH: u16 = 260;

mod register {
    pub(super) const MODEL_ID_H: u16 = 0x0000;
    pub(super) const MODE_SELECT: u16 = 0x0100;
    pub(super) const SW_RESET: u16 = 0x0103;
    pub(super) const GROUP_HOLD: u16 = 0x0104;
    pub(super) const INTEGRATION: u16 = 0x0202;
    pub(super) const ANALOG_GAIN: u16 = 0x0205;
    pub(super) const DIGITAL_GAIN: u16 = 0x020E;
    pub(super) const FRAME_LENGTH_LINES: u16 = 0x0340;
    pub(super) const LINE_LENGTH_PCK: u16 = 0x0342;
    pub(super) const READOUT_X: u16 = 0x0383;
    pub(super) const READOUT_Y: u16 = 0x0387;
    pub(super) const BINNING: u16 = 0x0390;
    pub(super) const BLC_CONFIG: u16 = 0x1000;
    pub(super) const BLC_TARGET: u16 = 0x1003;
    pub(super) const DEFECT_PIXELS: u16 = 0x1008;
    pub(super) const AE_CONTROL: u16 = 0x2100;
    pub(super) const MOTION_DETECTION: u16 = 0x2150;
    pub(super) const QVGA_WINDOW: u16 = 0x3010;
    pub(super) const BIT_CONTROL: u16 = 0x3059;
    pub(super) const CLOCK_DIVIDERS: u16 = 0x3060;
    pub(super) const PCLK_POLARITY: u16 = 0x3068;
}
use register as r;

const STANDBY: u8 = 0;
const STREAMING: u8 = 1;

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
    const fn bit_control(self) -> u8 {
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

    const fn bits(self) -> u8 {
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

/// Why the camera could not be set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus: no answer, or a fault on it.
    Bus(E),
    /// Something else answers at this address.
    WrongModel(u16),
    /// It does not come back from its reset.
    StuckInReset,
    /// The configuration.
    Config(ConfigError),
}

impl<E> From<E> for Error<E> {
    fn from(e: E) -> Self {
        Self::Bus(e)
    }
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(e) => write!(
                f,
                "camera: no answer on I2C ({e:?}); check SDA, SCL, power and master clock"
            ),
            Self::WrongModel(id) => write!(
                f,
                "camera: model {id:#06x} at address 0x24, expected {MODEL_ID:#06x}"
            ),
            Self::StuckInReset => {
                f.write_str("camera: does not come back from reset; check its power")
            }
            Self::Config(e) => write!(f, "camera: configuration refused: {e:?}"),
        }
    }
}

/// The camera on its bus.
#[derive(Debug)]
pub struct Hm01b0<I2C> {
    i2c: I2C,
}

/// Times that the mode is read after a reset, and the wait between, ms.
const RESET_TRIES: u32 = 10;
const RESET_WAIT_MS: u32 = 10;

impl<I2C: I2c> Hm01b0<I2C> {
    /// A camera on this bus. Nothing is sent yet.
    pub fn new(i2c: I2C) -> Self {
        Self { i2c }
    }

    /// Give the bus back.
    pub fn release(self) -> I2C {
        self.i2c
    }

    /// What the model registers read.
    ///
    /// # Errors
    /// The bus's.
    pub fn model_id(&mut self) -> Result<u16, I2C::Error> {
        let mut id = [0; 2];
        self.i2c
            .write_read(ADDRESS, &r::MODEL_ID_H.to_be_bytes(), &mut id)?;
        Ok(u16::from_be_bytes(id))
    }

    /// Check that it is the right camera, reset it, set it up, and let it stream.
    ///
    /// # Errors
    /// See [`Error`]; the camera is then in standby or not there. Calling again is the recovery.
    pub fn start(
        &mut self,
        config: &Config,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<I2C::Error>> {
        config.check().map_err(Error::Config)?;
        let id = self.model_id()?;
        if id != MODEL_ID {
            return Err(Error::WrongModel(id));
        }
        self.reset(delay)?;
        // Gated clock off (bit 5), least significant bit first (bit 4), register clock = master clock (bits 3..2).
        let clocks = 0b1000 | config.divider.bits();
        for (register, value) in [
            (r::BLC_CONFIG, 0x43), // black level: on, filtered
            (r::BLC_TARGET, 0x08), // to 8 of 255
            (r::DEFECT_PIXELS, 0), // no correction: it would mix neighbours where they differ most
            (r::AE_CONTROL, 0),    // exposure and gain stay as they are set
            (r::MOTION_DETECTION, 0),
            (r::READOUT_X, 1), // no binning
            (r::READOUT_Y, 1),
            (r::BINNING, 0),
            (r::QVGA_WINDOW, 1),
            (r::ANALOG_GAIN, config.analog_gain_log2 << 4),
            (r::BIT_CONTROL, config.bus.bit_control()),
            (r::CLOCK_DIVIDERS, clocks),
            (r::PCLK_POLARITY, 0), // data change at the falling edge, are valid at the rising one
        ] {
            self.write8(register, value)?;
        }
        for (register, value) in [
            (r::DIGITAL_GAIN, 0x0100), // 1, in 1/256
            (r::FRAME_LENGTH_LINES, config.frame_length_lines),
            (r::LINE_LENGTH_PCK, config.line_length_px),
        ] {
            self.write16(register, value)?;
        }
        self.set_exposure(config.exposure_lines)?;
        Ok(self.write8(r::MODE_SELECT, STREAMING)?)
    }

    /// Expose each row for this many line times, from the next frame on.
    ///
    /// # Errors
    /// The bus's.
    pub fn set_exposure(&mut self, lines: u16) -> Result<(), I2C::Error> {
        self.write16(r::INTEGRATION, lines)?;
        self.write8(r::GROUP_HOLD, 1)
    }

    /// Stop streaming.
    ///
    /// # Errors
    /// The bus's.
    pub fn standby(&mut self) -> Result<(), I2C::Error> {
        self.write8(r::MODE_SELECT, STANDBY)
    }

    fn reset(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<I2C::Error>> {
        self.write8(r::SW_RESET, 1)?;
        for _ in 0..RESET_TRIES {
            delay.delay_ms(RESET_WAIT_MS);
            let mut mode = [u8::MAX];
            self.i2c
                .write_read(ADDRESS, &r::MODE_SELECT.to_be_bytes(), &mut mode)?;
            if mode == [STANDBY] {
                return Ok(());
            }
        }
        Err(Error::StuckInReset)
    }

    fn write8(&mut self, register: u16, value: u8) -> Result<(), I2C::Error> {
        let [high, low] = register.to_be_bytes();
        self.i2c.write(ADDRESS, &[high, low, value])
    }

    fn write16(&mut self, register: u16, value: u16) -> Result<(), I2C::Error> {
        let ([high, low], [first, second]) = (register.to_be_bytes(), value.to_be_bytes());
        self.i2c.write(ADDRESS, &[high, low, first, second])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
    use embedded_hal_mock::eh1::{
        delay::NoopDelay,
        i2c::{Mock, Transaction},
    };

    fn identify(id: u16) -> Transaction {
        Transaction::write_read(ADDRESS, vec![0, 0], id.to_be_bytes().to_vec())
    }

    fn start(expected: &[Transaction], config: &Config) -> Result<(), Error<ErrorKind>> {
        let mut bus = Mock::new(expected);
        let result = Hm01b0::new(bus.clone()).start(config, &mut NoopDelay::new());
        bus.done();
        result
    }

    /// A start that goes well, as the datasheet's registers tell it.
    fn good_start() -> Vec<Transaction> {
        let mut expected = vec![
            identify(MODEL_ID),
            Transaction::write(ADDRESS, vec![0x01, 0x03, 1]),
        ];
        for mode in [0xFF, 0] {
            expected.push(Transaction::write_read(
                ADDRESS,
                vec![0x01, 0x00],
                vec![mode],
            ));
        }
        for (register, value) in [
            (0x1000_u16, &[0x43][..]),
            (0x1003, &[8]),
            (0x1008, &[0]),
            (0x2100, &[0]),
            (0x2150, &[0]),
            (0x0383, &[1]),
            (0x0387, &[1]),
            (0x0390, &[0]),
            (0x3010, &[1]),
            (0x0205, &[0]),
            (0x3059, &[0x02]),
            (0x3060, &[0b1001]),
            (0x3068, &[0]),
            (0x020E, &[1, 0]),
            (0x0340, &[1, 4]),
            (0x0342, &[1, 0xA4]),
            (0x0202, &[0, 8]),
            (0x0104, &[1]),
            (0x0100, &[1]),
        ] {
            expected.push(Transaction::write(
                ADDRESS,
                [&register.to_be_bytes(), value].concat(),
            ));
        }
        expected
    }

    #[test]
    fn starts_and_streams_last() {
        assert_eq!(start(&good_start(), &Config::QVGA_8BIT), Ok(()));
    }

    #[test]
    fn another_camera_is_not_written_to() {
        assert_eq!(
            start(&[identify(0x0356)], &Config::QVGA_8BIT),
            Err(Error::WrongModel(0x0356))
        );
    }

    #[test]
    fn bus_error_at_any_byte_of_the_start_is_told() {
        let error = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
        let good = good_start();
        for n in 0..good.len() {
            let mut expected = good[..=n].to_vec();
            expected[n] = expected[n].clone().with_error(error);
            assert_eq!(
                start(&expected, &Config::QVGA_8BIT),
                Err(Error::Bus(error)),
                "transaction {n}"
            );
        }
    }

    #[test]
    fn camera_stuck_in_reset_is_told() {
        let mut expected = good_start()[..2].to_vec();
        for _ in 0..RESET_TRIES {
            expected.push(Transaction::write_read(
                ADDRESS,
                vec![0x01, 0x00],
                vec![0xFF],
            ));
        }
        assert_eq!(
            start(&expected, &Config::QVGA_8BIT),
            Err(Error::StuckInReset)
        );
    }

    #[test]
    fn bad_configurations_send_nothing() {
        let good = Config::QVGA_8BIT;
        for (config, error) in [
            (
                Config {
                    mclk_hz: 60_000_000,
                    ..good
                },
                ConfigError::MclkHz(60_000_000),
            ),
            (
                Config {
                    line_length_px: 375,
                    ..good
                },
                ConfigError::LineLength(375),
            ),
            (
                Config {
                    frame_length_lines: 259,
                    ..good
                },
                ConfigError::FrameLength(259),
            ),
            (
                Config {
                    exposure_lines: 259,
                    ..good
                },
                ConfigError::Exposure(259),
            ),
            (
                Config {
                    analog_gain_log2: 4,
                    ..good
                },
                ConfigError::AnalogGain(4),
            ),
        ] {
            assert_eq!(start(&[], &config), Err(Error::Config(error)));
        }
    }

    #[test]
    fn line_times() {
        assert_eq!(Config::QVGA_8BIT.line_time_ps(), 67_200_000);
        assert_eq!(Config::QVGA_4BIT.line_time_ps(), 67_200_000);
        assert_eq!(Config::QVGA_1BIT.line_time_ps(), 125_333_333);
    }
}
