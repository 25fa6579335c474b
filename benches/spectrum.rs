//! What a window costs: its fit by length, number of tones and blank time, and how many passes over the samples that is.
//! `cargo bench --bench spectrum`

use core::f64::consts::TAU;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::spectrum::{Config, StaticStorage};
use rowtone::timeline::{Group, Sample, Spread};

type Memory = StaticStorage<65_536, 1024, 64, 32_768, 17>;

/// A camera at 60 fps with 60 samples a frame, `frames` of it.
struct Window {
    group: Group,
    frames: u32,
    samples: Vec<Sample>,
}

impl Window {
    fn new(frames: u32, tones: usize, blank: f64) -> Self {
        let line_ps = (1e12 / 60.0 / 240.0 * (1.0 - blank)) as u32;
        let timing = Timing::new(line_ps, 0, 240).expect("has rows");
        let group = Group::new(timing, 4).expect("fewer than it has");
        let mut noise = 1_u64;
        let mut unit = || {
            noise = noise
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut samples = Vec::new();
        for frame in 0..frames {
            for slot in 0..group.slots() {
                let time_ns = i64::from(frame) * 16_666_667 + group.middle_ns(slot);
                let t = time_ns as f64 * 1e-9;
                let tone = |i: usize| {
                    let hz = 31.3 + 107.7 * i as f64;
                    0.3 / (1 << i) as f64 * (TAU * hz * t + i as f64).cos()
                };
                let moved: f64 = (0..tones).map(tone).sum();
                samples.push(Sample {
                    curvature: Default::default(),
                    frame,
                    slot,
                    time_ns,
                    shift_px: (moved + 0.014 * (unit() + unit() + unit())) as f32,
                    information_per_px2: 2e4,
                    spread: Spread::default(),
                    vertical: None,
                });
            }
        }
        Self {
            group,
            frames,
            samples,
        }
    }

    /// Time of `count` fits, the collecting left out, and the passes of one.
    fn time(&self, memory: &mut Memory, count: u64) -> (Duration, u32) {
        let window_ns = i64::from(self.frames + 1) * 16_666_667;
        let mut total = Duration::ZERO;
        let mut passes = 0;
        for _ in 0..count {
            let config = Config {
                window_ns,
                ..Config::default()
            };
            let mut reports =
                ReportSide::new(config, self.group, memory.lend()).expect("the memory fits");
            for sample in &self.samples {
                reports.push(*sample);
            }
            let start = Instant::now();
            let report = reports.finish();
            total += start.elapsed();
            assert!(report.is_some());
            passes = reports.passes();
        }
        (total, passes)
    }
}

fn windows(c: &mut Criterion) {
    let mut memory = Box::new(Memory::new());
    let mut group = c.benchmark_group("window");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    let kinds = [
        (
            "length, 3 tones",
            vec![
                (17, 3, 0.1),
                (34, 3, 0.1),
                (68, 3, 0.1),
                (136, 3, 0.1),
                (272, 3, 0.1),
            ],
        ),
        (
            "tones, 4080 samples",
            vec![
                (68, 0, 0.1),
                (68, 1, 0.1),
                (68, 2, 0.1),
                (68, 5, 0.1),
                (68, 8, 0.1),
            ],
        ),
        (
            "blank 40 %, tones",
            vec![(68, 1, 0.4), (68, 5, 0.4), (68, 8, 0.4)],
        ),
    ];
    for (name, sizes) in kinds {
        for (frames, tones, blank) in sizes {
            let window = Window::new(frames, tones, blank);
            let (_, passes) = window.time(&mut memory, 1);
            let id = format!("{} samples, {tones} tones, {passes} passes", frames * 60);
            group.bench_function(BenchmarkId::new(name, id), |b| {
                b.iter_custom(|count| window.time(&mut memory, count).0);
            });
        }
    }
    group.finish();
}

criterion_group!(benches, windows);
criterion_main!(benches);
