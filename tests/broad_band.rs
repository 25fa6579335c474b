//! Broad-band measures of made-up samples whose motion is known exactly.

use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::report::{BroadBand, Figure};
use rowtone::spectrum::{Config, StaticCouplings, StaticStorage};
use rowtone::timeline::{Group, Sample, Vertical};
use std::f64::consts::TAU;

/// Waves along x and y: Hz, px of the cosine and of the sine.
type Waves<'a> = [&'a [(f64, f64, f64)]; 2];

fn at(waves: &[(f64, f64, f64)], t: f64) -> f64 {
    let each = waves.iter().map(|&(hz, a, b)| {
        let (s, c) = (TAU * hz * t).sin_cos();
        a * c + b * s
    });
    each.sum()
}

/// A generator of even numbers, of which twelve make a normal one.
struct Draw(u32);

impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / 16_777_216.0
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// One second of 60 frames of 144 rows, 90 µs apart (22 % blank) and exposed for 0.8 ms, 0.008 px a row.
fn second(waves: Waves<'_>, um_per_px: Option<f32>) -> rowtone::report::Report {
    second_without(&[], waves, um_per_px)
}

/// The same where some rows are never measured.
fn second_without(
    missing: &[u16],
    waves: Waves<'_>,
    um_per_px: Option<f32>,
) -> rowtone::report::Report {
    let timing = Timing::new(90_000_000, 800_000, 144).unwrap();
    let group = Group::new(timing, 1).unwrap();
    let mut memory = Box::new(StaticStorage::<{ 2 * 144 * 64 }, 128, 144, 8192, 17>::new());
    let mut couplings = StaticCouplings::<144>::new();
    let storage = memory.lend().with_couplings(&mut couplings);
    let config = Config {
        um_per_px,
        ..Config::default()
    };
    let mut reports = ReportSide::new(config, group, storage).unwrap();
    let mut draw = Draw(1);
    let filmed = waves.map(|axis| {
        let left = |hz: f64| f64::from(group.exposed(hz as f32));
        let weaken = |&(hz, a, b): &(f64, f64, f64)| (hz, a * left(hz), b * left(hz));
        axis.iter().map(weaken).collect::<Vec<_>>()
    });
    for frame in 0..60 {
        for slot in (0..144_u16).filter(|slot| !missing.contains(slot)) {
            let start_ns = i64::from(frame) * 1_000_000_000 / 60;
            let time_ns = start_ns + group.middle_ns(slot);
            let t = time_ns as f64 * 1e-9;
            let (x, y) = (at(&filmed[0], t), at(&filmed[1], t));
            let coupling = 0.5 * (f64::from(slot) * 0.7).sin();
            let vertical = Vertical {
                shift_px: (y + 0.008 * draw.normal()) as f32,
                information_per_px2: 15_625.0,
                coupling: coupling as f32,
                ..Vertical::default()
            };
            let complete = reports.push(Sample {
                frame,
                slot,
                curvature: Default::default(),
                time_ns,
                shift_px: (x + coupling * y + 0.008 * draw.normal()) as f32,
                information_per_px2: 15_625.0,
                spread: group.even_spread(),
                vertical: Some(vertical),
            });
            assert!(!complete);
        }
    }
    reports.finish().expect("a second of frames")
}

fn random(draw: &mut Draw, [low, high]: [f64; 2], rms_px: f64) -> Vec<(f64, f64, f64)> {
    let count = (high - low).ceil();
    let size = rms_px / count.sqrt();
    let wave = |i: u32| {
        let hz = low + (high - low) * (f64::from(i) + draw.unit()) / count;
        (hz, size * draw.normal(), size * draw.normal())
    };
    (0..count as u32).map(wave).collect()
}

/// Root mean squares over the second: displacement, velocity, acceleration.
fn truth(waves: &[(f64, f64, f64)]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for i in 0..8192 {
        let t = f64::from(i) / 8192.0;
        let mut now = [0.0; 3];
        for &(hz, a, b) in waves {
            let w = TAU * hz;
            let (s, c) = (w * t).sin_cos();
            now[0] += a * c + b * s;
            now[1] += w * (b * c - a * s);
            now[2] += w * w * (a * c + b * s);
        }
        for (sum, x) in sums.iter_mut().zip(now) {
            *sum += x * x / 8192.0;
        }
    }
    sums.map(f64::sqrt)
}

fn is(figure: Option<Figure>, want: f64, share: f64) {
    let figure = figure.expect("known");
    let off = f64::from(figure.value) / want - 1.0;
    assert!(off.abs() < share, "{figure:?} for {want}");
    assert!(!figure.is_limit() && f64::from(figure.at_most) > want * (1.0 - share));
}

/// Random vibration along both axes: the velocity is told within 5 %, where peaks alone tell nothing.
#[test]
fn random_vibration_has_its_velocity() {
    let mut draw = Draw(5);
    let x = random(&mut draw, [20.0, 400.0], 0.1);
    let y = random(&mut draw, [30.0, 300.0], 0.05);
    let report = second([&x, &y], Some(1000.0));
    let told: BroadBand = report.broad_band.expect("known");
    assert_eq!(told.known_to_hz, 1000.0);
    let (x, y) = (truth(&x), truth(&y));
    let (along_x, along_y) = (told.x.unwrap(), told.y.unwrap());
    for (measures, truth) in [(along_x, x), (along_y, y)] {
        is(measures.velocity_px_s, truth[1], 0.05);
        is(measures.velocity_from_2_hz_px_s, truth[1], 0.05);
        is(measures.displacement_px, truth[0], 0.06);
        // The noise of what is fastest hides most of it.
        let acceleration = measures.acceleration_px_s2.expect("known");
        assert!(
            f64::from(acceleration.at_most) > truth[2],
            "{acceleration:?}"
        );
        // Of a normal distribution; of some 400 independent values the fourth moment is within a third.
        is(measures.kurtosis, 3.0, 0.34);
    }
    let both = [0, 1, 2].map(|i| x[i].hypot(y[i]));
    is(told.sum.velocity_px_s, both[1], 0.05);
    is(told.sum.displacement_px, both[0], 0.06);
    let speed = report.velocity_mm_s_rms.expect("a scale");
    let px_s = told.sum.velocity_px_s.unwrap().value;
    assert!((speed / px_s - 1.0).abs() < 1e-5, "{speed} {px_s}");
}

/// Rows without texture leave the velocity as it is: single ones all over the picture are bridged, and of many side by side
/// the rest is used.
#[test]
fn rows_that_are_never_measured_take_no_velocity() {
    let mut draw = Draw(5);
    let x = random(&mut draw, [20.0, 400.0], 0.1);
    let y = random(&mut draw, [30.0, 300.0], 0.05);
    let want = truth(&x)[1].hypot(truth(&y)[1]);
    let single: Vec<u16> = (0..144).step_by(15).collect();
    let upper: Vec<u16> = (0..84).collect();
    // Of 60 rows in a row half as many are heard as of 144.
    for (missing, within) in [(single, 0.05), (upper, 0.08)] {
        let told = second_without(&missing, [&x, &y], Some(1000.0)).broad_band;
        is(told.expect("known").sum.velocity_px_s, want, within);
    }
}

/// An orbit has the velocity of both axes; what stands still has none, and says what it may be.
#[test]
fn tones_count_along_both_axes() {
    let report = second(
        [
            &[(83.3, 0.2, 0.0)],
            &[(83.3, 0.0, 0.12), (211.7, 0.06, 0.0)],
        ],
        None,
    );
    let told = report.broad_band.expect("known");
    let of = |hz: f64, px: f64| TAU * hz * px / 2.0_f64.sqrt();
    let (x, y) = (of(83.3, 0.2), of(83.3, 0.12).hypot(of(211.7, 0.06)));
    is(told.x.unwrap().velocity_px_s, x, 0.01);
    is(told.y.unwrap().velocity_px_s, y, 0.01);
    is(told.sum.velocity_px_s, x.hypot(y), 0.01);
    is(told.x.unwrap().kurtosis, 1.5, 0.04);
    is(told.x.unwrap().crest_factor, 2.0_f64.sqrt(), 0.07);
    is(told.x.unwrap().peak_to_peak_px, 0.4, 0.07);
    assert_eq!(report.velocity_mm_s_rms, None, "there is no scale");
}

/// Nothing moves: no velocity, and a limit of what the noise could hide.
#[test]
fn what_is_still_has_a_limit() {
    let told = second([&[], &[]], None).broad_band.expect("known");
    let velocity = told.sum.velocity_px_s.unwrap();
    // sd(v²) ≥ (2π)²·2σ²/r·√(f⁵/5T)/√a along each axis, and the exposure leaves a quarter of what is fastest.
    let least = 2.0 * 39.5 * 2.0 * 0.008_f64.powi(2) / 11_111.0 * 1.4e7;
    assert!(
        velocity.is_limit() && velocity.at_most > least.sqrt() as f32,
        "{velocity:?}"
    );
    assert!(velocity.at_most < 40.0, "{velocity:?}");
    assert!(told.x.unwrap().kurtosis.is_none());
}
