//! The host's files and command line, by semihosting (Arm's *Semihosting for AArch32 and AArch64*).

use core::fmt;
use cortex_m_semihosting::{debug, nr, syscall, syscall1};

/// The command line that QEMU was given (`arg=` words, a space between them).
pub fn command_line(buffer: &mut [u8]) -> Option<&str> {
    let mut block = [buffer.as_mut_ptr() as usize, buffer.len()];
    // SAFETY: the block is a buffer and its length; the host writes at most that much, and the true length.
    let failed = unsafe { syscall1(nr::GET_CMDLINE, &raw mut block as usize) };
    let bytes = buffer.get(..block[1]).filter(|_| failed == 0)?;
    core::str::from_utf8(bytes).ok()
}

/// End QEMU with exit status 0 or 1.
pub fn exit(success: bool) -> ! {
    let status = if success {
        debug::EXIT_SUCCESS
    } else {
        debug::EXIT_FAILURE
    };
    loop {
        debug::exit(status);
    }
}

/// A file of the host, open for reading.
pub struct File {
    handle: usize,
    bytes: usize,
}

/// A file that cannot be read.
#[derive(Clone, Copy, Debug)]
pub enum FileError {
    /// It cannot be opened.
    Open,
    /// It ends early, or the host refuses.
    Read,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Open => "clip: cannot be opened",
            Self::Read => "clip: cannot be read to its end",
        })
    }
}

impl File {
    /// Open for reading, in binary. The path is at most 511 bytes long.
    pub fn open(path: &str) -> Result<Self, FileError> {
        let mut name = [0u8; 512]; // the host wants a final zero
        name.get_mut(..path.len())
            .filter(|p| p.len() < 512)
            .ok_or(FileError::Open)?
            .copy_from_slice(path.as_bytes());
        // SAFETY: the block is a zero-ended name, mode 1 ("rb") and the name's length.
        let handle = unsafe { syscall(nr::OPEN, &[name.as_ptr() as usize, 1, path.len()]) };
        if handle == usize::MAX {
            return Err(FileError::Open);
        }
        // SAFETY: the block is an open handle.
        let bytes = unsafe { syscall(nr::FLEN, &[handle]) };
        Ok(Self { handle, bytes })
    }

    /// Bytes in the file.
    pub fn len(&self) -> usize {
        self.bytes
    }

    /// The next read starts here.
    pub fn seek(&mut self, byte: usize) -> Result<(), FileError> {
        // SAFETY: the block is an open handle and a position.
        match unsafe { syscall(nr::SEEK, &[self.handle, byte]) } {
            0 => Ok(()),
            _ => Err(FileError::Read),
        }
    }

    /// Read as much as there is; returns the bytes that were read.
    pub fn read(&mut self, buffer: &mut [u8]) -> Result<usize, FileError> {
        // SAFETY: the block is an open handle, a buffer and its length; the host writes at most that much.
        let left = unsafe {
            syscall(
                nr::READ,
                &[self.handle, buffer.as_mut_ptr() as usize, buffer.len()],
            )
        };
        buffer.len().checked_sub(left).ok_or(FileError::Read)
    }

    /// Fill the buffer, or fail.
    pub fn read_exact(&mut self, buffer: &mut [u8]) -> Result<(), FileError> {
        match self.read(buffer)? {
            n if n == buffer.len() => Ok(()),
            _ => Err(FileError::Read),
        }
    }
}
