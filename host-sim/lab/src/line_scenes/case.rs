//! Which recordings are measured.

use host_sim::{Config, Flicker, Hand, Motion, Optics, Preset, Scene, Step, Tone};

/// One recording, and how its tracker is set.
#[derive(Clone, Debug)]
pub struct Case {
    /// In words.
    pub name: String,
    /// The recording.
    pub config: Config,
    /// Frames in each of the two rounds of learning; none of them is measured.
    pub learn_frames: u16,
    /// Columns a line that are built anew beside it; all that the tracker likes where there is none.
    pub columns_per_line: Option<u16>,
    /// Frequency up to which peaks are looked for, Hz.
    pub max_hz: f32,
    /// Rows count from this time on, s.
    pub measured_from_s: f64,
    /// Peaks are looked for too.
    pub peaks: bool,
    /// The camera tells how long each frame was exposed, and the lines' times are given accordingly.
    pub exposure_told: bool,
}

/// The scenes of the figures.
pub(super) fn scenes() -> [(&'static str, Scene); 4] {
    [
        ("speckle", Scene::Speckle { grain_px: 2.0 }),
        ("bar", Scene::Bar { width_px: 30.0 }),
        ("stripes", Scene::Stripes { period_px: 16.0 }),
        ("photo", Scene::Photo { sky: 0.2 }),
    ]
}

pub(super) fn tone(hz: f64, amplitude_px: f64) -> Tone {
    Tone {
        hz,
        amplitude_px,
        phase_rad: 0.4,
    }
}

pub(super) fn lens() -> Optics {
    Optics {
        blur_px: Optics::blur_for_cutoff(0.1),
        ..Config::default().optics
    }
}

/// Every preset with every scene, `rows` rows of its full width, a tone of 0.3 px, 20 frames of learning and
/// `frames` more.
pub fn small_motion(seed: u64, rows: u32, frames: u32) -> Vec<Case> {
    let mut cases = Vec::new();
    for preset in Preset::ALL {
        for (name, scene) in scenes() {
            let mut sensor = preset.sensor();
            sensor.rows = rows;
            let hz = 0.37 * sensor.fps;
            cases.push(Case {
                name: format!("{preset} {name}"),
                config: Config {
                    seed,
                    sensor,
                    frames: 20 + frames,
                    scene,
                    optics: lens(),
                    motion: Motion {
                        tones: vec![tone(hz, 0.3)],
                        ..Motion::default()
                    },
                    ..Config::default()
                },
                learn_frames: 10,
                columns_per_line: None,
                max_hz: 1000.0,
                measured_from_s: 0.0,
                peaks: false,
                exposure_told: false,
            });
        }
    }
    cases
}

/// 256 x 300 px of speckle at 60 frames a second, exposed for 0.2 ms, `seconds` after 20 frames of learning.
pub(super) fn usual(seed: u64, name: &str, tones: Vec<Tone>, seconds: f64) -> Case {
    let mut config = Config {
        seed,
        scene: Scene::Speckle { grain_px: 2.0 },
        optics: lens(),
        ..Config::default()
    };
    config.sensor.cols = 256;
    config.sensor.exposure_ns = 200_000;
    config.frames = 20 + (seconds * config.sensor.fps).ceil() as u32 + 2;
    config.motion.tones = tones;
    Case {
        name: name.to_owned(),
        config,
        learn_frames: 10,
        columns_per_line: None,
        max_hz: 2500.0,
        measured_from_s: 0.0,
        peaks: true,
        exposure_told: false,
    }
}

/// 8 px peak to peak where it is hardest: fast, exposed for long, on stripes.
fn swift(seed: u64) -> Vec<Case> {
    let stripes = |period_px| Scene::Stripes { period_px };
    let speckle = Scene::Speckle { grain_px: 2.0 };
    let mut cases = Vec::new();
    let mut add = |name: &str, hz: f64, scene: Scene, exposure_ns: u32| {
        let name = format!("8 px p-p at {hz} Hz, {name}");
        let mut case = usual(seed, &name, vec![tone(hz, 4.0)], 1.0);
        case.config.scene = scene;
        case.config.sensor.exposure_ns = exposure_ns;
        cases.push(case);
    };
    for hz in [7.7, 33.1, 119.3, 301.7] {
        add("stripes", hz, stripes(16.0), 200_000);
    }
    for period_px in [12.0, 10.0] {
        let name = format!("{period_px} px stripes");
        add(&name, 50.3, stripes(period_px), 200_000);
    }
    for (name, scene) in scenes().into_iter().skip(1) {
        add(name, 1003.0, scene, 200_000);
    }
    add("0.1 ms", 1003.0, speckle.clone(), 100_000);
    add("0.3 ms", 1003.0, speckle, 300_000);
    cases
}

/// What an estimator may be fooled by.
pub fn hard(seed: u64) -> Vec<Case> {
    let mut cases = swift(seed);
    for hz in [5.3, 50.3, 203.7, 1003.0] {
        let name = format!("8 px p-p at {hz} Hz + 0.03 px");
        let tones = vec![tone(hz, 4.0), tone(77.7, 0.03)];
        cases.push(usual(seed, &name, tones, 1.0));
    }
    for (name, scene) in scenes() {
        let name = format!("8 px p-p at 50.3 Hz, {name}");
        let mut case = usual(seed, &name, vec![tone(50.3, 4.0)], 1.0);
        case.config.scene = scene;
        cases.push(case);
    }
    cases.push(usual(
        seed,
        "30 px p-p at 20.3 Hz",
        vec![tone(20.3, 15.0)],
        1.0,
    ));
    let vibration = || vec![tone(37.3, 0.3)];
    let mut with = |name: &str, seconds: f64, change: &dyn Fn(&mut Case)| {
        let mut case = usual(seed, name, vibration(), seconds);
        change(&mut case);
        cases.push(case);
    };
    with("0.6 px p-p at 37.3 Hz, nothing else", 1.0, &|_| ());
    for hz in [100.0, 120.0] {
        with(&format!("flicker 30 % at {hz} Hz"), 1.0, &|c| {
            c.config.light.flicker = Some(Flicker {
                depth: 0.3,
                hz,
                phase_rad: 1.0,
            });
        });
    }
    let steps = |values: [f64; 3]| -> Vec<Step> {
        [0.5, 0.75, 1.0]
            .into_iter()
            .zip(values)
            .map(|(t_s, value)| Step { t_s, value })
            .collect()
    };
    with("gain x 0.7, 1.3, 1", 1.0, &|c| {
        c.config.optics.bright = 0.7;
        c.config.disturbances.gain_steps = steps([0.7, 1.3, 1.0]);
    });
    for (name, told) in [
        ("exposure x 0.7, 1.3, 1, not told", false),
        ("exposure x 0.7, 1.3, 1, told", true),
    ] {
        with(name, 1.0, &|c| {
            c.config.optics.bright = 0.7;
            c.config.disturbances.exposure_steps = steps([0.7, 1.3, 1.0]);
            c.exposure_told = told;
        });
    }
    with("creep of 0.5 px/s, 6 s", 6.0, &|c| {
        c.config.motion.drift_px_per_s = 0.5;
    });
    with("dead columns 40, 100, 101", 1.0, &|c| {
        c.config.disturbances.dead_cols = vec![40, 100, 101];
    });
    with("30 white, 30 black rows", 1.0, &|c| {
        c.config.disturbances.saturated_rows = (50..80).collect();
        c.config.disturbances.black_rows = (150..180).collect();
    });
    with("hand for 0.4 s, then 1 s more", 2.0, &|c| {
        c.config.disturbances.hand = Some(Hand {
            start_s: 0.7,
            duration_s: 0.4,
            width_px: 120.0,
            level: 0.4,
        });
        c.measured_from_s = 1.3;
    });
    with("another scene at 0.7 s", 4.0, &|c| {
        c.config.disturbances.scene_change_s = Some(0.7);
        c.measured_from_s = 3.3;
    });
    cases
}

/// Exposed for so long that the picture moves by several pixels meanwhile. Left out is what an exposure of whole periods
/// does not show.
pub fn long_exposure(seed: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for exposure_ns in [200_000, 500_000, 1_000_000] {
        let ms = f64::from(exposure_ns) / 1e6;
        for hz in [103.0, 301.7, 463.0, 703.0, 1003.0] {
            if f64::from(exposure_ns) * 1e-9 * hz > 0.9 {
                continue;
            }
            for px in [1.6, 4.0] {
                let name = format!("exposed {ms} ms: {px} px at {hz} Hz");
                let mut case = usual(seed, &name, vec![tone(hz, px)], 1.0);
                case.config.sensor.exposure_ns = exposure_ns;
                // As they are by default: in 20 a tone near a multiple of the frame rate is hardly seen to move.
                case.learn_frames = 30;
                case.config.frames += 40;
                cases.push(case);
            }
        }
    }
    cases
}

/// The camera shakes, and its 64 leftmost columns show a background that does not move with the machine.
pub fn shaking(seed: u64) -> Case {
    let mut case = usual(seed, "shake 0.5 px, background", vec![tone(61.3, 0.2)], 1.0);
    case.config.background_cols = 64;
    case.config.shake.tones = vec![tone(12.1, 0.5), tone(31.7, 0.2)];
    case
}
