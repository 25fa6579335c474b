//! What a line costs in this program beyond what it costs in the core.
//!
//! `cargo run --release -p rowtone-rpi --example cost`
//!
//! The same frames go through tracker, binner and collector directly, their rows lying ready as the core wants
//! them, and through this program's line path (frame clock, rows cut out of the frame, unpacking, light meter).

use std::time::{Duration, Instant};

use rowtone::analyzer::Collector;
use rowtone::camera::{Line, Pixels};
use rowtone::raw::RawFormat;
use rowtone::timeline::Binner;
use rowtone::tracker::{Outcome, Tracker};
use rowtone_rpi::capture::simulated::{Scene, Simulated};
use rowtone_rpi::capture::{Frame, Shape, Source};
use rowtone_rpi::clock::FrameClock;
use rowtone_rpi::config::Config;
use rowtone_rpi::lines::Lines;
use rowtone_rpi::memory::{SpectrumMemory, TrackerMemory};
use rowtone_rpi::setup::Setup;

const FRAMES: usize = 60;
const ROUNDS: usize = 40;

/// A frame as 10-bit pixels, packed.
fn pack10(pixels: &[u8]) -> Vec<u8> {
    let groups = pixels.chunks_exact(4);
    groups
        .flat_map(|g| [g[0], g[1], g[2], g[3], 0b01_10_11_00])
        .collect()
}

struct Best(Duration);

impl Best {
    fn of(mut round: impl FnMut()) -> Self {
        let mut best = Duration::MAX;
        for _ in 0..ROUNDS {
            let began = Instant::now();
            round();
            best = best.min(began.elapsed());
        }
        Self(best)
    }

    fn ns_a_line(&self, rows: u16) -> f64 {
        self.0.as_nanos() as f64 / (FRAMES * usize::from(rows)) as f64
    }
}

fn main() {
    let scene = Scene {
        width: 640,
        height: 480,
        line_time_s: 20e-6,
        paced: false,
        ..Scene::default()
    };
    let config = Config::defaults();
    let mut source = Simulated::new(scene.clone());
    let mut facts = source.facts().clone();
    let mut pictures = Vec::new();
    for _ in 0..FRAMES {
        let lent = source.next(Duration::ZERO, &mut |frame| {
            pictures.push((frame.start_ns.unwrap_or(0), frame.bytes.to_vec()));
        });
        lent.expect("the simulation does not end");
    }
    println!("{}x{}, best of {ROUNDS}:", scene.width, scene.height);
    for (name, format) in [
        ("8 bit", RawFormat::Raw8),
        ("10 bit, packed", RawFormat::Packed10),
    ] {
        facts.shape = Shape {
            stride: format.bytes(scene.width.into()),
            format,
            ..facts.shape
        };
        let setup = Setup::new(&facts, &config, &config.settings).expect("a good setup");
        let frames: Vec<_> = pictures
            .iter()
            .map(|(start, p)| {
                (
                    *start,
                    if format == RawFormat::Raw8 {
                        p.clone()
                    } else {
                        pack10(p)
                    },
                )
            })
            .collect();
        let core = core_alone(&setup, &frames);
        let ours = whole_path(&setup, &frames);
        let rows = setup.part.height;
        let (core, ours) = (core.ns_a_line(rows), ours.ns_a_line(rows));
        println!(
            "{name:15} core {core:.0} ns a line, with this program's part {ours:.0} ns: {:+.0} %",
            100.0 * (ours / core - 1.0)
        );
    }
}

fn core_alone(setup: &Setup, frames: &[(i64, Vec<u8>)]) -> Best {
    let shape = setup.shape;
    let width = usize::from(shape.width);
    let ready: Vec<Vec<u16>> = frames
        .iter()
        .map(|(_, bytes)| {
            let mut words = vec![0; width];
            bytes
                .chunks_exact(shape.stride)
                .flat_map(|line| match shape.format.line(line, width, &mut words) {
                    Ok(Pixels::U16(p)) => p.to_vec(),
                    _ => Vec::new(),
                })
                .collect()
        })
        .collect();
    let mut tracker_memory = TrackerMemory::new(setup.part.width, setup.part.height);
    let mut spectrum_memory = SpectrumMemory::new(setup.group, setup.window_frames);
    let mut tracker = Tracker::new(setup.tracker, tracker_memory.lend()).expect("good");
    let mut binner = Binner::new(setup.group);
    let collected = spectrum_memory.lend().collected;
    let mut collector = Collector::new(&setup.spectrum, setup.group, collected).expect("good");
    let timing = setup.group.timing();
    let mut number = 0;
    let period = frames[1].0 - frames[0].0;
    Best::of(|| {
        for ((_, bytes), words) in frames.iter().zip(&ready) {
            let start_ns = i64::from(number) * period;
            for row in 0..setup.part.height {
                let at = usize::from(row);
                let pixels = if words.is_empty() {
                    Pixels::U8(&bytes[at * shape.stride..][..width])
                } else {
                    Pixels::U16(&words[at * width..][..width])
                };
                let line = Line {
                    frame: number,
                    row,
                    start_ns: start_ns + timing.start_ns(row),
                    pixels,
                };
                if let Outcome::Measured(d) = tracker.push(&line)
                    && let Some(sample) = binner.push(d)
                {
                    collector.push(sample);
                }
            }
            number += 1;
        }
    })
}

fn whole_path(setup: &Setup, frames: &[(i64, Vec<u8>)]) -> Best {
    let mut tracker_memory = TrackerMemory::new(setup.part.width, setup.part.height);
    let mut spectrum_memory = SpectrumMemory::new(setup.group, setup.window_frames);
    let period = frames[1].0 - frames[0].0;
    let clock = FrameClock::new(None, Some(period));
    let collected = spectrum_memory.lend().collected;
    let mut lines = Lines::new(setup, clock, tracker_memory.lend(), collected).expect("good");
    let mut sequence = 0;
    Best::of(|| {
        for (_, bytes) in frames {
            let frame = Frame {
                sequence,
                start_ns: Some(i64::from(sequence) * period),
                bytes,
                intact: true,
            };
            lines.frame(&frame, &mut |_, _| {});
            sequence += 1;
        }
    })
}
