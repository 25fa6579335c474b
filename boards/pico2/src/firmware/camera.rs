//! The camera's health, the LED and the watchdog, on core 0.

use super::keep::{self, FlashStore};
use super::shared::{
    CAMERA, CAMERA_STATE, CORE1_ALIVE, FRAMES, LINE_LOSSES, LINES, MEASURING, PLAN_ANEW,
    RESTART_CAPTURE,
};
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_rp::gpio::{Level, Output};
use embassy_rp::i2c::{Blocking, Error, I2c};
use embassy_rp::peripherals::I2C0;
use embassy_rp::pwm::Pwm;
use embassy_rp::watchdog::Watchdog;
use embassy_time::{Delay, Duration, Instant, Timer};
use rowtone_pico2::health::{Action, Event, Health};
use rowtone_pico2::hm01b0::Hm01b0;

/// Both cores must show life within this.
const PATIENCE: Duration = Duration::from_secs(4);
const TICK: Duration = Duration::from_millis(50);

/// Counts up; says by how much since the last look.
struct Since {
    counter: &'static AtomicU32,
    last: u32,
}

impl Since {
    const fn new(counter: &'static AtomicU32) -> Self {
        Self { counter, last: 0 }
    }

    fn any(&mut self) -> bool {
        let now = self.counter.load(Ordering::Relaxed);
        core::mem::replace(&mut self.last, now) != now
    }
}

/// Watches for ever. `_mclk` keeps the camera's master clock running.
#[embassy_executor::task]
pub(crate) async fn watch(
    bus: I2c<'static, I2C0, Blocking>,
    mut led: Output<'static>,
    mut watchdog: Watchdog,
    mut store: FlashStore,
    _mclk: Pwm<'static>,
) {
    let mut camera = Hm01b0::new(bus);
    let mut health = Health::new();
    let mut said = None;
    let mut action = Some(Action::SetUp);
    let (mut lines, mut overruns, mut stalls, mut core1) = (
        Since::new(&LINES),
        Since::new(&LINE_LOSSES.overruns),
        Since::new(&LINE_LOSSES.stalled),
        Since::new(&CORE1_ALIVE),
    );
    let mut core1_seen = Instant::now();
    watchdog.pause_on_debug(true);
    watchdog.start(PATIENCE);
    loop {
        match action.take() {
            Some(Action::SetUp) => {
                let result = camera.start(&CAMERA, &mut Delay);
                if result.is_ok() {
                    FRAMES.lock(|frames| frames.borrow_mut().restart());
                    RESTART_CAPTURE.signal(());
                    PLAN_ANEW.store(true, Ordering::Relaxed);
                }
                health.on(Event::SetUp(result), Instant::now().as_millis());
            }
            Some(Action::RestartCapture) => RESTART_CAPTURE.signal(()),
            None => {}
        }
        Timer::after(TICK).await;
        let now_ms = Instant::now().as_millis();
        for (happened, event) in [
            (lines.any(), Event::Line),
            (overruns.any(), Event::Overrun),
            (stalls.any(), Event::DmaStalled),
            (true, Event::<Error>::Tick),
        ] {
            if happened {
                action = health.on(event, now_ms).or(action);
            }
        }
        if said != Some(health.state()) {
            said = Some(health.state());
            defmt::info!("{}", defmt::Display2Format(&health.state()));
            CAMERA_STATE.signal(health.state());
        }
        let lit = health
            .show(MEASURING.load(Ordering::Relaxed), now_ms)
            .is_lit(now_ms);
        led.set_level(if lit { Level::High } else { Level::Low });
        keep::serve(&mut store);
        if core1.any() {
            core1_seen = Instant::now();
        }
        if core1_seen.elapsed() < PATIENCE {
            watchdog.feed(PATIENCE);
        }
    }
}
