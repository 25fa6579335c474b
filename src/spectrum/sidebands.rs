//! Lines around a tone that are its own swinging: modulation, and a speed that is not steady.
//!
//! A tone whose amplitude swings at f_m, A·(1 + m·cos(2πf_m·t + ψ))·sin(2πf·t + φ), is three lines: f with A, and f ± f_m
//! with m·A/2 each, whose phases mirror each other, φ₊ + φ₋ = 2φ; where its phase swings instead, φ₊ + φ₋ = 2φ + π
//! (Lyons, *Understanding Digital Signal Processing*, 3rd ed., section 9.1, has both as rotating arrows). Three lines
//! that fit are told as one tone with its modulation. Three or more that lie within a few cells and fit nothing are
//! one tone whose frequency wanders: a group with a centroid and a spread.

use num_complex::Complex32 as Complex;

use crate::math::sqrtf;
use crate::report::{MAX_PEAKS, Modulation, Peak};

/// A sideband of more than this share of its carrier is a tone of its own: at full modulation it is half.
const MOST_SHARE: f32 = 0.6;

/// Sidebands are as large as each other to this share of their mean, besides what they are not known better than.
const AS_LARGE: f32 = 0.15;

/// Their phases mirror each other to so much, rad, besides what they are not known better than ...
const IN_PHASE: f32 = 0.35;

/// ... and where they are known no better than this, rad, nothing is told by them.
const VAGUE: f32 = 0.9;

/// Their frequencies do to so many turns a window length.
const AS_FAR: f32 = 0.05;

/// Standard deviations that count as "not known better".
const SURE: f32 = 3.0;

/// Lines of a group are no farther from their neighbours than this, turns a window length, ...
const NEIGHBOURS: f32 = 3.0;

/// ... and are at least so many.
const LEAST_LINES: usize = 3;

/// A tone that was found, and its complex amplitude in the middle of the window along its main axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) peak: Peak,
    pub(super) hz_per_s: f32,
    pub(super) amplitude: Complex,
    pub(super) axis: usize,
}

/// The tones of a window, the largest first.
pub(super) type List = heapless::Vec<Found, MAX_PEAKS>;

/// What is steady, and may be a part of a tone that is not.
fn is_line(found: &Found) -> bool {
    let changes = |m: &crate::report::Motion| m.decay_s.is_some() || m.hz_per_s.is_some();
    !found.peak.motion.as_ref().is_some_and(changes)
}

/// How far the arrow's angle may be off, rad; `None` where that tells nothing.
fn phase_slack(carrier: &Found, sidebands: [&Found; 2]) -> Option<f32> {
    let variance = |f: &Found| square(f.peak.amplitude_px_sd / f.peak.amplitude_px.max(1e-12));
    let sum = 4.0 * variance(carrier) + variance(sidebands[0]) + variance(sidebands[1]);
    let slack = IN_PHASE + SURE * sqrtf(sum);
    (slack < VAGUE).then_some(slack)
}

fn square(v: f32) -> f32 {
    v * v
}

/// The modulation that these two lines around a carrier are, if they are one.
fn modulation(carrier: &Found, above: &Found, below: &Found, length_s: f32) -> Option<Modulation> {
    let [c, a, b] = [&carrier.peak, &above.peak, &below.peak];
    let swing_hz = 0.5 * (a.hz - b.hz);
    let sd_hz = sqrtf(4.0 * square(c.hz_sd) + square(a.hz_sd) + square(b.hz_sd));
    let mirrored = (a.hz + b.hz - 2.0 * c.hz).abs() < SURE * sd_hz + AS_FAR / length_s;
    let mean_px = 0.5 * (a.amplitude_px + b.amplitude_px);
    let sd_px = sqrtf(square(a.amplitude_px_sd) + square(b.amplitude_px_sd));
    let alike = (a.amplitude_px - b.amplitude_px).abs() < AS_LARGE * mean_px + SURE * sd_px;
    let small = a.amplitude_px.max(b.amplitude_px) < MOST_SHARE * c.amplitude_px;
    let same_axis = carrier.axis == above.axis && carrier.axis == below.axis;
    if !(mirrored && alike && small && same_axis && swing_hz < 0.5 * c.hz) {
        return None;
    }
    let slack = phase_slack(carrier, [above, below])?;
    let unit = carrier.amplitude.conj();
    let turned = above.amplitude * below.amplitude * unit * unit;
    let angle = libm::atan2f(turned.im, turned.re).abs();
    let of_phase = core::f32::consts::PI - angle < slack;
    (angle < slack || of_phase).then_some(Modulation {
        hz: swing_hz,
        depth: 2.0 * mean_px / c.amplitude_px,
        of_phase,
    })
}

/// Tells three lines that are one modulated tone as that; `list` is sorted, the largest first.
pub(super) fn name_modulations(list: &mut List, length_s: f32) {
    let mut i = 0;
    while i < list.len() {
        if let Some((told, [j, k])) = strongest_modulation(list, i, length_s) {
            if let Some(motion) = list[i].peak.motion.as_mut() {
                motion.modulation = Some(told);
            }
            // The later one first, so that the other keeps its place.
            list.remove(j.max(k));
            list.remove(j.min(k));
        }
        i += 1;
    }
}

/// The largest pair of sidebands of line `i`, and where they are in the list.
fn strongest_modulation(list: &List, i: usize, length_s: f32) -> Option<(Modulation, [usize; 2])> {
    let carrier = list
        .get(i)
        .filter(|f| is_line(f) && f.peak.motion.is_some())?;
    let mut best: Option<(Modulation, [usize; 2])> = None;
    for (j, above) in list
        .iter()
        .enumerate()
        .skip(i + 1)
        .filter(|(_, f)| is_line(f))
    {
        for (k, below) in list
            .iter()
            .enumerate()
            .skip(i + 1)
            .filter(|(_, f)| is_line(f))
        {
            if above.peak.hz < carrier.peak.hz || below.peak.hz > carrier.peak.hz {
                continue;
            }
            if let Some(told) = modulation(carrier, above, below, length_s)
                && best.is_none_or(|(b, _)| told.depth > b.depth)
            {
                best = Some((told, [j, k]));
            }
        }
    }
    best
}

/// Tells lines that crowd around a larger one, and fit no modulation, as one tone whose frequency wanders.
pub(super) fn name_groups(list: &mut List, length_s: f32) {
    let mut i = 0;
    while i < list.len() {
        name_group(list, i, length_s);
        i += 1;
    }
}

fn name_group(list: &mut List, i: usize, length_s: f32) {
    let Some(first) = list
        .get(i)
        .copied()
        .filter(|f| is_line(f) && f.peak.motion.is_some())
    else {
        return;
    };
    // From the largest outwards, as long as the next one is near.
    let (mut low_hz, mut high_hz) = (first.peak.hz, first.peak.hz);
    let reach_hz = NEIGHBOURS / length_s;
    let belongs = |f: &Found, low: f32, high: f32| {
        is_line(f)
            && f.axis == first.axis
            && f.peak.hz > low - reach_hz
            && f.peak.hz < high + reach_hz
    };
    for _ in 0..list.len() {
        for f in list.iter().skip(i) {
            if belongs(f, low_hz, high_hz) {
                (low_hz, high_hz) = (low_hz.min(f.peak.hz), high_hz.max(f.peak.hz));
            }
        }
    }
    let inside =
        |f: &Found| is_line(f) && f.axis == first.axis && (low_hz..=high_hz).contains(&f.peak.hz);
    let lines = || list.iter().skip(i).filter(|f| inside(f)).map(|f| &f.peak);
    if lines().count() < LEAST_LINES {
        return;
    }
    let power: f32 = lines().map(|p| square(p.amplitude_px)).sum();
    let moment: f32 = lines()
        .map(|p| square(p.amplitude_px) * (p.hz - first.peak.hz))
        .sum();
    let centroid_hz = moment / power.max(f32::MIN_POSITIVE);
    let variance: f32 = lines()
        .map(|p| square(p.amplitude_px) * square(p.hz - first.peak.hz - centroid_hz))
        .sum::<f32>()
        / power.max(f32::MIN_POSITIVE);
    let sd_px = sqrtf(lines().map(|p| square(p.amplitude_px_sd)).sum());
    let spread_hz = sqrtf(variance);
    // A wandering speed is sampled once in each of its cells.
    let sd_hz = spread_hz / sqrtf(lines().count() as f32);
    let mut at = list.len();
    while at > i + 1 {
        at -= 1;
        if inside(&list[at]) {
            list.remove(at);
        }
    }
    let peak = &mut list[i].peak;
    peak.hz = first.peak.hz + centroid_hz;
    peak.hz_sd = sd_hz.max(first.peak.hz_sd);
    peak.amplitude_px = sqrtf(power);
    peak.amplitude_px_sd = sd_px;
    if let Some(motion) = peak.motion.as_mut() {
        motion.spread_hz = Some(spread_hz);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Motion;

    fn line(hz: f32, px: f32, phase: f32) -> Found {
        Found {
            peak: Peak {
                hz,
                hz_sd: 0.002,
                amplitude_px: px,
                amplitude_px_sd: 0.0005,
                snr_db: 30.0,
                ambiguous: false,
                track: 0,
                harmonic: None,
                motion: Some(Motion {
                    x_px: Some(px),
                    x_px_sd: Some(0.0005),
                    phase_rad: phase,
                    ..Motion::STEADY
                }),
            },
            hz_per_s: 0.0,
            amplitude: Complex::new(px * phase.cos(), px * phase.sin()),
            axis: 0,
        }
    }

    fn told(lines: &[Found]) -> List {
        let mut list: List = lines.iter().copied().collect();
        name_modulations(&mut list, 1.0);
        name_groups(&mut list, 1.0);
        list
    }

    #[test]
    fn a_swinging_amplitude_is_one_tone() {
        let (phase, swing) = (0.7, 1.9);
        let list = told(&[
            line(83.3, 0.2, phase),
            line(88.3, 0.05, phase + swing),
            line(78.3, 0.05, phase - swing),
            line(140.0, 0.03, 0.0),
        ]);
        assert_eq!(list.len(), 2);
        let modulation = list[0].peak.motion.unwrap().modulation.unwrap();
        assert!((modulation.hz - 5.0).abs() < 1e-3 && (modulation.depth - 0.5).abs() < 1e-3);
        assert!(!modulation.of_phase);
    }

    #[test]
    fn a_swinging_phase_is_told_from_a_swinging_amplitude() {
        let list = told(&[
            line(83.3, 0.2, 0.7),
            line(88.3, 0.05, 1.0),
            line(78.3, 0.05, 0.4 + core::f32::consts::PI),
        ]);
        assert!(list[0].peak.motion.unwrap().modulation.unwrap().of_phase);
    }

    /// Shafts near each other, a comb of equal lines, sidebands that do not mirror each other.
    #[test]
    fn other_tones_stay_what_they_are() {
        let quarter = core::f32::consts::FRAC_PI_2;
        for lines in [
            [
                line(83.3, 0.2, 0.7),
                line(88.3, 0.05, 1.0),
                line(78.3, 0.05, 0.4 + quarter),
            ],
            [
                line(83.3, 0.2, 0.7),
                line(88.3, 0.05, 1.0),
                line(78.3, 0.02, 0.4),
            ],
            [
                line(83.3, 0.2, 0.7),
                line(88.3, 0.05, 1.0),
                line(77.9, 0.05, 0.4),
            ],
            [
                line(83.3, 0.2, 0.7),
                line(93.3, 0.19, 0.7),
                line(73.3, 0.19, 0.7),
            ],
        ] {
            assert_eq!(told(&lines).len(), 3);
        }
    }

    #[test]
    fn a_wandering_speed_is_one_group() {
        let list = told(&[
            line(200.0, 0.3, 0.0),
            line(201.5, 0.2, 2.0),
            line(198.2, 0.1, 1.0),
        ]);
        assert_eq!(list.len(), 1);
        let peak = &list[0].peak;
        assert!((peak.hz - 200.27).abs() < 0.1, "{}", peak.hz);
        assert!((peak.amplitude_px - 0.374).abs() < 1e-3);
        let spread = peak.motion.unwrap().spread_hz.unwrap();
        assert!((0.8..1.4).contains(&spread), "{spread}");
        // Two are two.
        assert_eq!(
            told(&[line(200.0, 0.3, 0.0), line(201.5, 0.2, 2.0)]).len(),
            2
        );
    }
}
