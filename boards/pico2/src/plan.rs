//! What the settings and the camera's measured timing mean for the core.

use crate::capture::LINE_PIXELS;
use crate::clock::FrameClock;
use crate::hm01b0;
use crate::memory::{COLUMNS_PER_LINE, FRAMES, MAX_PASSES, rows_per_sample};
use rowtone::camera::Timing;
use rowtone::link::settings::{Limits, Region, Settings};
use rowtone::spectrum;
use rowtone::timeline::Group;
use rowtone::tracker;

/// Rows of a frame that are measured; the sensor sends a few more.
pub const ROWS: u16 = 240;

/// What this board can be set to.
pub const LIMITS: Limits = Limits {
    width: LINE_PIXELS as u16,
    height: ROWS,
    min_width: 32,
    // So that a window of the fastest camera set-up (64 frames a second) fits the memory.
    max_window_s: FRAMES as f32 / 64.0,
};

/// How it is set when it comes from the factory.
pub const DEFAULTS: Settings = Settings::DEFAULT;

/// The whole picture.
const WHOLE: Region = Region {
    x: 0,
    y: 0,
    width: LIMITS.width,
    height: LIMITS.height,
};

/// All that the core is configured by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// The part of the picture.
    pub roi: Region,
    /// The camera's timing, for the rows of that part.
    pub timing: Timing,
    /// Rows that make a sample.
    pub group: Group,
    /// What is looked for.
    pub spectrum: spectrum::Config,
}

impl Plan {
    /// From settings (checked against [`LIMITS`]) and a settled clock; `None` when the measured timing is
    /// beyond what the core takes.
    pub fn new(settings: &Settings, camera: &hm01b0::Config, clock: &FrameClock) -> Option<Self> {
        let roi = settings.roi.unwrap_or(WHOLE);
        let line_time_ps =
            u32::try_from(clock.period_ps() / u64::from(camera.frame_length_lines)).ok()?;
        let exposure_ns = u64::from(line_time_ps) * u64::from(camera.exposure_lines) / 1000;
        let timing =
            Timing::new(line_time_ps, u32::try_from(exposure_ns).ok()?, roi.height).ok()?;
        let spectrum = spectrum_config(settings);
        let period_ns = clock.period_ps() / 1000;
        let frames = u64::try_from(spectrum.window_ns)
            .ok()?
            .checked_div(period_ns)?
            + 1;
        let group =
            Group::new(timing, rows_per_sample(timing, u32::try_from(frames).ok()?)).ok()?;
        Some(Self {
            roi,
            timing,
            group,
            spectrum,
        })
    }

    /// For the tracker.
    pub fn tracker(&self) -> tracker::Config {
        tracker::Config {
            columns_per_line: COLUMNS_PER_LINE,
            ..tracker::Config::new(self.timing, self.roi.width)
        }
    }
}

/// The settings that concern the spectrum.
pub fn spectrum_config(settings: &Settings) -> spectrum::Config {
    let ns = |s: f32| (s * 1e9) as i64;
    spectrum::Config {
        window_ns: ns(settings.window_s),
        hop_ns: ns(settings.hop_s),
        min_hz: settings.min_hz,
        max_hz: settings.max_hz,
        max_peaks: settings.max_peaks.into(),
        false_alarm: settings.false_alarm,
        max_passes: MAX_PASSES,
        um_per_px: settings.um_per_px,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(period_ns: i64) -> FrameClock {
        let mut clock = FrameClock::new(period_ns);
        for n in 0..100 {
            clock.vsync(n * period_ns);
        }
        clock
    }

    #[test]
    fn default_settings_fit_the_memory() {
        let camera = hm01b0::Config::QVGA_8BIT;
        let plan = Plan::new(&DEFAULTS, &camera, &clock(17_472_000)).unwrap();
        assert_eq!(plan.timing.line_time_ps(), 67_200_000);
        assert_eq!(plan.timing.exposure_ns(), 537_600);
        assert_eq!(plan.spectrum.check(), Ok(()));
        assert_eq!(DEFAULTS.check(&LIMITS), Ok(()));
        assert_eq!(plan.tracker().width, 320);
        assert_eq!(DEFAULTS, Settings::default());
    }

    #[test]
    fn longest_window_and_a_part_of_the_picture() {
        let roi = Region {
            x: 10,
            y: 20,
            width: 64,
            height: 100,
        };
        let settings = Settings {
            window_s: LIMITS.max_window_s,
            roi: Some(roi),
            ..DEFAULTS
        };
        assert_eq!(settings.check(&LIMITS), Ok(()));
        let plan = Plan::new(&settings, &hm01b0::Config::QVGA_8BIT, &clock(17_472_000)).unwrap();
        assert_eq!(
            (
                plan.timing.rows(),
                plan.tracker().rows,
                plan.tracker().width
            ),
            (100, 100, 64)
        );
    }

    #[test]
    fn an_absurd_clock_is_no_plan() {
        let camera = hm01b0::Config::QVGA_8BIT;
        assert_eq!(
            Plan::new(&DEFAULTS, &camera, &FrameClock::new(i64::MAX / 512)),
            None
        );
    }
}
