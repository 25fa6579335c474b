//! Measuring from one opening of the camera to its end.
//!
//! The calling thread takes lines; a second one computes spectra. Between them stands one window: where the
//! spectrum is still busy when the next window is complete, that window is dropped and counted. Reports go
//! into a bounded queue; where that is full they are dropped and counted. The line path waits for neither.

use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use rowtone::pipeline::{Collector, Reporter};
use rowtone::report::Report;
use rowtone::spectrum::FrameRatePlan;

use crate::alive::Alive;
use crate::capture::{CameraError, Source};
use crate::clock::{FrameClock, FrameCounts};
use crate::config::{Config, USUAL_HIGHEST_HZ};
use crate::journal::log;
use crate::lines::{Lines, LinesError};
use crate::memory::Memory;
use crate::notify::Notifier;
use crate::page;
use crate::setup::Setup;
use crate::shared::Shared;

/// Why a session ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Ended {
    /// The program is to end.
    Asked,
    /// Something else is to be measured.
    Changed,
    /// The camera failed.
    Camera(CameraError),
}

/// A window handed over.
struct Ready {
    /// Time of the program at which the session began, ms.
    offset_ms: u64,
}

/// Measures until the end.
///
/// # Errors
/// [`LinesError`] where the core refuses the setup.
pub fn run(
    source: &mut dyn Source,
    setup: &Setup,
    config: &Config,
    shared: &Shared,
    reports: &SyncSender<Report>,
    notifier: &Notifier,
) -> Result<(Ended, FrameCounts), LinesError> {
    let mut memory = Memory::new(setup);
    let (tracker, storage) = memory.lend();
    let reporter = Reporter::new(setup.spectrum, setup.group, storage.estimator);
    let reporter = Mutex::new(reporter.map_err(LinesError::Spectrum)?);
    let period_ns = source.facts().frame_period_ns;
    let clock = FrameClock::new(config.camera.replay, period_ns);
    let mut rates = FrameRates::new(setup, config, period_ns);
    let mut lines = Lines::new(setup, clock, tracker, storage.collected)?;
    if let Some(live) = &shared.live {
        page::describe(live, source.facts(), setup, config);
    }
    let (ready, windows) = sync_channel(1);
    let ended = std::thread::scope(|scope| {
        let reporter = &reporter;
        // Ends when `ready` is dropped.
        let spectrum = std::thread::Builder::new().name("spectrum".to_owned());
        let spawned = spectrum.spawn_scoped(scope, move || {
            compute(&windows, reporter, reports, shared, setup);
        });
        if let Err(e) = spawned {
            return Ended::Camera(CameraError::Refused(format!(
                "no thread for the spectrum: {e}"
            )));
        }
        let mut handover = Handover {
            reporter,
            ready,
            shared,
            offset_ms: None,
            last: false,
        };
        let ended = lines_until_end(
            source,
            &mut lines,
            &mut rates,
            &mut handover,
            config,
            notifier,
        );
        // The last window is worth waiting for.
        handover.last = true;
        lines.finish(&mut |collector| handover.give(collector));
        ended
    });
    Ok((ended, lines.clock().counts()))
}

fn lines_until_end(
    source: &mut dyn Source,
    lines: &mut Lines<'_>,
    rates: &mut FrameRates,
    handover: &mut Handover<'_, '_>,
    config: &Config,
    notifier: &Notifier,
) -> Ended {
    let shared = handover.shared;
    let changes = shared.changes.load(Ordering::Acquire);
    let silence = Duration::from_secs_f64(config.service.silence_s);
    // Short waits, so that a stop is noticed soon.
    let patience = silence.min(Duration::from_millis(200));
    let mut heard = Instant::now();
    let mut alive = Alive::new(notifier, &shared.pulses, shared.started);
    loop {
        if shared.is_stopping() {
            return Ended::Asked;
        }
        if shared.changes.load(Ordering::Acquire) != changes {
            return Ended::Changed;
        }
        let mut start_ns = None;
        let outcome = source.next(patience, &mut |frame| {
            start_ns = frame.start_ns;
            lines.frame(&frame, &mut |collector| handover.give(collector));
            if let Some(live) = &shared.live {
                lines.show(&frame, live);
            }
        });
        match outcome {
            Ok(()) => {
                heard = Instant::now();
                if let Some(period_ns) = rates.wanted(start_ns) {
                    source.set_frame_period(period_ns);
                    lines.clock().set_period(period_ns);
                }
            }
            Err(CameraError::Silent(_)) if heard.elapsed() < silence => {}
            Err(CameraError::Silent(_)) => {
                return Ended::Camera(CameraError::Silent(heard.elapsed()));
            }
            Err(error) => return Ended::Camera(error),
        }
        alive.tell();
    }
}

/// Asks for the frame rates of the core's plan, where it is to be followed.
#[derive(Debug)]
struct FrameRates {
    plan: Option<FrameRatePlan>,
    /// Start of the first frame, ns.
    began_ns: Option<i64>,
    /// As asked for last, Hz.
    fps: Option<f32>,
}

impl FrameRates {
    fn new(setup: &Setup, config: &Config, period_ns: Option<i64>) -> Self {
        let max_fps = period_ns.map_or(0.0, |ns| 1e9 / ns.max(1) as f32);
        let wanted = config.camera.two_frame_rates && config.camera.replay.is_none();
        let plan = wanted.then(|| {
            let window_s = setup.spectrum.window_ns as f32 * 1e-9;
            let highest_hz = setup.spectrum.max_hz.unwrap_or(USUAL_HIGHEST_HZ);
            FrameRatePlan::new(max_fps, window_s, highest_hz)
        });
        let plan = plan.and_then(|plan| {
            plan.inspect_err(|e| log(&format!("camera.two_frame_rates: {e}")))
                .ok()
        });
        Self {
            plan,
            began_ns: None,
            // A session before this one may have left the camera at the other rate.
            fps: None,
        }
    }

    /// Another frame period to ask for, ns, now that a frame began at this time.
    fn wanted(&mut self, start_ns: Option<i64>) -> Option<i64> {
        let (plan, start_ns) = (self.plan?, start_ns?);
        let began_ns = *self.began_ns.get_or_insert(start_ns);
        let fps = plan.fps(start_ns.saturating_sub(began_ns) as f32 * 1e-9);
        let before = self.fps.replace(fps);
        (before != Some(fps)).then(|| (1e9 / f64::from(fps)).round() as i64)
    }
}

/// The line side's end of the way to the spectrum.
struct Handover<'s, 'm> {
    reporter: &'s Mutex<Reporter<'m>>,
    ready: SyncSender<Ready>,
    shared: &'s Shared,
    offset_ms: Option<u64>,
    /// No more lines come: waiting is allowed.
    last: bool,
}

impl Handover<'_, '_> {
    fn give(&mut self, collector: &mut Collector<'_>) {
        let reporter = if self.last {
            self.reporter.lock().ok()
        } else {
            self.reporter.try_lock().ok()
        };
        let Some(mut reporter) = reporter else {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
            return;
        };
        let offset_ms = *self.offset_ms.get_or_insert_with(|| {
            // The first window is one window long already.
            self.shared.started.elapsed().as_millis() as u64
        });
        if collector.hand_over(&mut reporter) {
            drop(reporter);
            self.shared.pulses.spectrum.expect(self.shared.started);
            let ready = Ready { offset_ms };
            let sent = if self.last {
                self.ready.send(ready).is_ok()
            } else {
                self.ready.try_send(ready).is_ok()
            };
            if !sent {
                self.shared.dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}

/// The spectrum thread.
fn compute(
    windows: &Receiver<Ready>,
    reporter: &Mutex<Reporter<'_>>,
    reports: &SyncSender<Report>,
    shared: &Shared,
    setup: &Setup,
) {
    let mut first_ms = None;
    for ready in windows {
        shared.pulses.spectrum.beat(shared.started);
        let (mut report, shapes) = match reporter.lock() {
            Ok(mut reporter) => {
                let report = reporter.report();
                let shown = shared.live.is_some();
                (report, shown.then(|| reporter.shapes().to_vec()))
            }
            Err(_) => break,
        };
        shared.pulses.spectrum.rest();
        // The core counts from the session's first frame, a board from its own start.
        let first = *first_ms.get_or_insert(report.time_ms);
        report.time_ms = ready.offset_ms + report.time_ms.saturating_sub(first);
        if let Some(trend) = &shared.trend {
            trend.push(&report);
        }
        let said = shared.on_alarms(|desk| desk.window(&report));
        if let (Some(live), Some(shapes)) = (&shared.live, shapes) {
            page::report(
                live,
                report.clone(),
                &shapes,
                said.as_ref(),
                (setup, shared),
            );
        }
        if reports.try_send(report).is_err() {
            shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
    shared.pulses.spectrum.rest();
}
