//! What a line costs in this program beyond what it costs in the core.
//!
//! `cargo run --release -p rowtone-rpi --example cost [FORMAT]`
//!
//! The same frames go through tracker, binner and collector directly, their rows lying ready as the core wants
//! them, and through this program's line path (frame clock, rows cut out of the frame, unpacking, light meter).
//! `cost FORMAT core ROUNDS [COLUMNS]` and `cost FORMAT program …` run one of the two, so many rounds of few frames: for a
//! counter of instructions, which compares two numbers of rounds (`boards/rpi/ci/instructions.sh`).
//!
//! Times are the thread's own processor time, the shortest of many rounds: other programs do not count.

use std::time::Duration;

use rowtone::camera::RawFormat;
use rowtone::camera::{Line, Pixels};
use rowtone::pipeline::{Collector, LineSide};
use rowtone_rpi::capture::simulated::{Scene, Simulated};
use rowtone_rpi::capture::{Frame, Shape, Source};
use rowtone_rpi::clock::FrameClock;
use rowtone_rpi::config::Config;
use rowtone_rpi::lines::Lines;
use rowtone_rpi::memory::Memory;
use rowtone_rpi::setup::Setup;

/// Frames that go round: so few that they stay in the processor's cache, and so many that they do not, as a camera's
/// come.
const FRAMES: [usize; 2] = [2, 60];
/// Frames of all rounds together.
const WORK: usize = 3000;

/// A frame's pixels as their upper eight bits.
fn pack(format: RawFormat, pixels: &[u8]) -> Vec<u8> {
    match format {
        RawFormat::Packed10 => pixels
            .chunks_exact(4)
            .flat_map(|g| [g[0], g[1], g[2], g[3], 0b01_10_11_00])
            .collect(),
        RawFormat::Packed12 => pixels
            .chunks_exact(2)
            .flat_map(|g| [g[0], g[1], 0x5a])
            .collect(),
        RawFormat::Raw16 => pixels.iter().flat_map(|&p| [0x5a, p]).collect(),
        _ => pixels.to_vec(),
    }
}

/// Processor time of this thread.
fn processor_time() -> Duration {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the call writes one timespec, which lives until its end.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

struct Best(Duration);

impl Best {
    fn of(rounds: usize, mut round: impl FnMut()) -> Self {
        let mut best = Duration::MAX;
        for _ in 0..rounds {
            let began = processor_time();
            round();
            best = best.min(processor_time() - began);
        }
        Self(best)
    }

    fn ns_a_line(&self, frames: usize, rows: u16) -> f64 {
        self.0.as_nanos() as f64 / (frames * usize::from(rows)) as f64
    }
}

fn main() {
    let mut words = std::env::args().skip(1);
    let wanted = words.next().unwrap_or_default(); // all of them
    let counted_part = words.next().unwrap_or_default();
    let counted: Option<usize> = words.next().and_then(|rounds| rounds.parse().ok());
    let columns = words.next().and_then(|columns| columns.parse().ok());
    // Emulators take their time.
    let learn = match counted {
        Some(_) => "[camera]\nlearn_frames = 4\n",
        None => "[camera]\n",
    };
    let scene = Scene {
        width: columns.unwrap_or(640),
        height: 480,
        line_time_s: 20e-6,
        paced: false,
        ..Scene::default()
    };
    let config = |more: &str| {
        let text = format!("{learn}{more}");
        Config::parse(&text, "these").expect("a good configuration")
    };
    let (eight, all) = (config(""), config("full_depth = true"));
    let mut source = Simulated::new(scene.clone());
    let mut facts = source.facts().clone();
    let mut pictures = Vec::new();
    let drawn = FRAMES[usize::from(counted.is_none())];
    for _ in 0..drawn {
        let lent = source.next(Duration::ZERO, &mut |frame| {
            pictures.push((frame.start_ns.unwrap_or(0), frame.bytes.to_vec()));
        });
        lent.expect("the simulation does not end");
    }
    println!("{}x{}, the shortest round:", scene.width, scene.height);
    for (name, format, config) in [
        ("8 bit", RawFormat::Raw8, &eight),
        ("10 bit packed, upper 8", RawFormat::Packed10, &eight),
        ("12 bit packed, upper 8", RawFormat::Packed12, &eight),
        ("16 bit, upper 8", RawFormat::Raw16, &eight),
        ("10 bit packed, all 10", RawFormat::Packed10, &all),
    ] {
        if !name.contains(&wanted) {
            continue;
        }
        facts.shape = Shape {
            stride: format.bytes(scene.width.into()),
            format,
            ..facts.shape
        };
        let setup = Setup::new(&facts, config, &config.settings).expect("a good setup");
        let frames: Vec<_> = pictures
            .iter()
            .map(|(start, pixels)| (*start, pack(format, pixels)))
            .collect();
        let rows = setup.part.height;
        for (count, place) in FRAMES.into_iter().zip(["cache", "memory"]) {
            let frames = &frames[..count];
            if let Some(rounds) = &counted {
                match counted_part.as_str() {
                    "core" => drop(core_alone(&setup, frames, *rounds)),
                    _ => drop(whole_path(&setup, frames, *rounds)),
                }
                return;
            }
            let rounds = WORK / count;
            let core = core_alone(&setup, frames, rounds).ns_a_line(count, rows);
            let ours = whole_path(&setup, frames, rounds).ns_a_line(count, rows);
            println!(
                "{name:22} from {place:6} core {core:.0} ns a line, with this program's part {ours:.0} ns: {:+.0} %",
                100.0 * (ours / core - 1.0)
            );
        }
    }
}

fn core_alone(setup: &Setup, frames: &[(i64, Vec<u8>)], rounds: usize) -> Best {
    let shape = setup.shape;
    let width = usize::from(shape.width);
    // As the core is given them in the end.
    let (mut ready8, mut ready16) = (Vec::new(), Vec::new());
    let (mut words, mut upper) = (vec![0; width], vec![0; width]);
    for (_, bytes) in frames {
        for line in bytes.chunks_exact(shape.stride) {
            let pixels = if setup.tracker.bits == 8 {
                shape.format.upper_line(line, width, &mut upper)
            } else {
                shape.format.line(line, width, &mut words)
            };
            let values = pixels.expect("a whole line").values();
            match setup.tracker.bits {
                8 => ready8.extend(values.map(|v| v as u8)),
                _ => ready16.extend(values),
            }
        }
    }
    let rows = usize::from(setup.part.height);
    let mut memory = Memory::new(setup);
    let ((picture, _), storage) = memory.lend();
    let mut lines = LineSide::new(setup.tracker, setup.group, picture).expect("good");
    let mut collector =
        Collector::new(&setup.spectrum, setup.group, storage.collected).expect("good");
    let timing = setup.group.timing();
    let mut number = 0;
    let period = frames[1].0 - frames[0].0;
    Best::of(rounds, || {
        for frame in 0..frames.len() {
            let start_ns = i64::from(number) * period;
            for row in 0..setup.part.height {
                let at = (frame * rows + usize::from(row)) * width;
                let pixels = if ready16.is_empty() {
                    Pixels::U8(&ready8[at..][..width])
                } else {
                    Pixels::U16(&ready16[at..][..width])
                };
                let line = Line {
                    frame: number,
                    row,
                    start_ns: start_ns + timing.start_ns(row),
                    pixels,
                };
                if let Some(&reading) = lines.push(&line) {
                    collector.push(reading);
                }
            }
            number += 1;
        }
    })
}

fn whole_path(setup: &Setup, frames: &[(i64, Vec<u8>)], rounds: usize) -> Best {
    let mut memory = Memory::new(setup);
    let (tracker, storage) = memory.lend();
    let period = frames[1].0 - frames[0].0;
    let clock = FrameClock::new(None, Some(period));
    let mut lines = Lines::new(setup, clock, tracker, storage.collected).expect("good");
    let mut sequence = 0;
    Best::of(rounds, || {
        for (_, bytes) in frames {
            let frame = Frame {
                sequence,
                start_ns: Some(i64::from(sequence) * period),
                bytes,
                intact: true,
            };
            lines.frame(&frame, &mut |_| {});
            sequence += 1;
        }
    })
}
