//! Calibrations of simulated cameras: right, refused or wrong, and do their standard deviations say how right?

use std::fmt::Write;

use host_sim::{Camera, Config, PixelBuffer, SimError};
use rowtone_calibrate::file::RollingName;
use rowtone_calibrate::rows::{Collector, Recording};
use rowtone_calibrate::{Calibration, Light, calibrate, vibration};

pub mod condition;

use condition::{Condition, Source};

/// Further than so many stated standard deviations is wrong. Chance does that once in 16 000 times.
const FURTHEST: f64 = 4.0;

/// What is judged, in the order of the table's columns. The read-out is so many line times: what is right of one is
/// right of the other.
pub const FIGURES: [&str; 4] = ["line time", "frame period", "blank time", "exposure"];

/// What became of one recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// All that was told is right.
    Right {
        /// Relative error of the line time.
        error: f64,
        /// Its stated standard deviation.
        sd: f64,
        /// Error over stated standard deviation of each of [`FIGURES`] that was told.
        off: [Option<f64>; FIGURES.len()],
    },
    /// Nothing was told, and why.
    Refused(String),
    /// Something that was told is not right.
    Wrong(String),
}

/// The recording number `seed` of a condition: its own noise, and the light's phase and (mains) frequency by chance.
fn config(condition: &Condition, seed: u64) -> Config {
    let mut config = condition.config.clone();
    config.seed = seed;
    // Two golden sequences: even over their range, and not in step with each other.
    let [a, b] = [0.618_033_988_75, 0.754_877_666_2].map(|g: f64| (g * seed as f64).fract());
    if let Some(led) = &mut config.light.led {
        // Whole periods too: which flashes fail hangs on their number.
        led.phase = a + 10_000.0 * seed as f64;
    }
    if let Some(flicker) = &mut config.light.flicker {
        flicker.phase_rad = std::f64::consts::TAU * a;
        // Mains keep to ±0.03 Hz of 50.
        flicker.hz *= 1.0 + 6e-4 * 3.0_f64.sqrt() * (2.0 * b - 1.0);
    }
    for tone in &mut config.motion.tones {
        tone.phase_rad = std::f64::consts::TAU * a;
    }
    config
}

/// Films it.
fn record(condition: &Condition, seed: u64) -> Result<Result<Recording, String>, SimError> {
    let config = config(condition, seed);
    let fps = config.sensor.fps;
    let width = config.sensor.cols as usize;
    let camera = Camera::new(config)?;
    let mut times = Vec::new();
    let mut pictures = Vec::new();
    for frame in camera.frames() {
        times.push(frame.start_ns as f64 * 1e-9);
        pictures.push(match frame.pixels {
            PixelBuffer::U8(p) => p.iter().map(|&v| u16::from(v)).collect::<Vec<u16>>(),
            PixelBuffer::U16(p) => p,
        });
    }
    if !condition.times {
        times = (0..times.len()).map(|n| n as f64 / fps).collect();
    }
    let times = (times.len() > 1).then_some(times);
    Ok(match condition.source {
        Source::Brightness => {
            let mut collector = Collector::new(width, 255);
            for picture in &pictures {
                collector.push(picture.chunks_exact(width));
            }
            Ok(collector.finish(times, Some(fps)))
        }
        Source::Displacement => {
            let pictures: Vec<_> = pictures.into_iter().map(|p| (p, width)).collect();
            vibration::displacements(&pictures)
                .map(|rows| Recording {
                    rows,
                    times_s: times,
                    fps: Some(fps),
                    saturated_share: 0.0,
                    black: None,
                    picture_rows: None,
                })
                .map_err(|why| why.to_string())
        }
    })
}

/// Films and calibrates.
///
/// # Errors
/// [`SimError`] for an impossible configuration.
pub fn run(condition: &Condition, seed: u64) -> Result<Outcome, SimError> {
    let recording = match record(condition, seed)? {
        Ok(recording) => recording,
        Err(why) => return Ok(Outcome::Refused(why)),
    };
    Ok(match calibrate(&recording, condition.light) {
        Err(refusal) => Outcome::Refused(refusal.to_string()),
        Ok(found) => judge(condition, &found),
    })
}

fn judge(condition: &Condition, found: &Calibration) -> Outcome {
    let sensor = &condition.config.sensor;
    let line_time_s = f64::from(sensor.line_time_ps) * 1e-12;
    if condition.hopeless {
        return Outcome::Wrong(format!("told {:.3} µs", 1e6 * found.line_time_s));
    }
    let rolling = if sensor.bottom_up {
        RollingName::Up
    } else {
        RollingName::Down
    };
    if found.rolling.is_some_and(|r| r != rolling) {
        return Outcome::Wrong("rolling direction".to_owned());
    }
    let period_s = 1.0 / sensor.fps;
    let one_rate = condition.config.rate_changes.is_empty();
    let told = [
        (Some(found.line_time_s), Some(found.line_time_s_sd)),
        (found.frame_period_s, found.frame_period_s_sd),
        (found.blank_s, found.blank_s_sd),
        (found.exposure_s, found.exposure_s_sd),
    ];
    let truth = [
        Some(line_time_s),
        // By the clock of an unknown light's frame times it is what they say.
        (one_rate && matches!(condition.light, Light::Known { .. })).then_some(period_s),
        one_rate.then_some(period_s - line_time_s * f64::from(sensor.rows)),
        Some(f64::from(sensor.exposure_ns) * 1e-9),
    ];
    let mut off = [None; FIGURES.len()];
    for (k, ((value, sd), truth)) in told.into_iter().zip(truth).enumerate() {
        if let (Some(value), Some(sd), Some(truth)) = (value, sd, truth) {
            // The simulator keeps its frames' starts in whole nanoseconds: so the mean period of its recording differs.
            let rounding = match k {
                1 | 2 => 0.5e-9 / f64::from(condition.config.frames.max(2) - 1),
                _ => 0.0,
            };
            let by = (value - truth) / sd.hypot(rounding);
            if by.abs() > FURTHEST {
                return Outcome::Wrong(format!(
                    "{} off by {by:+.1} standard deviations",
                    FIGURES[k]
                ));
            }
            off[k] = Some(by);
        }
    }
    Outcome::Right {
        error: found.line_time_s / line_time_s - 1.0,
        sd: found.line_time_s_sd / line_time_s,
        off,
    }
}

/// What became of many recordings of one condition.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Right, refused, wrong.
    pub counts: [u64; 3],
    /// Sums of the line time's error² and sd² over the right ones.
    sums: [f64; 2],
    /// Of each of [`FIGURES`]: how often it was told, and the sum of (error / sd)².
    off: [(u64, f64); FIGURES.len()],
    /// The first reason of each kind.
    pub reasons: Vec<String>,
}

impl Tally {
    /// Of the recordings `first..first + seeds`.
    ///
    /// # Errors
    /// [`SimError`] for an impossible configuration.
    pub fn of(condition: &Condition, first: u64, seeds: u64) -> Result<Self, SimError> {
        let mut tally = Self::default();
        for seed in first..first + seeds {
            match run(condition, seed)? {
                Outcome::Right { error, sd, off } => {
                    tally.counts[0] += 1;
                    for (sum, value) in tally.sums.iter_mut().zip([error, sd]) {
                        *sum += value * value;
                    }
                    for ((count, sum), by) in tally.off.iter_mut().zip(off) {
                        *count += u64::from(by.is_some());
                        *sum += by.unwrap_or(0.0).powi(2);
                    }
                }
                Outcome::Refused(why) => tally.count(1, "refused", &why),
                Outcome::Wrong(why) => tally.count(2, "WRONG", &why),
            }
        }
        Ok(tally)
    }

    fn count(&mut self, kind: usize, name: &str, why: &str) {
        if self.counts[kind] == 0 {
            let short: String = why.chars().take_while(|&c| c != ':').collect();
            self.reasons.push(format!("{name}: {short}"));
        }
        self.counts[kind] += 1;
    }

    /// Rms of the line time's relative error and of its stated standard deviation.
    pub fn rms(&self) -> [f64; 2] {
        self.sums
            .map(|sum| (sum / (self.counts[0] as f64).max(1.0)).sqrt())
    }

    /// Rms of error over stated standard deviation of one of [`FIGURES`], and where its true value lies with 95 %, were
    /// errors Gaussian: chi square by Wilson and Hilferty 1931. `None` where it was never told.
    pub fn ratio(&self, figure: usize) -> Option<(f64, [f64; 2])> {
        let (count, sum) = self.off[figure];
        let n = count as f64;
        let ratio = (sum / n.max(1.0)).sqrt();
        let quantile = |z: f64| (1.0 - 2.0 / (9.0 * n) + z * (2.0 / (9.0 * n)).sqrt()).powi(3);
        let range = [1.96, -1.96].map(|z| match quantile(z) {
            q if q > 0.0 => ratio / q.sqrt(),
            _ => f64::INFINITY,
        });
        (count > 0).then_some((ratio, range))
    }
}

/// Head of the table, as Markdown.
pub const HEAD: &str = "\
| condition | right | refused | wrong | rms error (relative) | stated sd | line time, read-out | frame period | blank time | exposure | why |
| :-- | --: | --: | --: | --: | --: | --: | --: | --: | --: | :-- |";

/// One line of the table.
///
/// # Errors
/// [`SimError`] for an impossible configuration.
pub fn row(condition: &Condition, first: u64, seeds: u64) -> Result<String, SimError> {
    let tally = Tally::of(condition, first, seeds)?;
    let [right, refused, wrong] = tally.counts;
    let mut text = format!("| {} | {right} | {refused} | {wrong} |", condition.name);
    // Writing to a string cannot fail.
    if right > 0 {
        let [error, sd] = tally.rms();
        let _ = write!(text, " {error:.1e} | {sd:.1e} |");
    } else {
        text.push_str(" | |");
    }
    for figure in 0..FIGURES.len() {
        let _ = match tally.ratio(figure) {
            Some((ratio, [least, most])) => {
                write!(text, " {ratio:.2} ({least:.2}–{most:.2}) |")
            }
            None => write!(text, " |"),
        };
    }
    let _ = write!(text, " {} |", tally.reasons.join("; "));
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chi square of ten degrees of freedom: 3.25 to 20.48 with 95 %.
    #[test]
    fn the_range_is_that_of_chi_square() {
        let tally = Tally {
            off: [(10, 10.0); FIGURES.len()],
            ..Tally::default()
        };
        let (ratio, [least, most]) = tally.ratio(0).unwrap();
        assert_eq!(ratio, 1.0);
        assert!((least - (10.0_f64 / 20.48).sqrt()).abs() < 0.01, "{least}");
        assert!((most - (10.0_f64 / 3.25).sqrt()).abs() < 0.02, "{most}");
    }
}
