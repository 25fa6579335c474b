//! What a line costs: the inner product against a plain sum of its bytes, from the cache and from memory,
//! and a whole line through the tracker by width, rows and size of the motion. `cargo bench --bench line`

use core::f32::consts::TAU;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rowtone::camera::{Line, Pixels, Timing};
use rowtone::kernel::Kernel;
use rowtone::tracker::{Config, Stage, StaticStorage, Tracker};

const LEARN_FRAMES: u16 = 8;

/// The least that can be done with a line: its bytes summed, as wide as the processor goes.
fn plain_sum(bytes: &[u8]) -> u64 {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512bw") {
            // SAFETY: the processor was asked.
            return unsafe { plain_sum_avx512(bytes) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor was asked.
            return unsafe { plain_sum_avx2(bytes) };
        }
    }
    bytes.iter().map(|&p| u64::from(p)).sum()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw")]
fn plain_sum_avx512(bytes: &[u8]) -> u64 {
    use core::arch::x86_64::*;
    let (steps, rest) = bytes.as_chunks::<128>();
    let zero = _mm512_setzero_si512();
    let (mut even, mut odd) = (zero, zero);
    for step in steps {
        let at: *const __m512i = step.as_ptr().cast();
        // SAFETY: a step is 128 bytes long, and the loads need no alignment.
        let (a, b) = unsafe { (_mm512_loadu_si512(at), _mm512_loadu_si512(at.add(1))) };
        even = _mm512_add_epi64(even, _mm512_sad_epu8(a, zero));
        odd = _mm512_add_epi64(odd, _mm512_sad_epu8(b, zero));
    }
    let sum = _mm512_reduce_add_epi64(_mm512_add_epi64(even, odd)) as u64;
    sum + rest.iter().map(|&p| u64::from(p)).sum::<u64>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn plain_sum_avx2(bytes: &[u8]) -> u64 {
    use core::arch::x86_64::*;
    let (steps, rest) = bytes.as_chunks::<64>();
    let zero = _mm256_setzero_si256();
    let (mut even, mut odd) = (zero, zero);
    for step in steps {
        let at: *const __m256i = step.as_ptr().cast();
        // SAFETY: a step is 64 bytes long, and the loads need no alignment.
        let (a, b) = unsafe { (_mm256_loadu_si256(at), _mm256_loadu_si256(at.add(1))) };
        even = _mm256_add_epi64(even, _mm256_sad_epu8(a, zero));
        odd = _mm256_add_epi64(odd, _mm256_sad_epu8(b, zero));
    }
    let mut sums = [0u64; 4];
    // SAFETY: the array has room for 32 bytes, and the store needs no alignment.
    unsafe { _mm256_storeu_si256(sums.as_mut_ptr().cast(), _mm256_add_epi64(even, odd)) };
    sums.iter().sum::<u64>() + rest.iter().map(|&p| u64::from(p)).sum::<u64>()
}

/// From the first cache.
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
            b.iter(|| plain_sum(&pixels));
        });
    }
    group.finish();
}

/// From memory: pictures of 640 x 480 that no cache holds, each line with its own coefficients.
fn from_memory(c: &mut Criterion) {
    const WIDTH: usize = 640;
    const ROWS: usize = 480;
    let pictures: Vec<u8> = (0..256 * WIDTH * ROWS).map(|x| (x % 251) as u8).collect();
    let coefficients: Vec<i8> = (0..WIDTH * ROWS).map(|x| (x % 129) as i8 - 64).collect();
    let mut group = c.benchmark_group("memory");
    group.sample_size(20);
    group.throughput(Throughput::Bytes(pictures.len() as u64));
    let kernel = Kernel::detect();
    group.bench_function(format!("{kernel:?}"), |b| {
        b.iter(|| {
            let rows = coefficients.chunks_exact(WIDTH).cycle();
            let lines = pictures.chunks_exact(WIDTH).zip(rows);
            lines
                .map(|(line, row)| kernel.sums_u8(line, row).product)
                .sum::<i64>()
        });
    });
    group.bench_function("plain sum of the bytes", |b| {
        b.iter(|| plain_sum(&pictures));
    });
    group.finish();
}

/// A texture of three waves, shifted.
fn pixel(x: usize, row: u16, shift_px: f32) -> u8 {
    let x = x as f32 - shift_px + 7.0 * f32::from(row);
    let value = 128.0 + 50.0 * (0.31 * x).sin() + 40.0 * (0.57 * x).sin() + 20.0 * (0.13 * x).cos();
    value as u8
}

/// Frames of a picture that swings by `amplitude_px`.
fn frames(width: usize, rows: u16, amplitude_px: f32) -> Vec<Vec<u8>> {
    let swing = |frame: usize, row: u16| {
        let t_s = frame as f32 / 60.0 + f32::from(row) * 16e-6;
        amplitude_px * (TAU * 24.3 * t_s).sin()
    };
    (0..2 * usize::from(LEARN_FRAMES) + 8)
        .map(|frame| {
            (0..rows)
                .flat_map(|row| (0..width).map(move |x| pixel(x, row, swing(frame, row))))
                .collect()
        })
        .collect()
}

fn lines(c: &mut Criterion) {
    let mut group = c.benchmark_group("line");
    let widths = [160, 320, 640, 1280].map(|width| (width, 240, 0.2));
    let rows = [480, 960].map(|rows| (640, rows, 0.2));
    let motions = [0.05, 1.0, 4.0].map(|amplitude_px| (640, 240, amplitude_px));
    for (width, rows, amplitude_px) in widths.into_iter().chain(rows).chain(motions) {
        let timing = Timing::new(16_000_000, 300_000, rows).expect("rows");
        let mut config = Config::new(timing, width as u16);
        config.learn_frames = LEARN_FRAMES;
        let mut storage = Box::new(StaticStorage::<{ 640 * 960 }, 960, 1280>::new());
        let mut tracker = Tracker::new(config, storage.lend()).expect("buffers that fit");
        let frames = frames(width, rows, amplitude_px);
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
        let name = format!("{width} px, {rows} rows, motion {amplitude_px} px");
        group.throughput(Throughput::Elements(u64::from(rows)));
        // The last frames again and again: a steady motion with a jump in between.
        let mut next = frames[2 * usize::from(LEARN_FRAMES)..].iter().cycle();
        group.bench_function(name, |b| {
            b.iter(|| next.next().map(|frame| push_all(&mut tracker, frame)));
        });
    }
    group.finish();
}

criterion_group!(benches, kernels, from_memory, lines);
criterion_main!(benches);
