//! The last words: over the UART, then a reset whose cause the next start tells.

use core::fmt::{self, Write};
use embassy_rp::uart::{Blocking, Config, Uart};
use embassy_rp::watchdog::Watchdog;
use embassy_rp::{Peripherals, uart};
use rowtone_pico2::boot;

struct Out(Uart<'static, Blocking>);

impl Write for Out {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0
            .blocking_write(text.as_bytes())
            .map_err(|_: uart::Error| fmt::Error)
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    // SAFETY: nothing else runs on this core any more, and the board is reset below; what the other core still
    // sends may be mixed into the message.
    let p = unsafe { Peripherals::steal() };
    let mut config = Config::default();
    config.baudrate = super::talk::BAUD;
    let mut out = Out(Uart::new_blocking(p.UART0, p.PIN_0, p.PIN_1, config));
    let _ = write!(out, "\r\n# {info}\r\n");
    let _ = out.0.blocking_flush();
    let mut watchdog = Watchdog::new(p.WATCHDOG);
    let scratch = boot::panicking(core::array::from_fn(|i| watchdog.get_scratch(i)));
    for (i, word) in scratch.into_iter().enumerate() {
        watchdog.set_scratch(i, word);
    }
    watchdog.trigger_reset();
    loop {
        cortex_m::asm::wfi();
    }
}
