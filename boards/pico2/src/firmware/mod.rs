//! What needs the chip: its peripherals, interrupts and two cores. All that decides anything is in the library.
//!
//! Core 0, in an interrupt: DMA into line buffers, VSYNC ([`capture`]). Core 0, beside it: each line through
//! the tracker ([`lines`]), and the camera's health ([`camera`]). Core 1, in an interrupt: samples to windows,
//! and the serial line ([`talk`]). Core 1, beside it: the spectrum ([`compute`]).

mod camera;
mod capture;
mod compute;
mod keep;
mod lines;
mod panic;
mod shared;
mod talk;

use cortex_m_rt::entry;
use embassy_rp::executor::{Executor, InterruptExecutor};
use embassy_rp::gpio::{Input, Level, Output, Pull};
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::multicore::{Stack, spawn_core1};
use embassy_rp::pwm::{self, Pwm};
use embassy_rp::uart::{self, BufferedInterruptHandler, BufferedUart};
use embassy_rp::watchdog::Watchdog;
use embassy_rp::{bind_interrupts, dma, i2c, peripherals, pio};
use embassy_sync::zerocopy_channel::Channel;
use rowtone::tracker::StaticStorage;
use rowtone_board::memory::SpectrumMemory;
use rowtone_pico2::boot::Boot;
use rowtone_pico2::handover::{Filler, LineBuffer, Taker};
use rowtone_pico2::plan::{LIMITS, ROWS};
use shared::M;
use static_cell::{ConstStaticCell, StaticCell};

bind_interrupts!(struct Irqs {
    PIO0_IRQ_0 => pio::InterruptHandler<peripherals::PIO0>;
    DMA_IRQ_0 => dma::InterruptHandler<peripherals::DMA_CH0>;
    UART0_IRQ => BufferedInterruptHandler<peripherals::UART0>;
});

/// Memory of the tracker.
type Picture = StaticStorage<
    { LIMITS.width as usize * ROWS as usize },
    { ROWS as usize },
    { LIMITS.width as usize },
>;

static PICTURE: ConstStaticCell<Picture> = ConstStaticCell::new(Picture::new());
static SPECTRUM: ConstStaticCell<SpectrumMemory> = ConstStaticCell::new(SpectrumMemory::new());
static BUFFERS: ConstStaticCell<[LineBuffer; 2]> = ConstStaticCell::new([LineBuffer::NEW; 2]);
static CHANNEL: StaticCell<Channel<'static, M, LineBuffer>> = StaticCell::new();
static UART_OUT: ConstStaticCell<[u8; 2048]> = ConstStaticCell::new([0; 2048]);
static UART_IN: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

/// A window and the serial line's interrupt on top of it (`boards/ci.sh` adds up how deep they go); the guard
/// below it traps what is beyond.
static CORE1_STACK: ConstStaticCell<Stack<{ 44 * 1024 }>> = ConstStaticCell::new(Stack::new());
static CORE0: StaticCell<Executor> = StaticCell::new();
static CORE1: StaticCell<Executor> = StaticCell::new();
static CORE0_URGENT: InterruptExecutor = InterruptExecutor::new();
static CORE1_URGENT: InterruptExecutor = InterruptExecutor::new();

#[embassy_rp::interrupt]
unsafe fn SWI_IRQ_0() {
    // SAFETY: this is the executor's interrupt, and it is enabled by `start` only.
    unsafe { CORE0_URGENT.on_interrupt() }
}

#[embassy_rp::interrupt]
unsafe fn SWI_IRQ_1() {
    // SAFETY: as above.
    unsafe { CORE1_URGENT.on_interrupt() }
}

#[entry]
fn main() -> ! {
    let p = embassy_rp::init(Default::default());
    rtt_target::rtt_init_defmt!();

    let mut watchdog = Watchdog::new(p.WATCHDOG);
    let boot = Boot::new(core::array::from_fn(|i| watchdog.get_scratch(i)));
    for (i, word) in boot.scratch().into_iter().enumerate() {
        watchdog.set_scratch(i, word);
    }
    defmt::info!("{}", defmt::Display2Format(&boot));

    // Before core 1 runs: reading and counting the start needs the flash alone.
    let (store, started) = keep::start(p.FLASH);
    let (collector, reporter) = compute::set_up(SPECTRUM.take());

    // The master clock of modules without an oscillator: 150 MHz / 6 on GP3.
    let mut mclk = pwm::Config::default();
    (mclk.top, mclk.compare_b) = (5, 3);
    let mclk = Pwm::new_output_b(p.PWM_SLICE1, p.PIN_3, mclk);

    let pins = (
        p.PIN_6, p.PIN_7, p.PIN_8, p.PIN_9, p.PIN_10, p.PIN_11, p.PIN_12, p.PIN_13, p.PIN_14,
        p.PIN_15,
    );
    let machine = capture::machine(p.PIO0, pins);
    let vsync = Input::new(p.PIN_16, Pull::None);
    let (sender, receiver) = CHANNEL.init(Channel::new(BUFFERS.take())).split();
    let filler = Filler::new(sender, &shared::LINE_LOSSES);
    let channel = dma::Channel::new(p.DMA_CH0, Irqs);
    let uart_parts = (p.UART0, p.PIN_0, p.PIN_1);

    spawn_core1(p.CORE1, CORE1_STACK.take(), move || {
        let mut config = uart::Config::default();
        config.baudrate = talk::BAUD;
        let (uart0, tx, rx) = uart_parts;
        let uart = BufferedUart::new(uart0, tx, rx, Irqs, UART_OUT.take(), UART_IN.take(), config);
        interrupt::SWI_IRQ_1.set_priority(Priority::P2);
        let urgent = CORE1_URGENT.start(interrupt::SWI_IRQ_1);
        urgent.spawn(compute::collect(collector).unwrap());
        urgent.spawn(talk::talk(uart, boot, started).unwrap());
        CORE1
            .init(Executor::new())
            .run(|spawner| spawner.spawn(compute::compute(reporter).unwrap()))
    });

    interrupt::SWI_IRQ_0.set_priority(Priority::P1);
    let urgent = CORE0_URGENT.start(interrupt::SWI_IRQ_0);
    urgent.spawn(capture::vsync(vsync).unwrap());
    urgent.spawn(capture::lines(machine, channel, filler).unwrap());

    let bus = i2c::I2c::new_blocking(p.I2C0, p.PIN_5, p.PIN_4, i2c::Config::default());
    let led = Output::new(p.PIN_25, Level::Low);
    CORE0.init(Executor::new()).run(|spawner| {
        spawner.spawn(lines::work(Taker::new(receiver), PICTURE.take()).unwrap());
        spawner.spawn(camera::watch(bus, led, watchdog, store, mclk).unwrap());
    })
}
