//! Readings to windows, windows to reports, on core 1.

use super::shared::{DROPPED_WINDOWS, M, PLAN};
use core::cell::RefCell;
use core::future::poll_fn;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use heapless::spsc::{Consumer, Producer, Queue};
use rowtone::camera::Timing;
use rowtone::pipeline::{Collector, Reading, Reporter};
use rowtone::report::Report;
use rowtone::timeline::Group;
use rowtone_board::memory::SpectrumMemory;
use rowtone_board::plan::spectrum_config;
use rowtone_pico2::handover::count;
use rowtone_pico2::plan::{DEFAULTS, ROWS};
use static_cell::StaticCell;

/// Readings on their way: core 1's interrupt takes them at once, unless it is sending or copying a window.
const WAITING: usize = 128;

static QUEUE: StaticCell<Queue<Reading, WAITING>> = StaticCell::new();
static PRODUCER: Mutex<M, RefCell<Option<Producer<'static, Reading>>>> =
    Mutex::new(RefCell::new(None));
static CONSUMER: Mutex<M, RefCell<Option<Consumer<'static, Reading>>>> =
    Mutex::new(RefCell::new(None));
static REPORTER: StaticCell<Reporter<'static>> = StaticCell::new();

/// There are readings in the queue.
pub(crate) static COME: Signal<M, ()> = Signal::new();
/// A computer that has nothing to do.
static IDLE: Channel<M, &'static mut Reporter<'static>, 1> = Channel::new();
/// One with a window to compute.
static LOADED: Channel<M, &'static mut Reporter<'static>, 1> = Channel::new();
/// What it found.
pub(crate) static REPORTS: Channel<M, Report, 2> = Channel::new();

/// The two halves, on the main stack: making a reporter moves its 8 KiB about.
///
/// They are made for some plan; the first one of core 0 sets them right before a sample comes.
#[inline(never)]
pub(crate) fn set_up(
    memory: &'static mut SpectrumMemory,
) -> (Collector<'static>, &'static mut Reporter<'static>) {
    let (producer, consumer) = QUEUE.init(Queue::new()).split();
    PRODUCER.lock(|p| p.replace(Some(producer)));
    CONSUMER.lock(|c| c.replace(Some(consumer)));
    let storage = memory.lend();
    let config = spectrum_config(&DEFAULTS);
    // Constants that fit, as a test of the plan shows for the defaults.
    let group = Timing::new(67_200_000, 0, ROWS)
        .ok()
        .and_then(|timing| Group::new(timing, 4).ok());
    let group = group.expect("a group of the default timing");
    // Not `expect`: it would bring in the printing of every error, reals and all, which is 12 KiB.
    let Ok(collector) = Collector::new(&config, group, storage.collected) else {
        panic!("no room to collect")
    };
    let Ok(reporter) = Reporter::new(config, group, storage.estimator) else {
        panic!("no room to compute")
    };
    (collector, REPORTER.init(reporter))
}

/// The queue's end on core 0; once.
pub(crate) fn readings() -> Option<Producer<'static, Reading>> {
    PRODUCER.lock(|p| p.take())
}

/// Collects readings, and hands complete windows over.
#[embassy_executor::task]
pub(crate) async fn collect(mut collector: Collector<'static>) {
    let Some(mut readings) = CONSUMER.lock(|c| c.take()) else {
        return;
    };
    let mut due = None;
    loop {
        match select(PLAN.wait(), COME.wait()).await {
            Either::First(plan) => {
                while readings.dequeue().is_some() {} // of the plan before
                match Collector::new(&plan.spectrum, plan.group, collector.into_storage()) {
                    Ok(anew) => collector = anew,
                    // The plan was checked against this memory.
                    Err(_) => panic!("no room to collect"),
                }
                due = Some(plan);
            }
            Either::Second(()) => {
                while let Some(reading) = readings.dequeue() {
                    if !collector.push(reading) {
                        continue;
                    }
                    let Ok(reporter) = IDLE.try_receive() else {
                        count(&DROPPED_WINDOWS);
                        continue;
                    };
                    if let Some(plan) = due.take() {
                        // It was checked with the collector.
                        let _ = reporter.restart(plan.spectrum, plan.group);
                    }
                    collector.hand_over(reporter);
                    let _ = LOADED.try_send(reporter); // there is but one
                }
            }
        }
    }
}

/// Computes one window after the other; some tenths of a second each.
#[embassy_executor::task]
pub(crate) async fn compute(mut reporter: &'static mut Reporter<'static>) {
    loop {
        let _ = IDLE.try_send(reporter);
        reporter = LOADED.receive().await;
        poll_fn(|context| REPORTS.poll_ready_to_send(context)).await;
        tell(reporter);
    }
}

/// Computes a window, for whose report there is room. Not inlined: reports are 1.8 KB, and the task would keep room for
/// its copies while it computes.
#[inline(never)]
fn tell(reporter: &mut Reporter<'_>) {
    // Nobody else sends reports.
    let _ = REPORTS.try_send(reporter.report());
}
