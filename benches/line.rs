//! What a line costs: the inner product against a plain sum of its bytes, and a whole line through the
//! tracker by width and size of the motion. `cargo bench --bench line`

use core::f32::consts::TAU;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rowtone::camera::{Line, Pixels, Timing};
use rowtone::kernel::Kernel;
use rowtone::tracker::{Config, Stage, Storage, Tracker};

/// Rows of the pictures: enough that the tables do not stay in the first cache.
const ROWS: u16 = 240;
const LEARN_FRAMES: u16 = 8;

fn kernels(c: &mut Criterion) {
    let mut group = c.benchmark_group("kernel");
    for width in [256usize, 640, 1536] {
        let pixels: Vec<u8> = (0..width).map(|x| (x * 37 % 251) as u8).collect();
        let coefficients: Vec<i8> = (0..width).map(|x| (x * 29 % 129) as i8 - 64).collect();
        group.throughput(Throughput::Bytes(width as u64));
        for kernel in Kernel::all() {
            let id = BenchmarkId::new(format!("{kernel:?}"), width);
            group.bench_function(id, |b| b.iter(|| kernel.sums_u8(&pixels, &coefficients)));
        }
        group.bench_function(BenchmarkId::new("plain sum of the bytes", width), |b| {
            b.iter(|| pixels.iter().map(|&p| u64::from(p)).sum::<u64>());
        });
    }
    group.finish();
}

/// A texture of three waves, shifted.
fn pixel(x: usize, row: u16, shift_px: f32) -> u8 {
    let x = x as f32 - shift_px + 7.0 * f32::from(row);
    let value = 128.0 + 50.0 * (0.31 * x).sin() + 40.0 * (0.57 * x).sin() + 20.0 * (0.13 * x).cos();
    value as u8
}

/// Frames of a picture that swings by `amplitude_px`.
fn frames(width: usize, amplitude_px: f32) -> Vec<Vec<u8>> {
    let swing = |frame: usize, row: u16| {
        let t_s = frame as f32 / 60.0 + f32::from(row) * 40e-6;
        amplitude_px * (TAU * 24.3 * t_s).sin()
    };
    (0..2 * usize::from(LEARN_FRAMES) + 8)
        .map(|frame| {
            (0..ROWS)
                .flat_map(|row| (0..width).map(move |x| pixel(x, row, swing(frame, row))))
                .collect()
        })
        .collect()
}

fn lines(c: &mut Criterion) {
    let mut group = c.benchmark_group("line");
    for (width, amplitude_px) in [(160, 0.2), (320, 0.2), (640, 0.2), (1280, 0.2), (640, 4.0)] {
        let timing = Timing::new(40_000_000, 300_000, ROWS).expect("rows");
        let mut config = Config::new(timing, width as u16);
        config.learn_frames = LEARN_FRAMES;
        let pixels = width * usize::from(ROWS);
        let (mut coefficients, mut mean) = (vec![0; pixels], vec![0; pixels]);
        let rows = usize::from(ROWS);
        let (mut tables, mut learning) = (
            vec![Default::default(); rows],
            vec![Default::default(); rows],
        );
        let (mut mask, mut columns) = (vec![255; width], vec![Default::default(); width]);
        let mut fresh = vec![0; width];
        let mut scratch = vec![0.0; 2 * width];
        let storage = Storage {
            coefficients: &mut coefficients,
            tables: &mut tables,
            mean: &mut mean,
            learning: &mut learning,
            mask: &mut mask,
            columns: &mut columns,
            fresh: &mut fresh,
            scratch: &mut scratch,
        };
        let mut tracker = Tracker::new(config, storage).expect("buffers that fit");
        let frames = frames(width, amplitude_px);
        let mut number = 0;
        let mut push_all = |tracker: &mut Tracker<'_>, frame: &[u8]| {
            for (row, pixels) in (0..).zip(frame.chunks_exact(width)) {
                let start_ns = i64::from(number) * 16_666_667 + timing.start_ns(row);
                let pixels = Pixels::U8(pixels);
                let line = Line {
                    frame: number,
                    row,
                    start_ns,
                    pixels,
                };
                std::hint::black_box(tracker.push(&line));
            }
            number += 1;
        };
        for frame in &frames {
            push_all(&mut tracker, frame);
        }
        assert_eq!(tracker.stage(), Stage::Tracking);
        let name = format!("{width} px, motion {amplitude_px} px");
        group.throughput(Throughput::Elements(u64::from(ROWS)));
        // The last frames again and again: a steady motion with a jump in between.
        let mut next = frames[2 * usize::from(LEARN_FRAMES)..].iter().cycle();
        group.bench_function(name, |b| {
            b.iter(|| next.next().map(|frame| push_all(&mut tracker, frame)));
        });
    }
    group.finish();
}

criterion_group!(benches, kernels, lines);
criterion_main!(benches);
