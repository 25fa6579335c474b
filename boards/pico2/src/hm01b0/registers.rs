//! Register addresses, by the datasheet's names.

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
