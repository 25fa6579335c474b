//! The camera: Himax HM01B0, 324 x 324 px mono, rolling shutter, on I²C address 0x24.
//!
//! Register addresses and bit meanings are the datasheet's (*HM01B0-MNA*, section "Register table").
//! Only what measuring vibration needs is set: a fixed exposure and gain (an automatic exposure would
//! change the amplitude in the middle of a window), the QVGA window of 324 x 244 px, the width of the
//! data bus, and a pixel clock that runs on between the lines (a gated one would make a lost clock edge
//! undetectable, see [`crate::capture`]).

mod config;
mod registers;
#[cfg(test)]
mod tests;

pub use config::{Bus, ClockDivider, Config, ConfigError};

use core::fmt;
use embedded_hal::{delay::DelayNs, i2c::I2c};
use registers as r;

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

const STANDBY: u8 = 0;
const STREAMING: u8 = 1;

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
            Self::Config(e) => write!(f, "camera: configuration refused: {e}"),
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
