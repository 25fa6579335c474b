//! Lines into buffers: PIO, DMA and VSYNC, in core 0's interrupt, before everything else.

use super::Irqs;
use super::shared::{CAMERA, FRAMES, LINE_LOSSES, LINES, M, RESTART_CAPTURE};
use core::sync::atomic::Ordering;
use embassy_futures::select::{Either, select};
use embassy_rp::Peri;
use embassy_rp::dma;
use embassy_rp::gpio::Input;
use embassy_rp::peripherals::{
    PIN_6, PIN_7, PIN_8, PIN_9, PIN_10, PIN_11, PIN_12, PIN_13, PIN_14, PIN_15, PIO0,
};
use embassy_rp::pio::{self, Pio, ShiftConfig, ShiftDirection, StateMachine};
use embassy_time::Instant;
use rowtone_pico2::capture::{HREF, program, samples_less_one};
use rowtone_pico2::handover::{Filler, count};

/// The camera's pins: D0 to D7 (a narrow bus leaves the upper ones unwired), PCLK, HREF.
pub(crate) type Pins = (
    Peri<'static, PIN_6>,
    Peri<'static, PIN_7>,
    Peri<'static, PIN_8>,
    Peri<'static, PIN_9>,
    Peri<'static, PIN_10>,
    Peri<'static, PIN_11>,
    Peri<'static, PIN_12>,
    Peri<'static, PIN_13>,
    Peri<'static, PIN_14>,
    Peri<'static, PIN_15>,
);

/// A state machine and what to load it with.
pub(crate) struct Machine {
    machine: StateMachine<'static, PIO0, 0>,
    config: pio::Config<'static, PIO0>,
}

/// Load the program.
pub(crate) fn machine(pio0: Peri<'static, PIO0>, pins: Pins) -> Machine {
    let Pio {
        mut common, sm0, ..
    } = Pio::new(pio0, Irqs);
    // Not `load_program`: its panic would bring in the printing of structures, which is 1 KiB.
    let Ok(program) = common.try_load_program(&program(CAMERA.bus)) else {
        panic!("no room for the PIO program")
    };
    let (d0, d1, d2, d3, d4, d5, d6, d7, pclk, href) = pins;
    let pins = [
        &common.make_pio_pin(d0),
        &common.make_pio_pin(d1),
        &common.make_pio_pin(d2),
        &common.make_pio_pin(d3),
        &common.make_pio_pin(d4),
        &common.make_pio_pin(d5),
        &common.make_pio_pin(d6),
        &common.make_pio_pin(d7),
        &common.make_pio_pin(pclk),
        &common.make_pio_pin(href),
    ];
    let mut config = pio::Config::default();
    config.use_program(&program, &[]);
    config.set_in_pins(&pins);
    config.set_jmp_pin(pins[usize::from(HREF)]);
    config.shift_in = ShiftConfig {
        threshold: 32,
        direction: ShiftDirection::Right,
        auto_fill: true,
    };
    Machine {
        machine: sm0,
        config,
    }
}

impl Machine {
    /// From the program's start, with empty FIFOs; the next line is whole.
    fn start(&mut self) {
        self.machine.set_enable(false);
        self.machine.clear_fifos();
        self.machine.restart();
        self.machine.set_config(&self.config);
        self.machine.tx().push(samples_less_one(CAMERA.bus));
        let _ = self.machine.rx().stalled(); // an old one
        self.machine.set_enable(true);
    }
}

/// Notes when frames begin.
#[embassy_executor::task]
pub(crate) async fn vsync(mut pin: Input<'static>) {
    loop {
        pin.wait_for_rising_edge().await;
        let now_ns = Instant::now().as_micros() as i64 * 1000;
        FRAMES.lock(|frames| frames.borrow_mut().vsync(now_ns));
    }
}

/// Fills line buffers for ever.
#[embassy_executor::task]
pub(crate) async fn lines(
    mut machine: Machine,
    mut channel: dma::Channel<'static>,
    mut filler: Filler<'static, M>,
) {
    loop {
        machine.start();
        while let Some(buffer) = filler.buffer() {
            let transfer = machine
                .machine
                .rx()
                .dma_pull(&mut channel, &mut buffer.words, false);
            if let Either::Second(()) = select(transfer, RESTART_CAPTURE.wait()).await {
                FRAMES.lock(|frames| frames.borrow_mut().abandon());
                break;
            }
            let stalled = machine.machine.rx().stalled();
            let place = FRAMES.lock(|frames| {
                let mut frames = frames.borrow_mut();
                if stalled {
                    // A whole line may have gone by while the machine waited.
                    frames.abandon();
                }
                frames.line()
            });
            if stalled {
                count(&LINE_LOSSES.stalled);
            }
            LINES.store(
                LINES.load(Ordering::Relaxed).wrapping_add(1),
                Ordering::Relaxed,
            );
            filler.filled(place);
        }
    }
}
