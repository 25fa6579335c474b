//! The core never allocates: a counting global allocator watches the whole chain, from lines to bytes and
//! from bytes to settings, in buffers that were lent once.
//!
//! One test function only: the count is of one thread, but a second test would share the program.
#![allow(unsafe_code)]

mod wire_common;

use rowtone::camera::{Line, Pixels, Timing};
use rowtone::kernel::Kernel;
use rowtone::link::Link;
use rowtone::link::settings::store::Nowhere;
use rowtone::pipeline::{Collector, Pipeline, Reporter};
use rowtone::report::Report;
use rowtone::shape::{Grid, SumsStorage, Texture, TextureStorage, TileSums, TileTexture, ToneSums};
use rowtone::spectrum;
use rowtone::timeline::Group;
use rowtone::tracker::{self, Config, Outcome};
use rowtone::wire::Format;
use rowtone::wire::{Message, binary, text};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::f32::consts::TAU;
use wire_common::console::link;
use wire_common::ordinary_report;

thread_local! {
    /// Calls of the allocator on this thread: the test program's other threads do not count.
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

fn count() {
    // While a thread ends there is nothing left to count in.
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

// SAFETY: every call is handed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are handed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        count();
        // SAFETY: the caller's promises are handed on.
        unsafe { System.dealloc(memory, layout) }
    }
    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are handed on.
        unsafe { System.realloc(memory, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Calls of the allocator, and what `work` gives.
fn calls_of<T>(work: impl FnOnce() -> T) -> (u64, T) {
    let before = CALLS.get();
    let result = work();
    (CALLS.get() - before, result)
}

const WIDTH: usize = 64;
const ROWS: usize = 16;
const FRAMES: u32 = 330;
const FPS: i64 = 50;

/// A picture of waves, moved by `shift_px`; another scene has other waves.
fn paint(line: &mut [u8; WIDTH], row: usize, shift_px: f32, scene: u32) {
    let (a, b) = match scene {
        0 => (0.061, 0.107),
        _ => (0.083, 0.043),
    };
    for (x, p) in line.iter_mut().enumerate() {
        let x = x as f32 - shift_px + 1.7 * row as f32;
        *p = (120.0 + 60.0 * (TAU * a * x).sin() + 30.0 * (TAU * b * x + 1.0).cos()) as u8;
    }
}

/// The camera's side: a vibration, a jump to be searched for, a hand, and at last another scene, which
/// is learned anew.
fn line_of(frame: u32, row: usize, line: &mut [u8; WIDTH]) -> i64 {
    let start_ns = i64::from(frame) * (1_000_000_000 / FPS) + row as i64 * 1_000_000;
    let tone = 0.3 * (TAU * 23.0 * start_ns as f32 * 1e-9).sin();
    let jump = if (60..90).contains(&frame) { 7.0 } else { 0.0 };
    let scene = u32::from(frame >= 200);
    paint(line, row, tone + jump, scene);
    if (100..104).contains(&frame) {
        line.fill(200);
    }
    start_ns
}

#[test]
fn nothing_is_allocated_from_lines_to_bytes() {
    // What the allocator counts at all.
    assert!(calls_of(|| drop(vec![1u8; 10])).0 >= 2);

    assert_eq!(shapes_of_tiles(), (0, 40 * ROWS as u32));

    let mut picture = tracker::StaticStorage::<{ WIDTH * ROWS }, ROWS, WIDTH>::new();
    let mut spectrum = spectrum::StaticStorage::<2048, 64, 16, 1024, 5>::new();
    let mut halves = spectrum::StaticStorage::<2048, 64, 16, 1024, 5>::new();
    let mut slots = [const { None::<Report> }; 4];
    let mut pixels = [0u8; WIDTH];
    let mut deep = [0u16; WIDTH];
    let timing = Timing::new(1_000_000_000, 100_000, ROWS as u16).unwrap();

    for kernel in Kernel::all() {
        let (calls, (counts, reports, bytes)) = calls_of(|| {
            let config = Config {
                learn_frames: 10,
                columns_per_line: 7,
                kernel,
                ..Config::new(timing, WIDTH as u16)
            };
            let group = Group::new(timing, 1).unwrap();
            let (lines, config) = (config, spectrum::Config::default());
            let mut whole =
                Pipeline::new(lines, group, config, picture.lend(), spectrum.lend()).unwrap();
            let storage = halves.lend();
            let mut collector = Collector::new(&config, group, storage.collected).unwrap();
            let mut reporter = Reporter::new(config, group, storage.estimator).unwrap();
            let mut link = link(&mut slots, Format::Text);
            let (mut reports, mut bytes) = (0, 0);
            for frame in 0..FRAMES {
                for row in 0..ROWS {
                    let start_ns = line_of(frame, row, &mut pixels);
                    // Deep pixels once in a while: the other kernel.
                    let pixels = if frame % 16 == 3 {
                        deep.iter_mut()
                            .zip(&pixels)
                            .for_each(|(d, &p)| *d = p.into());
                        Pixels::U16(&deep)
                    } else {
                        Pixels::U8(&pixels)
                    };
                    let line = Line {
                        frame,
                        row: row as u16,
                        start_ns,
                        pixels,
                    };
                    // Row by row, and in one go.
                    let reading = if frame % 2 == 0 {
                        let Outcome::Measured(displacement) = whole.lines.push_row(&line) else {
                            continue;
                        };
                        whole.lines.bin(displacement)
                    } else {
                        whole.lines.push(&line).copied()
                    };
                    let Some(reading) = reading else {
                        continue;
                    };
                    if collector.push(reading) && collector.hand_over(&mut reporter) {
                        let _ = reporter.report();
                    }
                    if whole.reports.push(reading)
                        && let Some(report) = whole.reports.report()
                    {
                        reports += 1;
                        bytes += there_and_back(&report);
                        link.push(report);
                        bytes += drain(&mut link);
                    }
                }
            }
            for report in whole.finish().into_iter().flatten() {
                reports += 1;
                bytes += there_and_back(&report);
            }
            (whole.lines.counts(), reports, bytes)
        });
        assert_eq!(calls, 0, "{kernel:?}");
        // The chain did go through all of its states.
        assert!(counts.learning > 0 && counts.measured > 1000, "{counts:?}");
        assert!(counts.occluded > 0, "{counts:?}");
        assert!(counts.relearned >= 1, "{counts:?}");
        assert!(reports >= 3 && bytes > 100, "{reports} {bytes}");
    }

    for wire in [Format::Text, Format::Binary, Format::Modbus] {
        let (calls, said) = calls_of(|| {
            let mut link = link(&mut slots, wire);
            link.announce(0);
            let mut said = drain(&mut link);
            for seq in 0..6 {
                link.push(ordinary_report(seq));
            }
            for line in [
                "get\n",
                "set window 0.5 hop 0.25\n",
                "set window nonsense\n",
                "status\n",
                "resend 3 5\n",
                "save\n",
                "defaults\n",
                "help\n",
            ] {
                for &byte in line.as_bytes() {
                    link.receive(byte, 1000, &mut Nowhere);
                }
                said += drain(&mut link);
            }
            // A Modbus master reads an input register: unit 1, function 4.
            let request = [1, 4, 0, 0, 0, 1, 0x31, 0xca];
            for byte in request {
                link.receive(byte, 2000, &mut Nowhere);
            }
            said + drain(&mut link)
        });
        assert_eq!(calls, 0, "{wire:?}");
        assert!(said > 0, "{wire:?} said nothing");
    }
}

/// Sends all that the board has to say; the number of bytes.
fn drain(link: &mut Link<'_>) -> usize {
    let mut said = 0;
    loop {
        let bytes = link.poll(1_000_000, &mut Nowhere).len();
        if bytes == 0 {
            return said;
        }
        link.sent(bytes);
        said += bytes;
    }
}

/// A report as text and as binary, and decoded again; the number of bytes.
fn there_and_back(report: &Report) -> usize {
    let message = Message::Report {
        session: 1,
        report: report.clone(),
    };
    let mut line = [0; text::MAX_LINE];
    let line = text::encode_to_slice(&message, &mut line).unwrap();
    let mut decoder = text::Decoder::<{ text::MAX_LINE }>::new();
    let heard = line.iter().filter_map(|&b| decoder.push(b)).count();
    let mut frame = [0; binary::MAX_FRAME];
    let frame = binary::encode_to_slice(&message, &mut frame).unwrap();
    let mut decoder = binary::Decoder::<{ binary::MAX_FRAME }>::new();
    let heard = heard + frame.iter().filter_map(|&b| decoder.push(b)).count();
    assert_eq!(heard, 2);
    line.len() + frame.len()
}

/// The stage that sums shapes over the picture, in memory that was lent: calls of the allocator, and lines summed.
fn shapes_of_tiles() -> (u64, u32) {
    const TILES: usize = WIDTH / 16;
    let timing = Timing::new(1_000_000_000, 100_000, ROWS as u16).unwrap();
    let grid = Grid::new(WIDTH as u16, ROWS as u16, 16).unwrap();
    let mut mean = [0.0; WIDTH * ROWS];
    let mut pixels = [0u8; WIDTH];
    for (row, mean) in mean.chunks_exact_mut(WIDTH).enumerate() {
        paint(&mut pixels, row, 0.0, 0);
        mean.iter_mut()
            .zip(pixels)
            .for_each(|(mean, p)| *mean = p.into());
    }
    let (mut right, mut down) = ([0; WIDTH * ROWS], [0; WIDTH * ROWS]);
    let (mut rest, mut brightness) = ([[0.0; 2]; TILES * ROWS], [0.0; ROWS]);
    let mut tiles = [TileTexture::default(); TILES];
    let (mut sums, mut products) = ([ToneSums::default(); 2 * TILES], [[0.0; 2]; TILES]);
    calls_of(|| {
        let storage = TextureStorage {
            right: &mut right,
            down: &mut down,
            rest: &mut rest,
            brightness: &mut brightness,
            tiles: &mut tiles,
        };
        let texture = Texture::build(grid, &mean, 0.0, storage).unwrap();
        let storage = SumsStorage {
            sums: &mut sums,
            products: &mut products,
        };
        let mut sums = TileSums::new(&texture, timing, &[17.0, 131.7], 0, storage).unwrap();
        for frame in 0..40 {
            for row in 0..ROWS {
                let start_ns = line_of(frame, row, &mut pixels);
                let line = Line {
                    frame,
                    row: row as u16,
                    start_ns,
                    pixels: Pixels::U8(&pixels),
                };
                sums.push(&line, 1.0);
            }
        }
        // These waves all lean one way, so that a tile alone tells no axis: its sums are there.
        assert!(sums.sums().iter().all(|sum| sum.x[0] != 0.0));
        let _ = sums.single(0, 1, 40);
        sums.lines()
    })
}
