//! What only exists on the board (or in QEMU): its serial port, its counter, its stack, the host's files.

pub mod counter;
pub mod host;
pub mod stack;
pub mod uart;

use core::fmt::Write;

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    let _ = writeln!(uart::Uart::new(), "{info}");
    host::exit(false)
}
