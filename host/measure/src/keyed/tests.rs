use rowtone::camera::Timing;
use rowtone::report::Warnings;
use rowtone::timeline::Vertical;

use super::*;

/// 240 rows of 60 µs, ten of them a sample; key frames every half second for eight seconds, as of a phone at 60 fps.
const EVERY_S: f64 = 0.5;
const KEYS: u32 = 16;
const NOISE_PX: f64 = 0.01;

fn group() -> Group {
    Group::new(Timing::new(60_000_000, 500_000, 240).unwrap(), 10).unwrap()
}

/// Gaussian enough, from a linear congruential generator.
struct Chance(u64);

impl Chance {
    fn px(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            sum += (self.0 >> 40) as f64 / (1 << 24) as f64 - 0.5;
        }
        NOISE_PX * sum
    }
}

/// Samples of the key frames of an object that moves by (x, y) at a time, s; each group of rows has an offset of its own.
fn keys(seed: u64, motion: impl Fn(f64) -> [f64; 2]) -> Vec<Sample> {
    let (group, mut chance) = (group(), Chance(seed));
    let mut samples = Vec::new();
    for key in 0..KEYS {
        for slot in 0..group.slots() {
            let t_s = f64::from(key) * EVERY_S + group.middle_ns(slot) as f64 * 1e-9;
            let [x, y] = motion(t_s);
            let coupling = 0.3 * (f64::from(slot) * 0.7).sin();
            let offset = 0.1 * (f64::from(slot) * 1.3).cos();
            let information_per_px2 = (NOISE_PX * NOISE_PX).recip() as f32;
            samples.push(Sample {
                frame: key * 30,
                slot,
                curvature: Default::default(),
                time_ns: (t_s * 1e9) as i64,
                shift_px: (x + coupling * y + offset + chance.px()) as f32,
                information_per_px2,
                vertical: Some(Vertical {
                    shift_px: (y + chance.px()) as f32,
                    information_per_px2,
                    coupling: coupling as f32,
                    ..Vertical::default()
                }),
                spread: group.even_spread(),
            });
        }
    }
    samples
}

/// Windows of a second in which all frames show these peaks, Hz and px.
fn held(peaks: &[(f32, f32)]) -> Held {
    let peak = |&(hz, amplitude_px): &(f32, f32)| Peak {
        hz,
        hz_sd: 0.01,
        amplitude_px,
        amplitude_px_sd: 0.001,
        snr_db: 30.0,
        ambiguous: false,
        track: 1,
        harmonic: None,
        motion: None,
    };
    let mut held = Held::default();
    held.note_frame(0);
    for k in 2..=16_u64 {
        let report = Report {
            time_ms: k * 500,
            window_s: 1.0,
            fps: 60.0,
            peaks: peaks.iter().map(peak).collect(),
            warnings: Warnings::of(Warning::Compressed),
            ..Report::EMPTY
        };
        held.push(report, Vec::new());
    }
    held
}

fn judged(peaks: &[(f32, f32)], keys: &[Sample]) -> Vec<Report> {
    let judged = held(peaks).judged(keys, group(), (1.0, 800.0));
    judged.into_iter().map(|(report, _)| report).collect()
}

fn tone(hz: f64, px: f64) -> impl Fn(f64) -> f64 {
    move |t_s| px * (std::f64::consts::TAU * hz * t_s + 0.7).sin()
}

/// All frames show half of the tone, its image 60 Hz away and a third harmonic that is none. Of eight seeds the amplitude of
/// every window is within four of its standard deviations, of which each window has about one in 16 000 outside.
#[test]
fn amplitudes_come_back_and_what_the_codec_made_goes() {
    for seed in 1..=8 {
        let (first, second) = (tone(83.4, 0.1), tone(131.7, 0.05));
        let keys = keys(seed, |t| [first(t), second(t)]);
        let seen = [(83.41, 0.05), (23.4, 0.03), (250.2, 0.02), (131.69, 0.03)];
        for report in judged(&seen, &keys) {
            let peaks = &report.peaks;
            assert_eq!(peaks.len(), 2, "{seed}: {peaks:?}");
            for (peak, hz, px) in [(peaks[0], 83.4_f32, 0.1), (peaks[1], 131.7, 0.05)] {
                // What exposure and grouping took is put back.
                let px = px / group().attenuation(hz);
                assert!(!peak.ambiguous && (peak.hz - hz).abs() < 0.02, "{peak:?}");
                let off = (peak.amplitude_px - px).abs();
                assert!(
                    off < 4.0 * peak.amplitude_px_sd,
                    "{seed}: {peak:?} for {px}"
                );
                assert!(peak.amplitude_px_sd < 0.1 * px, "{peak:?}");
            }
            assert!(!report.warnings.contains(Warning::Compressed));
        }
    }
}

/// Of sixteen still recordings not one report has a tone that is sure; a search names one in some 500.
#[test]
fn nothing_moves_where_only_the_codec_does() {
    for seed in 1..=16 {
        let seen = [(57.1, 0.02), (3.1, 0.015), (117.2, 0.01)];
        for report in judged(&seen, &keys(seed, |_| [0.0; 2])) {
            assert!(
                report.peaks.iter().all(|peak| peak.ambiguous),
                "{:?}",
                report.peaks
            );
        }
    }
}

#[test]
fn with_two_key_frames_nothing_is_confirmed_but_what_is_large() {
    let keys = keys(1, |t| [tone(83.3, 0.1)(t), 0.0]);
    let two = &keys[..2 * usize::from(group().slots())];
    for report in judged(&[(83.31, 0.05)], two) {
        assert!(report.peaks[0].ambiguous && report.warnings.contains(Warning::Compressed));
    }
    for report in judged(&[(83.31, 0.9), (23.3, 0.1)], two) {
        assert!(!report.peaks[0].ambiguous);
    }
}

/// Key frames at 2 Hz see 100 Hz always at the same place: they do not refute it.
#[test]
fn a_tone_that_stands_still_in_key_frames_stays_and_is_ambiguous() {
    let (still, other) = (tone(100.0, 0.1), tone(83.3, 0.1));
    let keys = keys(3, |t| [still(t) + other(t), 0.0]);
    for report in judged(&[(100.01, 0.06), (83.31, 0.05)], &keys) {
        let at = |hz: f32| report.peaks.iter().find(|peak| (peak.hz - hz).abs() < 0.05);
        assert!(
            at(100.0).is_some_and(|peak| peak.ambiguous),
            "{:?}",
            report.peaks
        );
        assert!(
            at(83.3).is_some_and(|peak| !peak.ambiguous),
            "{:?}",
            report.peaks
        );
        assert!(report.warnings.contains(Warning::Compressed));
    }
}
