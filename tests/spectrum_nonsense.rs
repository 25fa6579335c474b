//! No input makes the spectrum panic, and what it then says is finite.

use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::report::{PeakShape, Report, ShapeRow};
use rowtone::spectrum::{Config, StaticCouplings, StaticStorage};
use rowtone::timeline::{Curvature, Group, Sample, Spread, Vertical};
use rowtone_chance::{Chance, XorShift};

struct Draw(XorShift);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0.next()
    }

    /// True once in `times`.
    fn once_in(&mut self, times: u64) -> bool {
        self.next().is_multiple_of(times)
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.next() as usize % choices.len()]
    }
}

fn is_sane(report: &Report) -> bool {
    report.noise_px.is_finite()
        && report.fps.is_finite()
        && report.window_s.is_finite()
        && report.peaks.iter().all(|p| {
            p.hz.is_finite()
                && p.hz > 0.0
                && p.hz_sd.is_finite()
                && p.amplitude_px.is_finite()
                && p.amplitude_px_sd.is_finite()
                && p.snr_db.is_finite()
                && p.motion.is_some_and(|m| {
                    [
                        m.x_px,
                        m.x_px_sd,
                        m.y_px,
                        m.y_px_sd,
                        m.y_phase_rad,
                        m.across_rad,
                    ]
                    .into_iter()
                    .flatten()
                    .chain([m.phase_rad])
                    .all(f32::is_finite)
                })
        })
        && report.line_time_us_fit.is_none_or(f32::is_finite)
}

fn is_sane_shape(shape: &PeakShape) -> bool {
    let finite = |r: &ShapeRow| {
        [r.x_px, r.x_phase_rad, r.y_px, r.y_phase_rad]
            .into_iter()
            .all(f32::is_finite)
    };
    shape.hz.is_finite() && shape.rows.iter().all(finite)
}

#[test]
fn nothing_panics_and_all_is_finite() {
    let odd = [
        f32::NAN,
        f32::INFINITY,
        -1.0,
        0.0,
        1e-30,
        1e30,
        f32::MAX,
        1.0,
        0.5,
        1e5,
    ];
    let jumps = [
        0,
        1,
        -1,
        1_000,
        -1_000_000,
        16_000_000,
        900_000_000,
        -3_000_000_000,
        i64::MAX / 3,
        i64::MIN / 3,
    ];
    for seed in 1..40_u64 {
        let mut draw = Draw(XorShift(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let line_ps = draw.of(&[0, 1, 1_000_000, 50_000_000, u32::MAX]);
        let rows = draw.of(&[1, 2, 40, 300]);
        let timing = Timing::new(line_ps, draw.of(&[0, 500_000, u32::MAX]), rows).unwrap();
        let group = Group::new(timing, draw.of(&[1, 1.max(rows / 20)]).max(rows / 40)).unwrap();
        let mut memory = Box::new(StaticStorage::<512, 24, 48, 256, 5>::new());
        let config = Config {
            window_ns: draw.of(&[1_000_000, 100_000_000, 1_000_000_000]),
            hop_ns: draw.of(&[1_000_000, 500_000_000]),
            max_passes: 60,
            ..Config::default()
        };
        // Every third knows both axes.
        let both = seed % 3 == 0;
        let mut couplings = StaticCouplings::<48>::new();
        let lent = if both {
            memory.lend().with_couplings(&mut couplings)
        } else {
            memory.lend()
        };
        let mut reports = ReportSide::new(config, group, lent).unwrap();
        let (mut frame, mut start_ns) = (draw.next() as u32, draw.of(&[0, -5, i64::MAX / 2]));
        // Half of the seeds are mostly sane, with odd things strewn in.
        let sane = seed % 2 == 0;
        for _ in 0..120 {
            let often = !sane || draw.once_in(16);
            start_ns = start_ns.saturating_add(if often { draw.of(&jumps) } else { 16_000_000 });
            frame = frame.wrapping_add(if often {
                draw.of(&[0, 1, 2, u32::MAX, 77_777])
            } else {
                1
            });
            for slot in 0..group.slots() {
                let strange = if sane {
                    draw.once_in(64)
                } else {
                    draw.once_in(2)
                };
                let unit = (draw.next() >> 40) as f32 / (1 << 24) as f32;
                let sample = Sample {
                    curvature: Curvature::of_per_px2(draw.of(&odd)),
                    frame,
                    slot: if strange {
                        draw.of(&[slot, slot + 1, u16::MAX])
                    } else {
                        slot
                    },
                    time_ns: start_ns.saturating_add(group.middle_ns(slot)),
                    shift_px: if strange { draw.of(&odd) } else { unit },
                    information_per_px2: if strange { draw.of(&odd) } else { 1e4 },
                    spread: Spread {
                        variance_ns2: if strange { draw.of(&odd) } else { 1e9 },
                        third_ns3: if strange { draw.of(&odd) } else { 1e13 },
                    },
                    vertical: (both && !draw.once_in(9)).then(|| {
                        let mut any = |usual: f32| if strange { draw.of(&odd) } else { usual };
                        Vertical {
                            shift_px: any(0.5 - unit),
                            information_per_px2: any(5e3),
                            coupling: any(0.3),
                            coupling_delay_ns: any(1e4),
                            delay_ns: any(-1e4),
                        }
                    }),
                };
                if reports.push(sample) && !draw.once_in(4) {
                    let report = reports.report().expect("a window was ready");
                    assert!(is_sane(&report), "{report:?}");
                    assert!(reports.shapes().iter().all(is_sane_shape));
                }
            }
        }
        if let Some(report) = reports.finish() {
            assert!(is_sane(&report), "{report:?}");
        }
        assert_eq!(reports.finish(), None);
    }
}
