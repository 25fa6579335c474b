//! The conditions of the study, each as a change of the usual one.

use host_sim::{Config, Flicker, Led, RateChange, Scene, Step, Tone};
use rowtone_calibrate::Light;

/// Line time of the usual camera, s: an OV5647 at 640x480.
const LINE_TIME_S: f64 = 33.67e-6;

/// What the stripes are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Brightness of the rows.
    Brightness,
    /// Displacement of the rows.
    Displacement,
}

/// One condition: a recording, and what is told of it.
#[derive(Clone, Debug)]
pub struct Condition {
    /// Its name in the table.
    pub name: &'static str,
    /// The recording.
    pub config: Config,
    /// What is known of the light.
    pub light: Light,
    /// What is measured.
    pub source: Source,
    /// The frames' own times are known, not only their rate.
    pub times: bool,
    /// Whatever is found is wrong: the only right answer is to refuse, or to say so.
    pub hopeless: bool,
}

fn led(hz: f64) -> Led {
    Led {
        hz,
        duty: 0.5,
        phase: 0.0,
        off_level: 0.0,
        missing: 0.0,
    }
}

/// A light that is on for `is` of its period, and said to be on for `told`.
fn duty(condition: &mut Condition, is: f64, told: f64) {
    if let Some(led) = &mut condition.config.light.led {
        led.duty = is;
    }
    if let Light::Known { duty, .. } = &mut condition.light {
        *duty = Some(told);
    }
}

fn generator(hz: f64) -> Light {
    Light::Known {
        hz,
        hz_sd: 0.0,
        duty: Some(0.5),
    }
}

/// One second of a plain surface lit by an LED of 1 kHz.
fn usual(name: &'static str) -> Condition {
    let mut config = Config {
        frames: 30,
        scene: Scene::Plain,
        ..Config::default()
    };
    (config.sensor.cols, config.sensor.rows) = (64, 480);
    config.sensor.line_time_ps = (LINE_TIME_S * 1e12).round() as u32;
    config.sensor.fps = 29.97;
    config.sensor.exposure_ns = 200_000;
    config.light.led = Some(led(1000.0));
    Condition {
        name,
        config,
        light: generator(1000.0),
        source: Source::Brightness,
        times: true,
        hopeless: false,
    }
}

fn with(name: &'static str, change: impl FnOnce(&mut Condition)) -> Condition {
    let mut condition = usual(name);
    change(&mut condition);
    condition
}

/// An LED behind its generator.
fn generated() -> Vec<Condition> {
    let lit = |name, hz, exposure_ns| {
        with(name, |c| {
            c.config.light.led = Some(led(hz));
            c.light = generator(hz);
            c.config.sensor.exposure_ns = exposure_ns;
        })
    };
    let flashing = |name, change: fn(&mut Led)| {
        with(name, |c| {
            if let Some(led) = &mut c.config.light.led {
                change(led);
            }
        })
    };
    vec![
        usual("LED 1 kHz, one second"),
        lit("500 Hz", 500.0, 200_000),
        lit("2 kHz, exposure 100 µs", 2000.0, 100_000),
        lit("exposure 60 µs", 1000.0, 60_000),
        lit("exposure 700 µs", 1000.0, 700_000),
        lit("100 Hz, exposure 2 ms", 100.0, 2_000_000),
        with("duty 20 %", |c| duty(c, 0.2, 0.2)),
        with("duty 80 %", |c| duty(c, 0.8, 0.8)),
        // The on-time is shorter than the exposure.
        with("duty 10 %", |c| duty(c, 0.1, 0.1)),
        with("duty 10 %, told 50 %", |c| duty(c, 0.1, 0.5)),
        with("duty 10 %, told 50 %, one frame", |c| {
            duty(c, 0.1, 0.5);
            c.config.frames = 1;
        }),
        lit("437.21 Hz: 17 places in 17 frames", 437.21, 200_000),
        flashing("10 % of the flashes missing", |l| l.missing = 0.1),
        with("10 % missing, one frame", |c| {
            c.config.frames = 1;
            c.config.light.led = Some(Led {
                missing: 0.1,
                ..led(1000.0)
            });
        }),
        with("five frames", |c| c.config.frames = 5),
        with("ten frames", |c| c.config.frames = 10),
        with("one frame", |c| c.config.frames = 1),
        with("read from the bottom up", |c| {
            c.config.sensor.bottom_up = true;
        }),
        with("stripes stand still (25 fps)", |c| {
            c.config.sensor.fps = 25.0
        }),
        with("stand still, one harmonic", |c| {
            c.config.sensor.fps = 25.0;
            c.config.sensor.exposure_ns = 700_000;
        }),
        with("LED behind a gradient", |c| {
            c.config.light.gradient = [0.8, 1.2];
        }),
        with("gradient, one frame", |c| {
            c.config.light.gradient = [0.8, 1.2];
            c.config.frames = 1;
        }),
        with("saturated", |c| {
            c.config.disturbances.gain_steps = vec![Step {
                t_s: 0.0,
                value: 2.5,
            }];
        }),
        flashing("low contrast (off: 90 %)", |l| l.off_level = 0.9),
        flashing("very low contrast (off: 99 %)", |l| l.off_level = 0.99),
        flashing("no contrast (off: 99.9 %)", |l| l.off_level = 0.999),
        with("dark (2 % of white)", |c| {
            (c.config.optics.dark, c.config.optics.bright) = (0.01, 0.02);
        }),
        with("textured scene", |c| {
            c.config.scene = Scene::Speckle { grain_px: 4.0 };
        }),
        with("textured scene, one frame", |c| {
            c.config.scene = Scene::Speckle { grain_px: 4.0 };
            c.config.frames = 1;
        }),
        with("a tenth of the frames lost", |c| {
            c.config.faults.lost_probability = 0.1;
        }),
        with("lost, times not told", |c| {
            c.config.faults.lost_probability = 0.1;
            c.times = false;
        }),
        with("phone: 720 rows, 40 % blank", |c| {
            c.config.sensor.rows = 720;
            c.config.sensor.fps = 30.0;
            c.config.sensor.line_time_ps = 27_800_000;
        }),
        with("1080 rows of 14.6 µs", |c| {
            c.config.sensor.rows = 1080;
            c.config.sensor.cols = 32;
            c.config.sensor.line_time_ps = 14_565_000;
            c.config.sensor.exposure_ns = 62_500;
        }),
        with("told 1100 Hz", |c| {
            c.light = generator(1100.0);
            c.config.sensor.fps = 24.0;
            c.hopeless = true;
        }),
        with("told 500 Hz", |c| {
            c.light = generator(500.0);
            c.hopeless = true;
        }),
        with("no LED at all", |c| {
            c.config.light.led = None;
            c.hopeless = true;
        }),
        with("no LED, one frame", |c| {
            c.config.light.led = None;
            c.config.frames = 1;
            c.hopeless = true;
        }),
    ]
}

/// Other lights, and none.
fn others() -> Vec<Condition> {
    let unknown = |name, about_hz, two_rates: bool| {
        with(name, move |c| {
            c.config.light.led = Some(led(437.21));
            c.light = Light::Unknown { about_hz };
            if two_rates {
                c.config.rate_changes = vec![RateChange {
                    t_s: 0.5,
                    fps: 28.7,
                }];
            }
        })
    };
    let mains = |name, frames, depth| {
        with(name, move |c| {
            c.config.light.led = None;
            c.config.light.flicker = Some(Flicker {
                depth,
                hz: 100.0,
                phase_rad: 0.0,
            });
            c.config.sensor.exposure_ns = 2_000_000;
            c.config.frames = frames;
            c.light = Light::Known {
                hz: 100.0,
                hz_sd: 0.06,
                duty: None,
            };
        })
    };
    let tone = |name, light, amplitude_px, two_rates: bool| {
        with(name, move |c| {
            c.config.light.led = None;
            c.config.scene = Scene::Speckle { grain_px: 2.0 };
            c.config.motion.tones = vec![Tone {
                hz: 183.4,
                amplitude_px,
                phase_rad: 0.0,
            }];
            c.light = light;
            c.source = Source::Displacement;
            c.config.sensor.exposure_ns = 1_000_000;
            if two_rates {
                c.config.rate_changes = vec![RateChange {
                    t_s: 0.5,
                    fps: 28.7,
                }];
            }
        })
    };
    let exact = Light::Known {
        hz: 183.4,
        hz_sd: 0.0,
        duty: None,
    };
    let about = |hz| Light::Unknown { about_hz: Some(hz) };
    vec![
        mains("mains lamp, 30 % flicker", 30, 0.3),
        mains("mains lamp, 3 % flicker", 30, 0.03),
        mains("mains lamp, one frame", 1, 0.3),
        unknown("unknown light, two frame rates", None, true),
        unknown("unknown light, about 440 Hz", Some(440.0), false),
        with("unknown light, one frame rate", |c| {
            c.config.light.led = Some(led(437.21));
            c.light = Light::Unknown { about_hz: None };
        }),
        tone("tone of 0.4 px, its Hz told", exact, 0.4, false),
        tone("tone of 0.05 px, its Hz told", exact, 0.05, false),
        tone("tone of 0.4 px, about 185 Hz", about(185.0), 0.4, false),
        tone(
            "tone of 0.4 px, two frame rates",
            Light::Unknown { about_hz: None },
            0.4,
            true,
        ),
        tone("no tone", exact, 0.0, false),
    ]
    .into_iter()
    .map(|mut c| {
        c.hopeless |= c.name == "no tone";
        c
    })
    .collect()
}

/// All of them.
pub fn all() -> Vec<Condition> {
    let mut conditions = generated();
    conditions.extend(others());
    conditions
}
