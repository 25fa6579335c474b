//! One output line of a GPIO chip, by Linux's character device.
//!
//! The second version of its interface (`linux/gpio.h`, Linux 5.10 and newer; the kernel's document
//! `userspace-api/gpio/chardev`), which is all that a contact needs: one request, one value. The kernel gives the line
//! back when the program ends, however it ends.
#![allow(unsafe_code)]

use std::fs::File;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::path::Path;

const OUTPUT: u64 = 1 << 3;
/// An attribute that holds the values of outputs.
const OUTPUT_VALUES: u32 = 2;

/// `struct gpio_v2_line_config_attribute`.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Attribute {
    id: u32,
    padding: u32,
    values: u64,
    mask: u64,
}

/// `struct gpio_v2_line_request`, its `struct gpio_v2_line_config` in place.
#[repr(C)]
struct Request {
    offsets: [u32; 64],
    consumer: [u8; 32],
    flags: u64,
    attributes: u32,
    config_padding: [u32; 5],
    attribute: [Attribute; 10],
    lines: u32,
    event_buffer_size: u32,
    padding: [u32; 5],
    fd: i32,
}

/// `struct gpio_v2_line_values`.
#[repr(C)]
struct Values {
    bits: u64,
    mask: u64,
}

/// `_IOWR(0xB4, number, T)` of `asm-generic/ioctl.h`.
const fn read_write<T>(number: u32) -> u32 {
    3 << 30 | (size_of::<T>() as u32) << 16 | 0xb4 << 8 | number
}

const GET_LINE: u32 = read_write::<Request>(0x07);
const SET_VALUES: u32 = read_write::<Values>(0x0f);

/// A line that this program drives.
#[derive(Debug)]
pub struct OutputLine(OwnedFd);

impl OutputLine {
    /// Takes a line of a chip, such as `/dev/gpiochip0`, and drives it.
    ///
    /// # Errors
    /// There is no such chip or line, another program has it, or this one may not.
    pub fn request(chip: &Path, line: u32, high: bool) -> io::Result<Self> {
        let chip = File::options().read(true).write(true).open(chip)?;
        let mut request = Request {
            offsets: [0; 64],
            consumer: [0; 32],
            flags: OUTPUT,
            attributes: 1,
            config_padding: [0; 5],
            attribute: [Attribute::default(); 10],
            lines: 1,
            event_buffer_size: 0,
            padding: [0; 5],
            fd: -1,
        };
        request.offsets[0] = line;
        request.consumer[..13].copy_from_slice(b"rowtone-alarm");
        request.attribute[0] = Attribute {
            id: OUTPUT_VALUES,
            values: high.into(),
            mask: 1,
            ..Attribute::default()
        };
        // SAFETY: the structure is the one that this call reads and writes, and lives until its end.
        let outcome = unsafe { libc::ioctl(chip.as_raw_fd(), GET_LINE as _, &mut request) };
        if outcome < 0 {
            return Err(io::Error::last_os_error());
        }
        if request.fd < 0 {
            return Err(io::Error::other("the chip gave no line"));
        }
        // SAFETY: the kernel has just made this descriptor, and nobody else owns it.
        Ok(Self(unsafe { OwnedFd::from_raw_fd(request.fd) }))
    }

    /// Drives it high or low.
    ///
    /// # Errors
    /// The chip is gone.
    pub fn set(&self, high: bool) -> io::Result<()> {
        let mut values = Values {
            bits: high.into(),
            mask: 1,
        };
        // SAFETY: the structure is the one that this call reads, and lives until its end.
        let outcome = unsafe { libc::ioctl(self.0.as_raw_fd(), SET_VALUES as _, &mut values) };
        match outcome {
            0.. => Ok(()),
            _ => Err(io::Error::last_os_error()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers that a C compiler gives of `linux/gpio.h` (6.1): sizes, and the calls that hold them.
    #[test]
    fn structures_are_those_of_the_kernel() {
        assert_eq!(size_of::<Attribute>(), 24);
        assert_eq!(size_of::<Request>(), 592);
        assert_eq!(std::mem::offset_of!(Request, flags), 288);
        assert_eq!(std::mem::offset_of!(Request, attribute), 320);
        assert_eq!(std::mem::offset_of!(Request, fd), 588);
        assert_eq!((GET_LINE, SET_VALUES), (0xc250_b407, 0xc010_b40f));
    }

    #[test]
    fn what_is_no_chip_is_refused() {
        assert!(OutputLine::request(Path::new("/nowhere/gpiochip0"), 3, false).is_err());
        assert!(OutputLine::request(Path::new("/dev/null"), 3, false).is_err());
    }
}
