//! Made-up samples with a fourth of the time blank.

use std::f64::consts::TAU;

use rowtone::camera::Timing;
use rowtone::report::{Motion, Peak};
use rowtone::timeline::Vertical;
use rowtone_chance::{Chance, XorShiftStar};

use super::*;

/// Noise of a sample, px, along x; along y it is twice that.
const NOISE_PX: f64 = 0.01;

const FPS: f64 = 50.0;
const SLOTS: u16 = 60;

/// 60 samples of 250 µs each, exposed for 1 ms.
fn group() -> Group {
    Group::new(Timing::new(250_000_000, 1_000_000, SLOTS).unwrap(), 1).unwrap()
}

/// Tones along x and y: Hz, and px in truth.
const TONES: [(f64, [f64; 2]); 2] = [(77.3, [0.3, 0.1]), (411.0, [0.02, 0.0])];

fn peak((hz, [x, y]): (f64, [f64; 2])) -> Peak {
    Peak {
        hz: hz as f32,
        hz_sd: 0.001,
        amplitude_px: x.hypot(y) as f32,
        amplitude_px_sd: 0.001,
        snr_db: 40.0,
        ambiguous: false,
        track: 1,
        harmonic: None,
        motion: Some(Motion {
            x_px: Some(x as f32),
            y_px: Some(y as f32),
            ..Motion::STEADY
        }),
    }
}

/// Four windows of a second; `told` are the peaks of their reports.
fn spectrum(axes: Axes, told: &[Peak]) -> Spectrum {
    let mut dice = XorShiftStar(11);
    let mut periodogram = Periodogram::new(group(), axes, (5.0, 800.0));
    periodogram.start(7_000_000_000);
    for frame in 0..200_u32 {
        let start_s = f64::from(frame) / FPS;
        for slot in 0..SLOTS {
            let t = start_s + group().middle_ns(slot) as f64 * 1e-9;
            let at = |axis: usize| -> f64 {
                let each = TONES.iter().map(|(hz, px)| {
                    let left = f64::from(group().exposed(*hz as f32));
                    px[axis] * left * (TAU * hz * t + axis as f64).sin()
                });
                each.sum()
            };
            let y = at(1) + 2.0 * NOISE_PX * dice.normal();
            let coupling = if axes == Axes::Xy { 0.1 } else { 0.0 };
            let x = at(0) + coupling * at(1) + NOISE_PX * dice.normal();
            periodogram.sample(&Sample {
                frame,
                slot,
                curvature: Default::default(),
                time_ns: 7_000_000_000 + (t * 1e9) as i64,
                shift_px: (x + 0.01 * f64::from(slot)) as f32,
                information_per_px2: NOISE_PX.powi(-2) as f32,
                spread: Default::default(),
                vertical: (axes == Axes::Xy).then(|| Vertical {
                    shift_px: y as f32,
                    information_per_px2: (2.0 * NOISE_PX).powi(-2) as f32,
                    coupling: coupling as f32,
                    ..Vertical::default()
                }),
            });
        }
        if frame % 50 == 49 {
            periodogram.report(&Report {
                time_ms: u64::from(frame + 1) * 20,
                window_s: 1.0,
                fps: FPS as f32,
                peaks: told.iter().copied().collect(),
                ..Report::EMPTY
            });
        }
    }
    periodogram.spectrum().unwrap()
}

fn at(spectrum: &Spectrum, px: &[f64], hz: f64) -> f64 {
    px[spectrum.hz.partition_point(|&f| f < hz - 0.0625)]
}

#[test]
fn tones_stand_as_large_as_they_are_over_the_noise_as_it_is() {
    let found = spectrum(Axes::Xy, &TONES.map(peak));
    assert_eq!((found.hz[0], found.hz[1]), (5.0, 5.125));
    assert_eq!(found.hz.last(), Some(&800.0));
    for (axis, noise) in [(0, NOISE_PX * 1.02), (1, 2.0 * NOISE_PX)] {
        let of = found.axes[axis].as_ref().unwrap();
        for (hz, px) in TONES {
            if px[axis] > 0.0 {
                let told = at(&found, &of.amplitude_px, hz);
                // A sixteenth of a cell beside it 0.3 % is missing, and the noise adds.
                assert!((told / px[axis] - 1.0).abs() < 0.02, "{axis} {hz}: {told}");
            }
        }
        // 3/2 of 4·noise²/N for Hann's window, the exposure undone.
        let white = noise * (6.0 / (FPS * f64::from(SLOTS))).sqrt();
        for hz in [40.0, 77.3, 300.0, 700.0] {
            let want = white / f64::from(group().exposed(hz as f32)).abs().max(LEAST_LEFT);
            let told = at(&found, &of.floor_px, hz);
            // Four windows of 6 to 56 cells, three of which count as two: 13 % at most, and 3 of them.
            assert!(
                (told / want - 1.0).abs() < 0.39,
                "{axis} {hz}: {told}, {want}"
            );
        }
        let inside = found.hz.iter().zip(&of.amplitude_px);
        let squares: Vec<f64> = inside
            .filter(|(hz, _)| (103.0..147.0).contains(*hz))
            .map(|(_, px)| px * px)
            .collect();
        let told = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        // No image at 127.3 Hz: the noise alone, some 100 independent squares, a deviation of 5 % and 4 of them.
        let exposed = f64::from(group().exposed(125.0));
        assert!((told * exposed / white - 1.0).abs() < 0.2, "{axis}: {told}");
    }
}

#[test]
fn a_tone_that_nobody_tells_of_is_there_all_the_same() {
    let found = spectrum(Axes::X, &[]);
    assert!(found.axes[1].is_none());
    let x = found.axes[0].as_ref().unwrap();
    let told = at(&found, &x.amplitude_px, 77.3);
    // The slots' means take a little of it.
    assert!((told / 0.3 - 1.0).abs() < 0.03, "{told}");
    assert!(at(&found, &x.floor_px, 600.0) < 0.003);
}

#[test]
fn nothing_seen_is_no_spectrum() {
    let mut periodogram = Periodogram::new(group(), Axes::Xy, (5.0, 800.0));
    assert!(periodogram.spectrum().is_none());
    periodogram.report(&Report::EMPTY);
    assert!(periodogram.spectrum().is_none());
}
