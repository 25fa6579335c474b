//! What only exists on the board (or in QEMU): its serial port, its counter, its stack, the host's files.

pub(crate) mod counter;
pub(crate) mod host;
pub(crate) mod stack;
pub(crate) mod uart;
