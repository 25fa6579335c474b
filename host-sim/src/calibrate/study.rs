//! Calibrations of simulated cameras: are they right, and do their standard deviations say how right?

use std::fmt::Write;

use super::rows::Collector;
use super::{Calibration, Light, Refusal, calibrate};
use crate::sim::{Camera, Config, Led, PixelBuffer, Scene, SimError};

/// One condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// The light, Hz.
    pub led_hz: f64,
    /// Share of its period that it is on.
    pub duty: f64,
    /// Share of its flashes that fail.
    pub missing: f64,
    /// Exposure of a row, µs.
    pub exposure_us: f64,
    /// Frames, at 29.97 a second.
    pub frames: u32,
}

/// The conditions of the table.
pub const CONDITIONS: [Condition; 7] = {
    let usual = Condition {
        led_hz: 1000.0,
        duty: 0.5,
        missing: 0.0,
        exposure_us: 200.0,
        frames: 30,
    };
    [
        usual,
        Condition {
            led_hz: 500.0,
            ..usual
        },
        Condition {
            led_hz: 2000.0,
            exposure_us: 100.0,
            ..usual
        },
        Condition { duty: 0.2, ..usual },
        Condition {
            exposure_us: 60.0,
            ..usual
        },
        Condition {
            missing: 0.1,
            ..usual
        },
        Condition { frames: 1, ..usual },
    ]
};

/// Line time of the simulated camera, s.
const LINE_TIME_S: f64 = 33.67e-6;

/// Films the light and calibrates.
///
/// # Errors
/// [`SimError`] for an impossible configuration; a [`Refusal`] is the inner result.
pub fn run(condition: &Condition, seed: u64) -> Result<Result<Calibration, Refusal>, SimError> {
    let mut config = Config {
        seed,
        frames: condition.frames,
        scene: Scene::Plain,
        ..Config::default()
    };
    (config.sensor.cols, config.sensor.rows) = (64, 480);
    config.sensor.line_time_ps = (LINE_TIME_S * 1e12).round() as u32;
    config.sensor.fps = 29.97;
    config.sensor.exposure_ns = (condition.exposure_us * 1e3) as u32;
    config.light.led = Some(Led {
        hz: condition.led_hz,
        duty: condition.duty,
        phase: 0.37 * seed as f64 % 1.0,
        off_level: 0.0,
        missing: condition.missing,
    });
    let fps = config.sensor.fps;
    let camera = Camera::new(config)?;
    let mut collector = Collector::new(64, 255);
    let mut times = Vec::new();
    for frame in camera.frames() {
        times.push(frame.start_ns as f64 * 1e-9);
        let values: Vec<u16> = match frame.pixels {
            PixelBuffer::U8(p) => p.iter().map(|&v| u16::from(v)).collect(),
            PixelBuffer::U16(p) => p,
        };
        collector.push(values.chunks_exact(64));
    }
    let recording = collector.finish((times.len() > 1).then_some(times), Some(fps));
    Ok(calibrate(
        &recording,
        Light::Known {
            hz: condition.led_hz,
            hz_sd: 0.0,
            switched: true,
        },
    ))
}

/// `seeds` recordings of every condition: rms error, stated standard deviation, and their ratio, as Markdown.
///
/// # Errors
/// [`SimError`] for an impossible configuration.
pub fn markdown(seeds: u64) -> Result<String, SimError> {
    let mut text = format!(
        "Line time of {:.2} µs, 480 rows of 64 columns, 29.97 fps, {seeds} recordings each\n\n\
         | LED Hz | duty | flashes missing | exposure µs | frames | rms error (relative) | stated sd | error / sd (rms) | refused |\n\
         | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n",
        1e6 * LINE_TIME_S
    );
    for c in &CONDITIONS {
        let (mut errors, mut stated, mut ratios, mut right) = (0.0, 0.0, 0.0, 0.0);
        for seed in 1..=seeds {
            if let Ok(found) = run(c, seed)? {
                let error = (found.line_time_s - LINE_TIME_S) / LINE_TIME_S;
                let sd = found.line_time_s_sd / LINE_TIME_S;
                errors += error * error;
                stated += sd * sd;
                ratios += (error / sd).powi(2);
                right += 1.0;
            }
        }
        let rms = |sum: f64| (sum / f64::max(right, 1.0)).sqrt();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {:.0} % | {} | {} | {:.1e} | {:.1e} | {:.2} | {} |",
            c.led_hz,
            c.duty,
            100.0 * c.missing,
            c.exposure_us,
            c.frames,
            rms(errors),
            rms(stated),
            rms(ratios),
            seeds - right as u64
        );
    }
    Ok(text)
}
