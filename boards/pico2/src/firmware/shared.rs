//! What the cores and interrupts share, each with one writer.

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use embassy_sync::blocking_mutex::{Mutex, raw::CriticalSectionRawMutex};
use embassy_sync::signal::Signal;
use rowtone::link::settings::Settings;
use rowtone_board::plan::Plan;
use rowtone_pico2::frames::Frames;
use rowtone_pico2::handover::LineLosses;
use rowtone_pico2::health::State;
use rowtone_pico2::hm01b0::{Config, ROWS};
use rowtone_pico2::losses::Losses;

/// Works across cores: embassy-rp's critical section takes a hardware spinlock.
pub(crate) type M = CriticalSectionRawMutex;

/// How the camera runs.
pub(crate) const CAMERA: Config = if cfg!(feature = "bus-1bit") {
    Config::QVGA_1BIT
} else if cfg!(feature = "bus-4bit") {
    Config::QVGA_4BIT
} else {
    Config::QVGA_8BIT
};

const FRAME_NS: i64 = (CAMERA.line_time_ps() * CAMERA.frame_length_lines as u64 / 1000) as i64;

/// Numbers lines; written by the two tasks of core 0's interrupt.
pub(crate) static FRAMES: Mutex<M, RefCell<Frames>> =
    Mutex::new(RefCell::new(Frames::new(FRAME_NS, ROWS)));
/// Lines lost before they were measured.
pub(crate) static LINE_LOSSES: LineLosses = LineLosses::new();
/// Lines that the DMA completed, dropped or not; wraps.
pub(crate) static LINES: AtomicU32 = AtomicU32::new(0);
/// Samples that found core 1's queue full.
pub(crate) static DROPPED_SAMPLES: AtomicU32 = AtomicU32::new(0);
/// Windows that found core 1 still busy with the last.
pub(crate) static DROPPED_WINDOWS: AtomicU32 = AtomicU32::new(0);
/// Capture is to start anew.
pub(crate) static RESTART_CAPTURE: Signal<M, ()> = Signal::new();

/// The settings in use; written by core 1.
pub(crate) static SETTINGS: Mutex<M, RefCell<Option<Settings>>> = Mutex::new(RefCell::new(None));
/// They have changed, or the camera was started anew: core 0 plans anew.
pub(crate) static PLAN_ANEW: AtomicBool = AtomicBool::new(false);
/// Core 0's plan, for core 1.
pub(crate) static PLAN: Signal<M, Plan> = Signal::new();
/// The reference is learned.
pub(crate) static MEASURING: AtomicBool = AtomicBool::new(false);
/// The camera's state has changed: to be said on the serial line.
pub(crate) static CAMERA_STATE: Signal<M, State> = Signal::new();
/// Core 1 is alive; it counts.
pub(crate) static CORE1_ALIVE: AtomicU32 = AtomicU32::new(0);

/// What was lost since the start.
pub(crate) fn losses() -> Losses {
    let read = |counter: &AtomicU32| counter.load(Ordering::Relaxed);
    Losses {
        late: read(&LINE_LOSSES.overruns),
        short: read(&LINE_LOSSES.short),
        stalled: read(&LINE_LOSSES.stalled),
        samples: read(&DROPPED_SAMPLES),
        windows: read(&DROPPED_WINDOWS),
    }
}
