//! Instructions, counted by SysTick.
//!
//! QEMU has no cycle counter for this core. With `-icount shift=7` every instruction takes 128 ns of the
//! board's time, and SysTick ticks every 50 ns, so 2.56 ticks are one instruction, exactly.

use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::exception;

const RELOAD: u32 = 0x00FF_FFFF;
const TICKS_100: u64 = 256; // of 100 instructions

static WRAPS: AtomicU32 = AtomicU32::new(0);

#[exception]
fn SysTick() {
    WRAPS.fetch_add(1, Ordering::Relaxed);
}

/// Counts the instructions between two points.
pub struct Counter {
    overhead_ticks: u64,
}

impl Counter {
    /// Start SysTick, and measure what measuring costs.
    pub fn new(mut syst: SYST) -> Self {
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(RELOAD);
        syst.clear_current();
        syst.enable_counter();
        syst.enable_interrupt();
        let mut counter = Self {
            overhead_ticks: u64::MAX,
        };
        for _ in 0..8 {
            let start = counter.start();
            counter.overhead_ticks = counter.overhead_ticks.min(ticks() - start.0);
        }
        counter
    }

    /// The point from which on instructions count.
    #[inline(always)]
    pub fn start(&self) -> Start {
        Start(ticks())
    }

    /// Instructions since `start`.
    #[inline(always)]
    pub fn instructions(&self, start: Start) -> u64 {
        (ticks() - start.0).saturating_sub(self.overhead_ticks) * 100 / TICKS_100
    }
}

/// A point in time, from [`Counter::start`].
#[derive(Clone, Copy)]
pub struct Start(u64);

#[inline(never)]
fn ticks() -> u64 {
    loop {
        let wraps = WRAPS.load(Ordering::Relaxed);
        let left = SYST::get_current();
        if WRAPS.load(Ordering::Relaxed) == wraps {
            return u64::from(wraps) * u64::from(RELOAD + 1) + u64::from(RELOAD - left);
        }
    }
}
