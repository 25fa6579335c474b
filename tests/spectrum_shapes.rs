//! Motions that are not the same in all rows: one tone each, and no images of it.

use std::f64::consts::TAU;

use rowtone::camera::Timing;
use rowtone::pipeline::ReportSide;
use rowtone::report::{Peak, PeakShape, Report};
use rowtone::spectrum::{Config, StaticCouplings, StaticStorage};
use rowtone::timeline::{Group, Sample, Vertical, rows_per_sample};
use rowtone_chance::{Chance, Mmix};

type Memory = StaticStorage<8192, 128, 128, 16384, 17>;

const FPS: f64 = 60.0;
const NOISE_PX: f64 = 0.003;

/// One second of a camera of 144 rows, 90 µs apart, that sees `motion` (px at s and η, −1 in the first row and 1 in the last),
/// its slots off by 0.1 px and noisy by 0.003 px.
fn report(seed: u64, motion: impl Fn(f64, f64) -> f64) -> Report {
    analysis(seed, motion).0
}

/// The same with the shapes of the peaks.
fn analysis(seed: u64, motion: impl Fn(f64, f64) -> f64) -> (Report, Vec<PeakShape>) {
    let timing = Timing::new(90_000_000, 0, 144).unwrap();
    let group = Group::new(timing, rows_per_sample(timing, 1000.0, 60, 1 << 16)).unwrap();
    let mut noise = Mmix(seed);
    for _ in 0..4 {
        noise.unit();
    }
    let offsets: Vec<f64> = (0..group.slots()).map(|_| 0.1 * noise.bell()).collect();
    let mut memory = Box::new(Memory::new());
    let mut reports = ReportSide::new(Config::default(), group, memory.lend()).unwrap();
    for frame in 0..60_u32 {
        for slot in 0..group.slots() {
            let first = f64::from(slot) * f64::from(group.rows_per_sample());
            let eta = (first + 0.5 * f64::from(group.rows_of(slot))) / 72.0 - 1.0;
            let time_ns = (f64::from(frame) * 1e9 / FPS) as i64 + group.middle_ns(slot);
            let moved = motion(time_ns as f64 * 1e-9, eta) + offsets[usize::from(slot)];
            let done = reports.push(Sample {
                frame,
                slot,
                curvature: Default::default(),
                time_ns,
                shift_px: (moved + NOISE_PX * noise.bell()) as f32,
                information_per_px2: (1.0 / (NOISE_PX * NOISE_PX)) as f32,
                vertical: None,
                spread: group.even_spread(),
            });
            assert!(!done);
        }
    }
    let report = reports.finish().unwrap();
    (report, reports.shapes().to_vec())
}

/// The one peak that is neither doubtful nor below `least_px`.
fn only(report: &Report, least_px: f32, what: &str) -> Peak {
    let sure = |p: &&Peak| !p.ambiguous && p.amplitude_px > least_px;
    let peaks: Vec<&Peak> = report.peaks.iter().filter(sure).collect();
    assert_eq!(peaks.len(), 1, "{what}: {:?}", report);
    *peaks[0]
}

/// A frequency and the amplitude of a motion that bends, the largest that any row has, and what it is called.
type Bent = (&'static str, fn(f64) -> f64, f64);

const BENT: [Bent; 4] = [
    ("a node at mid-height", |eta| 0.3 * eta, 0.3),
    ("a cantilever", |eta| 0.2 + 0.1 * eta, 0.3),
    ("a perspective of 10 %", |eta| 0.3 * (1.0 + 0.1 * eta), 0.33),
    ("a second mode", |eta| 0.3 * (1.5 * eta * eta - 0.5), 0.3),
];

/// Of each of these the rigid model makes sure images, a multiple of the frame rate away, of a tenth of the tone to more than it
/// has at its own place.
///
/// An image would have to be told in one of 32 windows by noise: 3 % of seeds at the level of 1 in 1000.
#[test]
fn what_bends_is_one_tone() {
    for (what, amplitude, largest_px) in BENT {
        for (seed, hz) in [(3, 33.3), (4, 97.3), (5, 211.7), (6, 402.1), (7, 131.9)] {
            let what = format!("{what}, {hz} Hz");
            let report = report(seed, |t, eta| amplitude(eta) * (TAU * hz * t + 0.7).sin());
            let peak = only(&report, 0.0, &what);
            let off = (f64::from(peak.hz) - hz) / f64::from(peak.hz_sd);
            assert!(off.abs() < 4.0, "{what}: {peak:?}");
            // The samples do not know the exposure, so nothing is left of it; the slots' averaging is not in them either.
            let averaged = hz * TAU * 0.5 * 90e-6 * 5.0;
            let seen = largest_px * averaged / averaged.sin();
            let share = f64::from(peak.amplitude_px) / seen;
            assert!((share - 1.0).abs() < 0.03, "{what}: {peak:?}, {share}");
        }
    }
}

/// What moves the same in all rows stays rigid: no more than one of 10 000 tones may be taken for bent by noise, and here none
/// of 40 is.
#[test]
fn what_is_rigid_stays_as_sure_as_it_was() {
    for seed in 0..40 {
        let report = report(100 + seed, |t, _| 0.05 * (TAU * 143.3 * t).sin());
        let peak = only(&report, 0.0, "rigid");
        // √(2/N)·σ of 60 frames of 29 slots, whose averaging is undone.
        let bound_px = (2.0_f64 / (60.0 * 29.0)).sqrt() * NOISE_PX;
        let sd = f64::from(peak.amplitude_px_sd);
        assert!((0.9..1.2).contains(&(sd / bound_px)), "{peak:?}");
    }
}

/// What happens to a motion (x, y) in a sample of a slot whose texture leans by κ and knows so much of each axis.
struct Slot {
    coupling: f64,
    noise_px: [f64; 2],
}

/// The same camera where samples know both axes; `motion` gives x and y, px.
fn planar(seed: u64, motion: impl Fn(f64, f64) -> [f64; 2]) -> Report {
    textured(seed, None, motion)
}

/// The same where all rows lean alike: κ is this, and the second measurement knows next to nothing.
fn leaning(seed: u64, coupling: f64, motion: impl Fn(f64) -> [f64; 2]) -> Report {
    textured(seed, Some(coupling), |t, _| motion(t))
}

fn textured(seed: u64, lean: Option<f64>, motion: impl Fn(f64, f64) -> [f64; 2]) -> Report {
    let timing = Timing::new(90_000_000, 0, 144).unwrap();
    let group = Group::new(timing, rows_per_sample(timing, 1000.0, 60, 1 << 16)).unwrap();
    let mut noise = Mmix(seed);
    for _ in 0..4 {
        noise.unit();
    }
    let slots: Vec<Slot> = (0..group.slots())
        .map(|_| Slot {
            coupling: lean.unwrap_or_else(|| 0.2 * noise.bell()),
            noise_px: [1.0, if lean.is_some() { 1e3 } else { 1.0 }]
                .map(|wide| wide * NOISE_PX * (0.3 * noise.bell()).exp()),
        })
        .collect();
    let mut memory = Box::new(Memory::new());
    let mut couplings = StaticCouplings::<128>::new();
    let lent = memory.lend().with_couplings(&mut couplings);
    let mut analyzer = ReportSide::new(Config::default(), group, lent).unwrap();
    for frame in 0..60_u32 {
        for (number, slot) in slots.iter().enumerate() {
            let number = number as u16;
            let first = f64::from(number) * f64::from(group.rows_per_sample());
            let eta = (first + 0.5 * f64::from(group.rows_of(number))) / 72.0 - 1.0;
            let time_ns = (f64::from(frame) * 1e9 / FPS) as i64 + group.middle_ns(number);
            let [x, y] = motion(time_ns as f64 * 1e-9, eta);
            let information = slot.noise_px.map(|sd| (1.0 / (sd * sd)) as f32);
            analyzer.push(Sample {
                frame,
                slot: number,
                curvature: Default::default(),
                time_ns,
                shift_px: (x + slot.coupling * y + slot.noise_px[0] * noise.bell()) as f32,
                information_per_px2: information[0],
                vertical: Some(Vertical {
                    shift_px: (y + slot.noise_px[1] * noise.bell()) as f32,
                    information_per_px2: information[1],
                    coupling: slot.coupling as f32,
                    ..Vertical::default()
                }),
                spread: group.even_spread(),
            });
        }
    }
    analyzer.finish().unwrap()
}

/// Motion along the columns alone, along both axes in phase or not, bending or not: one tone each.
#[test]
fn motion_along_the_columns_is_told_too() {
    type Planar = (&'static str, fn(f64, f64) -> [f64; 2], f64);
    // The phase and η to px along x and y; the largest that any row moves.
    let motions: [Planar; 5] = [
        ("along y", |p, _| [0.0, 0.2 * p.sin()], 0.2),
        (
            "across",
            |p, _| [0.2 * p.sin(), 0.2 * p.sin()],
            0.08_f64.sqrt(),
        ),
        ("an orbit", |p, _| [0.2 * p.sin(), 0.1 * p.cos()], 0.2),
        ("bends along y", |p, eta| [0.0, 0.2 * eta * p.sin()], 0.2),
        (
            "bends along x, moves along y",
            |p, eta| [0.2 * eta * p.sin(), 0.1 * (p + 1.0).sin()],
            0.209,
        ),
    ];
    for (what, motion, largest_px) in motions {
        for (seed, hz) in [(1, 61.3), (2, 131.9), (3, 311.0)] {
            let what = format!("{what}, {hz} Hz");
            let report = planar(seed, |t, eta| motion(TAU * hz * t + 0.4, eta));
            let peak = only(&report, 0.0, &what);
            let off = (f64::from(peak.hz) - hz) / f64::from(peak.hz_sd);
            assert!(off.abs() < 4.0, "{what}: {peak:?}");
            let averaged = hz * TAU * 0.5 * 90e-6 * 5.0;
            let share = f64::from(peak.amplitude_px) / (largest_px * averaged / averaged.sin());
            assert!((share - 1.0).abs() < 0.03, "{what}: {peak:?}, {share}");
        }
    }
}

/// Two machines in one picture, one above the other: neither's images are told as sure.
#[test]
fn halves_are_two_tones() {
    for (seed, upper_hz, lower_hz) in [(1, 52.7, 83.3), (2, 131.9, 97.1), (3, 211.3, 40.2)] {
        let report = report(seed, |t, eta| {
            let hz = if eta < 0.0 { upper_hz } else { lower_hz };
            0.2 * (TAU * hz * t).sin()
        });
        let sure: Vec<&Peak> = report.peaks.iter().filter(|p| !p.ambiguous).collect();
        assert_eq!(sure.len(), 2, "{:?}", report.peaks);
        for hz in [upper_hz, lower_hz] {
            let near = |p: &&&Peak| (f64::from(p.hz) - hz).abs() < 3.0 * f64::from(p.hz_sd);
            let peak = sure
                .iter()
                .find(near)
                .unwrap_or_else(|| panic!("{hz} Hz: {sure:?}"));
            let averaged = hz * TAU * 0.5 * 90e-6 * 5.0;
            let share = f64::from(peak.amplitude_px) / (0.2 * averaged / averaged.sin());
            assert!((share - 1.0).abs() < 0.03, "{peak:?}");
            assert!(!peak.motion.unwrap().rigid);
        }
    }
}

/// Two tones of the same alias frequency: both are there, the weaker one in doubt.
#[test]
fn a_tone_at_an_image_of_a_larger_one_is_in_doubt() {
    for seed in 0..4 {
        let report = report(seed, |t, _| {
            0.2 * (TAU * 83.3 * t).sin() + 0.05 * (TAU * 143.6 * t).sin()
        });
        let hz: Vec<f32> = report.peaks.iter().map(|p| p.hz.round()).collect();
        assert_eq!(hz, [83.0, 144.0], "{:?}", report.peaks);
        assert!(!report.peaks[0].ambiguous && report.peaks[1].ambiguous);
    }
}

/// Both components and their phases, sines from the recording's beginning on, and an axis that is still.
#[test]
fn components_have_their_amplitudes_and_phases() {
    for (seed, hz) in [(1, 61.9), (2, 131.9), (3, 311.0), (4, 407.3)] {
        let averaged = hz * TAU * 0.5 * 90e-6 * 5.0;
        let seen = averaged / averaged.sin();
        let near = |value: Option<f32>, want: f64, sd: Option<f32>| {
            let (value, sd) = (f64::from(value.unwrap()), f64::from(sd.unwrap()));
            assert!(
                (value - want).abs() < 4.0 * sd + 1e-3 * want,
                "{hz} Hz: {value} for {want}"
            );
        };
        let turned = |value: f32, want: f64| {
            let off = (f64::from(value) - want + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
            assert!(off.abs() < 0.02, "{hz} Hz: {value} for {want}");
        };
        let report = planar(seed, |t, _| {
            let p = TAU * hz * t + 0.4;
            [0.2 * p.sin(), -0.1 * (p + 1.0).sin()]
        });
        let motion = only(&report, 0.0, "an orbit").motion.unwrap();
        near(motion.x_px, 0.2 * seen, motion.x_px_sd);
        near(motion.y_px, 0.1 * seen, motion.y_px_sd);
        turned(motion.phase_rad, 0.4);
        turned(motion.y_phase_rad.unwrap(), 1.4 + TAU / 2.0);
        assert!(motion.rigid && motion.across_rad.is_none());
        let report = planar(seed, |t, _| [0.2 * (TAU * hz * t).sin(), 0.0]);
        let motion = only(&report, 0.0, "along x").motion.unwrap();
        near(motion.x_px, 0.2 * seen, motion.x_px_sd);
        assert!(motion.y_px.unwrap() < 4.0 * motion.y_px_sd.unwrap());
        turned(motion.phase_rad, 0.0);
    }
}

/// The shape of what bends is given over the rows.
#[test]
fn the_rows_of_what_bends_are_told() {
    let reports = analysis(9, |t, eta| 0.3 * eta * (TAU * 97.3 * t + 1.0).sin());
    let (report, shapes) = &reports;
    let peak = only(report, 0.0, "a node");
    assert!(!peak.motion.unwrap().rigid);
    assert_eq!(shapes.len(), 1);
    assert_eq!(shapes[0].hz, peak.hz);
    assert_eq!(shapes[0].rows.len(), 9);
    for row in &shapes[0].rows {
        let eta = (f64::from(row.row) + 0.5) / 72.0 - 1.0;
        let amplitude = f64::from(row.x_px) * f64::from(row.x_phase_rad - 1.0).cos();
        assert!((amplitude - 0.3 * eta).abs() < 0.01, "{row:?}");
        assert!(row.y_px == 0.0);
    }
}

/// Where all edges lean one way, motion across them is told and nothing else.
#[test]
fn edges_that_lean_one_way_tell_the_motion_across_them() {
    let angle = 0.6_f64;
    let report = leaning(5, angle.tan(), |t| {
        let s = (TAU * 131.9 * t).sin();
        [0.2 * s, 0.05 * s]
    });
    let peak = only(&report, 0.0, "edges that lean");
    let motion = peak.motion.unwrap();
    assert!(motion.x_px.is_none() && motion.y_px.is_none() && motion.y_phase_rad.is_none());
    assert!((f64::from(motion.across_rad.unwrap()) - angle).abs() < 2e-3);
    let averaged = 131.9 * TAU * 0.5 * 90e-6 * 5.0;
    let across = (0.2 * angle.cos() + 0.05 * angle.sin()) * averaged / averaged.sin();
    assert!(
        (f64::from(peak.amplitude_px) / across - 1.0).abs() < 0.01,
        "{peak:?}"
    );
}

/// Upright edges tell x, and nothing of y.
#[test]
fn upright_edges_tell_x_alone() {
    let report = leaning(6, 0.0, |t| [0.2 * (TAU * 131.9 * t).sin(), 0.1]);
    let peak = only(&report, 0.0, "upright edges");
    let motion = peak.motion.unwrap();
    assert_eq!(motion.x_px, Some(peak.amplitude_px));
    assert!(motion.y_px.is_none() && motion.across_rad.is_none());
}
