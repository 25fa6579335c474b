//! UART0: Arm's CMSDK APB UART (Application Note AN505, section 5.3). Output only; QEMU shows it.

use core::fmt;

const BASE: usize = 0x4020_0000;
const DATA: *mut u32 = BASE as *mut u32;
const STATE: *mut u32 = (BASE + 0x04) as *mut u32;
const CTRL: *mut u32 = (BASE + 0x08) as *mut u32;
const BAUDDIV: *mut u32 = (BASE + 0x10) as *mut u32;
const TX_FULL: u32 = 1;
const TX_ENABLE: u32 = 1;

/// The board's serial port, as text goes out.
pub struct Uart;

impl Uart {
    /// Switch the transmitter on: 20 MHz / 174 = 115 200 baud, which QEMU ignores.
    pub fn new() -> Self {
        // SAFETY: the addresses are the UART's registers, and nothing else touches them.
        unsafe {
            BAUDDIV.write_volatile(174);
            CTRL.write_volatile(TX_ENABLE);
        }
        Self
    }

    /// Send bytes, waiting for room.
    pub fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            // SAFETY: as in `new`.
            unsafe {
                while STATE.read_volatile() & TX_FULL != 0 {}
                DATA.write_volatile(byte.into());
            }
        }
    }
}

impl fmt::Write for Uart {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        self.write(s.as_bytes());
        Ok(())
    }
}
