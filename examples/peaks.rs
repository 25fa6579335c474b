//! Lines in, peaks out: a made-up camera looks at a machine that swings.
//!
//! ```text
//! cargo run --release --example peaks
//! ```

use std::f32::consts::TAU;

use rowtone::camera::{Line, Pixels, Timing};
use rowtone::pipeline::Pipeline;
use rowtone::report::Report;
use rowtone::timeline::Group;
use rowtone::{spectrum, tracker};

/// The camera: 64 x 48 pixels, 60 frames a second, 300 µs from row to row.
const WIDTH: usize = 64;
const ROWS: usize = 48;
const FRAME_NS: i64 = 16_666_667;
const LINE_TIME_PS: u32 = 300_000_000;

/// The machine: two tones, Hz and px.
pub(crate) const TONES: [(f32, f32); 2] = [(24.7, 0.3), (187.4, 0.04)];

/// A row of pixels, read at this time.
fn pixels(row: u16, start_ns: i64) -> [u8; WIDTH] {
    let time_s = start_ns as f32 * 1e-9;
    let swing = |(hz, px): (f32, f32)| px * (TAU * hz * time_s).sin();
    let moved_px: f32 = TONES.into_iter().map(swing).sum();
    std::array::from_fn(|x| {
        let x = x as f32 - moved_px + 0.31 * f32::from(row);
        (128.0 + 60.0 * (0.6 * x).sin() + 30.0 * (1.02 * x).cos()).round() as u8
    })
}

/// The report of every window of three seconds.
pub(crate) fn reports() -> Result<Vec<Report>, Box<dyn std::error::Error>> {
    let timing = Timing::new(LINE_TIME_PS, 0, ROWS as u16)?;
    let group = Group::new(timing, 2)?; // two rows make a sample
    // The caller decides where memory lives: a static on a microcontroller, a heap on a desktop.
    let mut picture = Box::new(tracker::StaticStorage::<{ WIDTH * ROWS }, ROWS, WIDTH>::new());
    let mut windows = Box::new(spectrum::StaticStorage::<2048, 80, 24, 4096, 9>::new());
    let lines = tracker::Config::new(timing, WIDTH as u16);
    let config = spectrum::Config::default(); // windows of a second, twice a second
    let mut pipeline = Pipeline::new(lines, group, config, picture.lend(), windows.lend())?;
    let mut reports = Vec::new();
    for frame in 0..180 {
        for row in 0..ROWS as u16 {
            let start_ns = i64::from(frame) * FRAME_NS + timing.start_ns(row);
            let pixels = pixels(row, start_ns);
            reports.extend(pipeline.push(&Line {
                frame,
                row,
                start_ns,
                pixels: Pixels::U8(&pixels),
            }));
        }
    }
    reports.extend(pipeline.finish().into_iter().flatten());
    Ok(reports)
}

#[allow(dead_code, reason = "the test runs `reports`")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    for report in reports()? {
        for peak in &report.peaks {
            println!(
                "{:8.3} Hz ± {:.3}  {:.4} px ± {:.4}",
                peak.hz, peak.hz_sd, peak.amplitude_px, peak.amplitude_px_sd
            );
        }
        println!();
    }
    Ok(())
}
