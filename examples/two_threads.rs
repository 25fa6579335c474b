//! The line side on one thread, the spectrum on another: lines never wait for a window that is being
//! computed. On a microcontroller with two cores it is the same with a queue between the cores.
//!
//! ```text
//! cargo run --release --example two_threads
//! ```

use std::f32::consts::TAU;
use std::sync::mpsc::sync_channel;
use std::sync::{Mutex, PoisonError};
use std::thread;

use rowtone::camera::{Line, Pixels, Timing};
use rowtone::pipeline::{Collector, LineSide, Reporter};
use rowtone::report::Report;
use rowtone::timeline::Group;
use rowtone::{spectrum, tracker};

const WIDTH: usize = 64;
const ROWS: usize = 48;
const FRAME_NS: i64 = 16_666_667;
/// The machine swings at this frequency, Hz.
pub(crate) const SWING_HZ: f32 = 31.3;

fn pixels(start_ns: i64) -> [u8; WIDTH] {
    let moved_px = 0.2 * (TAU * SWING_HZ * start_ns as f32 * 1e-9).sin();
    std::array::from_fn(|x| {
        let x = x as f32 - moved_px;
        (128.0 + 60.0 * (0.6 * x).sin() + 30.0 * (1.02 * x).cos()).round() as u8
    })
}

/// The reports of five seconds, and how many windows were dropped because the one before was still
/// being computed.
pub(crate) fn reports() -> Result<(Vec<Report>, u32), Box<dyn std::error::Error>> {
    let timing = Timing::new(300_000_000, 0, ROWS as u16)?;
    let group = Group::new(timing, 2)?;
    let config = spectrum::Config::default();
    let mut picture = Box::new(tracker::StaticStorage::<{ WIDTH * ROWS }, ROWS, WIDTH>::new());
    let mut windows = Box::new(spectrum::StaticStorage::<2048, 80, 24, 4096, 9>::new());
    let windows = windows.lend();
    let mut lines = LineSide::new(
        tracker::Config::new(timing, WIDTH as u16),
        group,
        picture.lend(),
    )?;
    let mut collector = Collector::new(&config, group, windows.collected)?;
    let reporter = Mutex::new(Reporter::new(config, group, windows.estimator)?);
    let (ready, handed_over) = sync_channel(1);
    let mut dropped = 0;
    let reports = thread::scope(|scope| {
        let computing = scope.spawn(|| {
            let report = |()| {
                reporter
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .report()
            };
            handed_over.into_iter().map(report).collect()
        });
        for frame in 0..300 {
            for row in 0..ROWS as u16 {
                let start_ns = i64::from(frame) * FRAME_NS + timing.start_ns(row);
                let pixels = pixels(start_ns);
                let line = Line {
                    frame,
                    row,
                    start_ns,
                    pixels: Pixels::U8(&pixels),
                };
                let Some(&reading) = lines.push(&line) else {
                    continue;
                };
                if !collector.push(reading) {
                    continue;
                }
                // A window is complete. Where the other thread is still busy it is dropped, and said.
                let handed = match reporter.try_lock() {
                    Ok(mut reporter) => collector.hand_over(&mut reporter),
                    Err(_) => false,
                };
                dropped += u32::from(!(handed && ready.try_send(()).is_ok()));
            }
        }
        drop(ready);
        computing.join()
    });
    Ok((
        reports.map_err(|_| "the spectrum's thread panicked")?,
        dropped,
    ))
}

#[allow(dead_code, reason = "the test runs `reports`")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (reports, dropped) = reports()?;
    for report in &reports {
        let strongest = report.peaks.first();
        println!(
            "{} ms: {:?} Hz",
            report.time_ms,
            strongest.map(|peak| peak.hz)
        );
    }
    println!("{} reports, {dropped} windows dropped", reports.len());
    Ok(())
}
