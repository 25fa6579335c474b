//! The motion checks the time base: what is said of a line time, a frame rate or a read-out that is not the camera's.

use std::f64::consts::TAU;

use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::report::{Report, Warning};
use rowtone::spectrum::{Config, StaticCouplings, StaticStorage};
use rowtone::timeline::{Group, Sample, Vertical, rows_per_sample};
use rowtone_chance::{Chance, Mmix};

type Memory = StaticStorage<8192, 128, 128, 16384, 17>;

const ROWS: u16 = 300;
const LINE_US: f64 = 40.0;
const FPS: f64 = 60.0;
const NOISE_PX: f64 = 0.006;

/// What the user says of the camera: the line time over the true one, the frame rate over the true one, and whether the rows
/// come in the order that is taken.
#[derive(Clone, Copy)]
struct Said {
    line: f64,
    rate: f64,
    upside_down: bool,
    /// The rows know y too, along which nothing moves.
    knows_y: bool,
}

const RIGHT: Said = Said {
    line: 1.0,
    rate: 1.0,
    upside_down: false,
    knows_y: false,
};

/// One second of `motion` (px at s and η, −1 in the row exposed first and 1 in the last) as `said`.
fn report(seed: u64, said: Said, motion: impl Fn(f64, f64) -> f64) -> Report {
    let line_ps = (said.line * LINE_US * 1e6).round() as u32;
    let timing = Timing::new(line_ps, 0, ROWS).unwrap();
    let rows = rows_per_sample(timing, 1000.0 / said.line as f32, 60, 1 << 16);
    let group = Group::new(timing, rows).unwrap();
    let mut noise = Mmix(seed);
    for _ in 0..4 {
        noise.unit();
    }
    let offsets: Vec<f64> = (0..group.slots()).map(|_| 0.1 * noise.bell()).collect();
    let mut memory = Box::new(Memory::new());
    let config = Config {
        window_ns: (1e9 / said.rate) as i64 + 1,
        ..Config::default()
    };
    let mut couplings = StaticCouplings::<128>::new();
    let lent = match said.knows_y {
        true => memory.lend().with_couplings(&mut couplings),
        false => memory.lend(),
    };
    let mut analyzer = ReportSide::new(config, group, lent).unwrap();
    for frame in 0..60_u32 {
        for slot in 0..group.slots() {
            let first = f64::from(slot) * f64::from(group.rows_per_sample());
            let mut row = first + 0.5 * (f64::from(group.rows_of(slot)) - 1.0);
            if said.upside_down {
                row = f64::from(ROWS - 1) - row;
            }
            let t = f64::from(frame) / FPS + row * LINE_US * 1e-6;
            let moved = motion(t, 2.0 * row / f64::from(ROWS) - 1.0) + offsets[usize::from(slot)];
            let start_ns = (f64::from(frame) * 1e9 / (said.rate * FPS)) as i64;
            analyzer.push(Sample {
                frame,
                slot,
                curvature: Default::default(),
                time_ns: start_ns + group.middle_ns(slot),
                shift_px: (moved + NOISE_PX * noise.bell()) as f32,
                information_per_px2: (1.0 / (NOISE_PX * NOISE_PX)) as f32,
                vertical: said.knows_y.then(|| Vertical {
                    shift_px: (NOISE_PX * noise.bell()) as f32,
                    information_per_px2: (1.0 / (NOISE_PX * NOISE_PX)) as f32,
                    ..Vertical::default()
                }),
                spread: group.even_spread(),
            });
        }
    }
    analyzer.finish().unwrap()
}

fn flagged(report: &Report) -> bool {
    report.warnings.contains(Warning::TimingContradiction)
}

/// Running speed and a bearing.
fn machine(t: f64, _: f64) -> f64 {
    0.3 * (TAU * 24.7 * t).sin() + 0.2 * (TAU * 131.7 * t + 1.0).sin()
}

/// 400 windows of one to four tones at least 2.5 Hz apart and none at an image of another, rigid, bent or a node each, at 5 to 900 Hz and of 0.01 to 0.4 px:
/// none is flagged. (At five
/// deviations of each of some 1000 tones noise would flag one in 1700 such sets.)
#[test]
fn a_right_time_base_is_not_doubted() {
    let mut dice = Mmix(77);
    for seed in 0..400 {
        let mut tones: Vec<[f64; 4]> = Vec::new();
        while tones.len() < 1 + seed as usize % 4 {
            let hz = 5.0 * 180_f64.powf(dice.unit());
            let alike = |other: f64| {
                let away = |apart: f64| (apart - FPS * (apart / FPS).round()).abs() < 1.5;
                (other - hz).abs() < 2.5 || away(other - hz) || away(other + hz)
            };
            if tones.iter().any(|t| alike(t[0])) {
                continue;
            }
            tones.push({
                let px = 0.01 * 40_f64.powf(dice.unit());
                let (even, bent) = match (3.0 * dice.unit()) as u8 {
                    0 => (1.0, 0.0),
                    1 => (0.7, 0.3),
                    _ => (0.0, 1.0),
                };
                [hz, px * even, px * bent, TAU * dice.unit()]
            });
        }
        let report = report(1000 + seed, RIGHT, |t, eta| {
            let tone = |[hz, even, bent, phase]: &[f64; 4]| {
                (even + bent * eta) * (TAU * hz * t + phase).sin()
            };
            tones.iter().map(tone).sum()
        });
        assert!(!flagged(&report), "{seed}: {tones:?}: {report:?}");
        assert!(report.line_time_us_fit.is_none());
    }
}

/// 160 windows of one strong tone whose amplitude or phase is modulated, whose speed runs up or wanders, or that was struck, with a
/// steady one beside it: none is flagged.
#[test]
fn an_unsteady_tone_does_not_make_a_right_time_base_doubted() {
    let mut dice = Mmix(78);
    for seed in 0..160 {
        let hz = 20.0 * 20_f64.powf(dice.unit());
        let (rate, depth) = (0.7 * 20_f64.powf(dice.unit()), 0.1 + 0.8 * dice.unit());
        let (beside, phase) = (20.0 + 500.0 * dice.unit(), TAU * dice.unit());
        let px = 0.05 + 0.3 * dice.unit();
        let report = report(2000 + seed, RIGHT, |t, _| {
            let turn = TAU * hz * t + phase;
            let slow = TAU * rate * t;
            let unsteady = match seed % 5 {
                0 => (1.0 + depth * slow.sin()) * turn.sin(),
                1 => (turn + depth * slow.sin()).sin(),
                2 => (turn + TAU * 5.0 * depth * t * t).sin(),
                3 => (turn + 3.0 * depth * slow.sin()).sin(),
                _ if t < 0.3 => 0.0,
                _ => turn.sin() * (-(t - 0.3) / (0.05 + 0.3 * depth)).exp(),
            };
            px * unsteady + 0.05 * (TAU * beside * t).sin()
        });
        assert!(
            !flagged(&report),
            "{seed}: {hz} Hz, {rate} Hz, {depth}: {report:?}"
        );
    }
}

/// Three tones of one machine at half and a quarter of the line time: the strong one then looks modulated.
#[test]
fn a_line_time_of_a_half_under_harmonics_is_flagged() {
    let harmonics = |t: f64, _: f64| {
        let tone = |n: f64, hz: f64, px: f64| px * (TAU * hz * t + 0.7 * n).sin();
        tone(0.0, 49.2, 0.4) + tone(1.0, 98.4, 0.1) + tone(2.0, 296.7, 0.02)
    };
    for line in [0.25, 0.33, 0.5] {
        for seed in 0..3 {
            let said = Said { line, ..RIGHT };
            let report = report(seed, said, harmonics);
            assert!(flagged(&report), "{line}: {report:?}");
        }
    }
}

/// A wrong one is flagged, and the right line time is given where one value fits.
#[test]
fn a_wrong_time_base_is_flagged() {
    for (line, fits) in [
        (0.99, true),
        (1.01, true),
        (0.95, true),
        (1.1, true),
        (0.5, false),
        (2.0, false),
    ] {
        for seed in 0..4 {
            let said = Said { line, ..RIGHT };
            let report = report(seed, said, machine);
            assert!(flagged(&report), "{line}: {report:?}");
            if let Some(us) = report.line_time_us_fit {
                let off = f64::from(us) / LINE_US - 1.0;
                assert!(off.abs() < 0.003, "{line}: {us} µs");
            }
            assert!(
                report.line_time_us_fit.is_some() || !fits,
                "{line}: {report:?}"
            );
        }
    }
    // What moves along x alone is not left out because most of what both axes say is noise.
    for seed in 0..4 {
        let said = Said {
            line: 0.95,
            knows_y: true,
            ..RIGHT
        };
        let report = report(seed, said, machine);
        assert!(flagged(&report), "{report:?}");
        let us = report.line_time_us_fit.map(f64::from);
        assert!(
            us.is_some_and(|us| (us / LINE_US - 1.0).abs() < 0.003),
            "{report:?}"
        );
    }
    for said in [
        Said {
            rate: 25.0 / 60.0,
            ..RIGHT
        },
        Said {
            rate: 1.01,
            ..RIGHT
        },
        Said {
            upside_down: true,
            ..RIGHT
        },
    ] {
        assert!(flagged(&report(5, said, machine)));
    }
}

/// All rows at once, taken for one after the other.
#[test]
fn a_global_shutter_taken_for_a_rolling_one_is_flagged() {
    let report = report(3, RIGHT, |t, eta| {
        let late_s = 0.5 * (eta + 1.0) * f64::from(ROWS) * LINE_US * 1e-6;
        machine(t - late_s, 0.0)
    });
    assert!(flagged(&report), "{report:?}");
    assert!(report.line_time_us_fit.is_none());
}
