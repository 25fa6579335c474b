//! Days without an end: does anything drift, grow or wrap?
//!
//! Samples of a camera of 50 000 lines a second are fed to one reports for simulated days. The frame number wraps
//! half-way; the camera's clock has run for thirty years already. One tone, noise and creep; a window of 1 s every 5 s.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::report::Report;
use rowtone::spectrum::Config;
use rowtone::timeline::{Group, Sample};

use rowtone_memory::SpectrumMemory;

/// The tone, Hz: no whole number of turns in any round time.
pub const HZ: f64 = 437.012_345;
const AMPLITUDE_PX: f64 = 0.1;
const NOISE_PX: f64 = 0.004;
const FPS: i64 = 100;
const DAY_S: i64 = 86_400;
/// Thirty years.
const CLOCK_NS: i64 = 946_080_000_000_000_000;
/// Normal numbers to take from, a frame's from a random place on.
const NORMALS: usize = 1 << 16;

/// What a day came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Day {
    /// Windows reported.
    pub windows: u32,
    /// Windows that did not have the tone, and peaks that are no tone.
    pub missed: u32,
    /// See [`Day::missed`].
    pub false_peaks: u32,
    /// Mean error of the frequency, Hz.
    pub mean_hz: f64,
    /// Standard deviation of the error, Hz.
    pub sd_hz: f64,
    /// Mean error of the amplitude, as a share.
    pub amplitude: f64,
    /// Largest error of a report's time, ms.
    pub late_ms: u64,
    /// Resident memory of this process at the day's end, KiB, where the system tells.
    pub resident_kib: Option<u64>,
}

/// Feeds `days` days and hands each on as it ends.
///
/// # Panics
/// Never: the camera is a possible one and the memory fits it.
pub fn run(days: u32, seed: u64, mut on: impl FnMut(&Day)) {
    let timing = Timing::new(20_000_000, 0, 480).expect("has rows");
    let group = Group::new(timing, 24).expect("fewer than it has");
    let mut memory = SpectrumMemory::new(group, 1.0, FPS as f64);
    let config = Config {
        hop_ns: 5_000_000_000,
        ..Config::default()
    };
    let mut reports = ReportSide::new(config, group, memory.lend()).expect("the memory fits");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let normals: Vec<f32> = (0..NORMALS)
        .map(|_| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            (NOISE_PX * normal) as f32
        })
        .collect();
    let slots = usize::from(group.slots());
    let turned = |ns: i64| (TAU * HZ * ns as f64 * 1e-9).sin_cos();
    let phasors: Vec<(f64, f64)> = (0..slots as u16)
        .map(|s| turned(group.middle_ns(s)))
        .collect();
    let frames = i64::from(days) * DAY_S * FPS;
    let first = u32::MAX.wrapping_sub((frames / 2) as u32);
    let mut tally = Tally::default();
    for n in 0..frames {
        let late_ns = n * (1_000_000_000 / FPS);
        // Whole turns go before the sine, so that the truth is exact to the last day.
        let turns = HZ * late_ns as f64 * 1e-9;
        let (sin, cos) = (TAU * turns.fract()).sin_cos();
        let creep = 1e-7 * late_ns as f64 * 1e-9;
        let from = rng.next_u32() as usize % (NORMALS - slots);
        for (slot, (&(s, c), &noise)) in phasors.iter().zip(&normals[from..]).enumerate() {
            let moved = AMPLITUDE_PX * (cos * c - sin * s) + creep;
            let ready = reports.push(Sample {
                curvature: Default::default(),
                frame: first.wrapping_add(n as u32),
                slot: slot as u16,
                time_ns: CLOCK_NS + late_ns + group.middle_ns(slot as u16),
                shift_px: moved as f32 + noise,
                information_per_px2: (1.0 / (NOISE_PX * NOISE_PX)) as f32,
                spread: Default::default(),
                vertical: None,
            });
            if ready && let Some(report) = reports.report() {
                tally.add(&report, late_ns / 1_000_000);
            }
        }
        if (n + 1) % (DAY_S * FPS) == 0 {
            if n + 1 == frames
                && let Some(report) = reports.finish()
            {
                tally.add(&report, (late_ns + 1_000_000_000 / FPS) / 1_000_000);
            }
            on(&tally.day());
            tally = Tally::default();
        }
    }
}

#[derive(Default)]
struct Tally {
    day: Day,
    hz: f64,
    hz2: f64,
    amplitude: f64,
}

impl Tally {
    fn add(&mut self, report: &Report, now_ms: i64) {
        self.day.windows += 1;
        self.day.late_ms = self.day.late_ms.max(report.time_ms.abs_diff(now_ms as u64));
        let error = |hz: f32| f64::from(hz) - HZ;
        let tone = report.peaks.iter().find(|p| error(p.hz).abs() < 0.5);
        self.day.missed += u32::from(tone.is_none());
        self.day.false_peaks += (report.peaks.len() - usize::from(tone.is_some())) as u32;
        if let Some(peak) = tone {
            self.hz += error(peak.hz);
            self.hz2 += error(peak.hz).powi(2);
            self.amplitude += f64::from(peak.amplitude_px) / AMPLITUDE_PX - 1.0;
        }
    }

    fn day(&self) -> Day {
        let n = f64::from(self.day.windows - self.day.missed).max(1.0);
        let mean_hz = self.hz / n;
        Day {
            mean_hz,
            sd_hz: (self.hz2 / n - mean_hz * mean_hz).max(0.0).sqrt(),
            amplitude: self.amplitude / n,
            resident_kib: resident_kib(),
            ..self.day
        }
    }
}

/// What Linux says.
fn resident_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// The head of the table.
pub fn head() -> String {
    format!(
        "{:>4} {:>8} {:>7} {:>6} {:>12} {:>10} {:>10} {:>8} {:>9}",
        "day", "windows", "missed", "false", "mean Hz", "sd Hz", "ampl. %", "late ms", "RSS KiB"
    )
}

/// A row of the table.
pub fn line(number: u32, day: &Day) -> String {
    let resident = day
        .resident_kib
        .map_or("-".to_owned(), |kib| kib.to_string());
    format!(
        "{number:>4} {:>8} {:>7} {:>6} {:>12.7} {:>10.6} {:>10.4} {:>8} {resident:>9}",
        day.windows,
        day.missed,
        day.false_peaks,
        day.mean_hz,
        day.sd_hz,
        100.0 * day.amplitude,
        day.late_ms
    )
}
