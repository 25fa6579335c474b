//! The few things that only the operating system's C interface gives.
#![allow(unsafe_code)]

use std::io;
use std::os::fd::AsRawFd;
use std::time::Duration;

/// Gives the calling thread a real-time priority (SCHED_FIFO), 1 to 99.
///
/// # Errors
/// The system does not allow it: systemd's `LimitRTPRIO=` does.
pub fn set_realtime_priority(priority: u8) -> io::Result<()> {
    // SAFETY: an all-zero sched_param is valid, and the call reads it only.
    let outcome = unsafe {
        let mut param: libc::sched_param = std::mem::zeroed();
        param.sched_priority = i32::from(priority);
        // Threads that this one starts later are not to inherit it.
        libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &param)
    };
    if outcome == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Keeps the process's memory out of swap.
///
/// # Errors
/// The system does not allow it: systemd's `LimitMEMLOCK=` does.
pub fn lock_memory() -> io::Result<()> {
    // SAFETY: takes no pointer.
    let outcome = unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
    if outcome == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Most bytes that a pipe takes at once where it takes any (POSIX asks for 512, Linux has 4096).
pub const PIPE_ROOM: usize = 4096;

/// Whether [`PIPE_ROOM`] bytes can be written without waiting for a reader, or will be able to within so long.
pub fn is_writable(file: &impl AsRawFd, within: Duration) -> bool {
    let mut poll = libc::pollfd {
        fd: file.as_raw_fd(),
        events: libc::POLLOUT,
        revents: 0,
    };
    let ms = i32::try_from(within.as_millis()).unwrap_or(i32::MAX);
    // SAFETY: one pollfd, which lives until the end of the call.
    let ready = unsafe { libc::poll(&mut poll, 1, ms) };
    // An error shows at the write itself.
    ready > 0
}

/// Anonymous memory with a file descriptor.
///
/// # Errors
/// The system has none.
#[cfg(feature = "libcamera")]
pub fn memory_file(bytes: usize) -> io::Result<std::os::fd::OwnedFd> {
    use std::os::fd::FromRawFd;
    // SAFETY: the name ends with a zero; the descriptor is new and owned by nobody else.
    let file = unsafe {
        let fd = libc::memfd_create(c"rowtone-frame".as_ptr(), libc::MFD_CLOEXEC);
        if fd < 0 {
            return Err(io::Error::last_os_error());
        }
        std::fs::File::from_raw_fd(fd)
    };
    file.set_len(bytes as u64)?;
    Ok(file.into())
}
