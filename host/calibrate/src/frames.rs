//! From frame to frame: the frame period, and whether the camera reads its rows down or up.
//!
//! With the light's frequency known, the phase of the stripes advances by f·Δt from one frame to the next where
//! row 0 is read first, and goes back by as much where it is read last. Only the fraction of a period can be seen,
//! so the nominal frame times must be right to well within half a period of the light.

use rowtone_linear::median;
use std::f64::consts::TAU;

/// Clock error of the nominal frame times that is allowed for: 30 for 29.97 fps, and crystals.
pub const CLOCK_TOLERANCE: f64 = 0.0015;

/// A step from frame to frame further from the others than so many standard deviations is a lost frame.
const FURTHEST_STEP: f64 = 8.0;
/// Steps are not asked to be alike by more than this, periods.
const LEAST_STEP_SD: f64 = 1e-4;

/// Which row is read first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rolling {
    /// Row 0: the usual.
    Down,
    /// The last row.
    Up,
}

/// What the phases of the frames say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Direction and true length of the nominal time scale.
    Clear {
        /// Which row is read first.
        rolling: Rolling,
        /// True time over nominal time.
        scale: f64,
        /// Its standard deviation.
        scale_sd: f64,
    },
    /// Down and up both explain the phases, or the nominal times are not good enough to count periods.
    Undecided,
    /// Neither does: the frequency of the light or the frame rate is wrong.
    Contradiction {
        /// Part of a period by which the stripes move in a frame, −0.5 to 0.5.
        seen: f64,
        /// What the frequency and the frame rate call for.
        expected: f64,
    },
    /// The frames do not keep one common phase: lost frames, a light that is not steady.
    Incoherent,
}

/// Reads the phases (cycles, of the fundamental, each known to `phase_sd`) of frames at nominal times (s) under a light
/// of `light_hz`.
pub fn judge(phases: &[f64], times_s: &[f64], light_hz: f64, phase_sd: f64) -> Verdict {
    let count = phases.len().min(times_s.len());
    if count < 3 {
        return Verdict::Undecided;
    }
    let span = times_s[count - 1] - times_s[0];
    let step = span / (count - 1) as f64;
    // Periods of error that the clock's tolerance makes in one frame.
    let tolerance = CLOCK_TOLERANCE * light_hz * step;
    let [down, up] = [1.0, -1.0].map(|sign| {
        best_scale(
            phases,
            times_s,
            light_hz,
            sign,
            0.5 / (light_hz * step),
            phase_sd,
        )
    });
    let keeps_time = |s: &Scale, sign: f64| {
        s.coherence > 0.8 && is_steady(phases, times_s, sign * s.scale * light_hz, phase_sd)
    };
    let (down_keeps, up_keeps) = (keeps_time(&down, 1.0), keeps_time(&up, -1.0));
    if !down_keeps && !up_keeps {
        return Verdict::Incoherent;
    }
    let margin = 3.0 * down.scale_sd * light_hz * step;
    let fits = |d: &Scale| (d.scale - 1.0).abs() <= CLOCK_TOLERANCE + 3.0 * d.scale_sd;
    if tolerance + margin > 0.25 {
        return Verdict::Undecided;
    }
    match (down_keeps && fits(&down), up_keeps && fits(&up)) {
        (true, true) => Verdict::Undecided,
        (true, false) => down.verdict(Rolling::Down),
        (false, true) => up.verdict(Rolling::Up),
        (false, false) => Verdict::Contradiction {
            seen: wrap(light_hz * step * down.scale),
            expected: wrap(light_hz * step),
        },
    }
}

/// Whether every step from frame to frame is like the others. A lost frame that the times do not tell of makes one that is
/// not, however well a straight line of another slope may fit them all.
fn is_steady(phases: &[f64], times_s: &[f64], hz: f64, phase_sd: f64) -> bool {
    let steps: Vec<f64> = phases
        .windows(2)
        .zip(times_s.windows(2))
        .map(|(p, t)| p[1] - p[0] - hz * (t[1] - t[0]))
        .collect();
    let (re, im) = steps.iter().fold((0.0, 0.0), |(re, im), s| {
        (re + (TAU * s).cos(), im + (TAU * s).sin())
    });
    let centre = im.atan2(re) / TAU;
    let off: Vec<f64> = steps.iter().map(|s| wrap(s - centre)).collect();
    let typical = median(&off);
    let away: Vec<f64> = off.iter().map(|o| (o - typical).abs()).collect();
    // The scatter of most steps, for times that are not exact: 1.48 times the median deviation is a standard deviation.
    let sd = (1.48 * median(&away)).max(phase_sd * 2.0_f64.sqrt());
    away.iter()
        .all(|a| *a < FURTHEST_STEP * sd.max(LEAST_STEP_SD))
}

struct Scale {
    scale: f64,
    scale_sd: f64,
    coherence: f64,
}

impl Scale {
    fn verdict(&self, rolling: Rolling) -> Verdict {
        Verdict::Clear {
            rolling,
            scale: self.scale,
            scale_sd: self.scale_sd,
        }
    }
}

/// −0.5 to 0.5.
fn wrap(cycles: f64) -> f64 {
    cycles - cycles.round()
}

/// The time scale within `reach` of 1 that makes `phases` advance most steadily, then a straight-line fit.
fn best_scale(
    phases: &[f64],
    times_s: &[f64],
    light_hz: f64,
    sign: f64,
    reach: f64,
    phase_sd: f64,
) -> Scale {
    let count = phases.len().min(times_s.len());
    let (first, last) = (times_s[0], times_s[count - 1]);
    let expected = |i: usize| sign * light_hz * (times_s[i] - first);
    let coherence = |scale: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (i, phase) in phases.iter().enumerate().take(count) {
            let (s, c) = (TAU * (phase - scale * expected(i))).sin_cos();
            re += c;
            im += s;
        }
        (re.hypot(im) / count as f64, im.atan2(re) / TAU)
    };
    let fine = 0.1 / (light_hz * (last - first));
    let steps = (reach / fine).ceil() as i64;
    // From the middle outwards, so that equal ones are decided for the nominal scale.
    let mut best = (1.0, coherence(1.0).0);
    for k in 1..=steps {
        for scale in [1.0 + k as f64 * fine, 1.0 - k as f64 * fine] {
            let c = coherence(scale).0;
            if c > best.1 + 1e-9 {
                best = (scale, c);
            }
        }
    }
    let (mut scale, mut sd) = (best.0, 0.0);
    for _ in 0..3 {
        let mean_phase = coherence(scale).1;
        let mean_x = (0..count).map(expected).sum::<f64>() / count as f64;
        let off = |i: usize| wrap(phases[i] - scale * expected(i) - mean_phase);
        let sxx: f64 = (0..count).map(|i| (expected(i) - mean_x).powi(2)).sum();
        let sxy: f64 = (0..count).map(|i| (expected(i) - mean_x) * off(i)).sum();
        let mean_off = (0..count).map(off).sum::<f64>() / count as f64;
        let slope = sxy / sxx;
        let rss: f64 = (0..count)
            .map(|i| (off(i) - mean_off - slope * (expected(i) - mean_x)).powi(2))
            .sum();
        scale += slope;
        // Three frames can lie on a line by chance: no less than what the phases are known to.
        sd = (rss / (count as f64 - 2.0)).max(phase_sd * phase_sd).sqrt() / sxx.sqrt();
    }
    Scale {
        scale,
        scale_sd: sd,
        coherence: coherence(scale).0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases(count: usize, period: f64, light_hz: f64, sign: f64) -> Vec<f64> {
        (0..count)
            .map(|n| sign * light_hz * period * n as f64 + 0.3 + 1e-4 * (n as f64 * 7.7).sin())
            .collect()
    }

    fn nominal(count: usize, fps: f64) -> Vec<f64> {
        (0..count).map(|n| n as f64 / fps).collect()
    }

    #[test]
    fn direction_and_period() {
        for (sign, rolling) in [(1.0, Rolling::Down), (-1.0, Rolling::Up)] {
            let verdict = judge(
                &phases(30, 1.0 / 29.97, 1000.0, sign),
                &nominal(30, 30.0),
                1000.0,
                1e-4,
            );
            let Verdict::Clear {
                rolling: found,
                scale,
                scale_sd,
            } = verdict
            else {
                panic!("{verdict:?}")
            };
            assert_eq!(found, rolling);
            assert!(
                (scale - 30.0 / 29.97).abs() < 5.0 * scale_sd + 1e-9,
                "{scale} ± {scale_sd}"
            );
        }
    }

    #[test]
    fn what_cannot_be_told_is_not() {
        // A whole number of periods a frame: up and down look the same.
        assert_eq!(
            judge(
                &phases(30, 0.04, 1000.0, 1.0),
                &nominal(30, 25.0),
                1000.0,
                1e-4
            ),
            Verdict::Undecided
        );
        // A light 10 % off.
        let verdict = judge(
            &phases(30, 1.0 / 24.0, 1000.0, 1.0),
            &nominal(30, 24.0),
            1100.0,
            1e-4,
        );
        assert!(
            matches!(verdict, Verdict::Contradiction { .. }),
            "{verdict:?}"
        );
        // Phases at random.
        let random: Vec<f64> = (0..40).map(|n| (n * n) as f64 * 0.618).collect();
        assert_eq!(
            judge(&random, &nominal(40, 30.0), 1000.0, 1e-4),
            Verdict::Incoherent
        );
    }
    /// Two of 32 frames lost: a line of another slope fits within a tenth of a period, and once passed for the frame period.
    #[test]
    fn lost_frames_that_nobody_tells_of_are_noticed() {
        let mut all = phases(32, 1.0 / 29.97, 1000.0, 1.0);
        assert!(matches!(
            judge(&all, &nominal(32, 29.97), 1000.0, 1e-4),
            Verdict::Clear { .. }
        ));
        for lost in [3, 9, 15, 30] {
            let mut phases = all.clone();
            phases.remove(lost);
            let verdict = judge(&phases, &nominal(31, 29.97), 1000.0, 1e-4);
            assert_eq!(verdict, Verdict::Incoherent, "{lost}");
        }
        all.drain(10..12);
        let verdict = judge(&all, &nominal(30, 29.97), 1000.0, 1e-4);
        assert_eq!(verdict, Verdict::Incoherent);
    }
}
