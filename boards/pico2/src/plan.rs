//! What the settings and the camera's measured timing mean for the core, on this board.

use crate::capture::LINE_PIXELS;
use crate::clock::FrameClock;
use crate::hm01b0;
use rowtone::link::settings::{Limits, Region, Settings};
use rowtone_board::memory::FRAMES;
use rowtone_board::plan::{CameraTiming, Plan};

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

/// From settings (checked against [`LIMITS`]) and a settled clock; `None` when the measured timing is
/// beyond what the core takes.
pub fn plan(settings: &Settings, camera: &hm01b0::Config, clock: &FrameClock) -> Option<Plan> {
    let lines = u64::from(camera.frame_length_lines);
    let line_time_ps = u32::try_from(clock.period_ps() / lines).ok()?;
    let exposure_ns = u64::from(line_time_ps) * u64::from(camera.exposure_lines) / 1000;
    let timing = CameraTiming {
        line_time_ps,
        exposure_ns: u32::try_from(exposure_ns).ok()?,
        frame_ns: clock.period_ps() / 1000,
    };
    Plan::new(settings, WHOLE, &timing)
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
        let plan = plan(&DEFAULTS, &camera, &clock(17_472_000)).unwrap();
        assert_eq!(plan.cut.timing.line_time_ps(), 67_200_000);
        assert_eq!(plan.cut.timing.exposure_ns(), 537_600);
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
        let plan = plan(&settings, &hm01b0::Config::QVGA_8BIT, &clock(17_472_000)).unwrap();
        assert_eq!(
            (
                plan.cut.timing.rows(),
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
            plan(&DEFAULTS, &camera, &FrameClock::new(i64::MAX / 512)),
            None
        );
    }
}
