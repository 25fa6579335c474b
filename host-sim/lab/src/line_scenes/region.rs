//! What `--roi auto` chooses, held against what each part of the picture knows.

use rowtone::camera::Pixels;

use super::case::{lens, scenes, tone};
use host_sim::{Camera, Config, Frame, Motion, Preset, Rect, SimError, crlb};
use rowtone_measure::tracking::region::{Picture, choose};

/// A frame as the choice of a part takes it.
struct Filmed(Frame);

impl Picture for Filmed {
    fn start_ns(&self) -> i64 {
        self.0.start_ns
    }

    fn row(&self, part: &rowtone_clip::Rect, row: usize) -> Pixels<'_> {
        let line = self.0.line((part.y + row) as u32);
        let pixels = line.and_then(|line| line.pixels.part(part.x, part.width));
        pixels.expect("a part of this picture")
    }
}

/// A recording of 30 frames.
#[derive(Clone, Debug)]
pub struct Case {
    /// In words.
    pub name: String,
    /// The recording.
    pub config: Config,
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Share of the width and of the height that was chosen.
    pub chosen: [f64; 2],
    /// Share of the tone's amplitude that is measured in the whole picture, and in what was chosen.
    pub amplitude: [f64; 2],
    /// How far the tone stands out of the noise, against the whole picture: in what was chosen, and in what vibrates.
    pub gain: [f64; 2],
}

/// Every preset with every scene: all of the picture vibrates, by 0.3 and by 0.02 px, and a part of it, by 0.02 px: a
/// third of the columns, and a corner.
pub fn cases(seed: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for preset in Preset::ALL {
        for (name, scene) in scenes() {
            let sensor = preset.sensor();
            let (w, h) = (sensor.cols, sensor.rows);
            let third = Rect {
                x: w / 3,
                y: 0,
                w: w / 3,
                h,
            };
            let corner = Rect {
                x: w / 2,
                y: h / 2,
                w: w / 2,
                h: h / 2,
            };
            for (what, px, vibrating) in [
                ("all", 0.3, None),
                ("all", 0.02, None),
                ("third", 0.02, Some(third)),
                ("corner", 0.02, Some(corner)),
            ] {
                cases.push(Case {
                    name: format!("{preset} {name}, {what} {px} px"),
                    config: Config {
                        seed,
                        sensor: sensor.clone(),
                        frames: 30,
                        scene: scene.clone(),
                        optics: lens(),
                        motion: Motion {
                            tones: vec![tone(1.37 * sensor.fps, px)],
                            ..Motion::default()
                        },
                        vibrating,
                        ..Config::default()
                    },
                });
            }
        }
    }
    cases
}

/// Chooses, and says what is known where.
///
/// # Errors
/// [`SimError`] when the case contradicts itself.
pub fn measure(case: &Case) -> Result<Figures, SimError> {
    let camera = Camera::new(case.config.clone())?;
    let (cols, rows) = (case.config.sensor.cols, case.config.sensor.rows);
    let frames: Vec<Filmed> = camera.frames().map(Filmed).collect();
    let part = rowtone_clip::Rect::whole(cols as usize, rows as usize);
    let region = choose(&frames, &part, &camera.timing()).region;
    let (mut all, mut chosen) = ([0.0; 2], [0.0; 2]);
    for row in 0..rows {
        let moving = case.config.moving_cols(row).unwrap_or(0..0);
        let known = |from: u32, to: u32| {
            let inside = moving.start.max(from)..moving.end.min(to);
            let vibrating = match inside.is_empty() {
                true => 0.0,
                false => crlb::information_per_px2(&camera, row, inside),
            };
            [crlb::information_per_px2(&camera, row, from..to), vibrating]
        };
        let add = |to: &mut [f64; 2], known: [f64; 2]| {
            to.iter_mut().zip(known).for_each(|(sum, v)| *sum += v);
        };
        add(&mut all, known(0, cols));
        if region.rows.contains(&(row as usize)) {
            let ends = (region.columns.start as u32, region.columns.end as u32);
            add(&mut chosen, known(ends.0, ends.1));
        }
    }
    // The amplitude is the mean over what is measured, by information; its noise 1/√information.
    let share = |[known, vibrating]: [f64; 2]| vibrating / known;
    let stands_out = |[known, vibrating]: [f64; 2]| vibrating / known.sqrt();
    Ok(Figures {
        chosen: [
            region.columns.len() as f64 / f64::from(cols),
            region.rows.len() as f64 / f64::from(rows),
        ],
        amplitude: [share(all), share(chosen)],
        gain: [stands_out(chosen), all[1].sqrt()].map(|v| v / stands_out(all)),
    })
}

/// The head of the table.
pub fn head() -> String {
    format!(
        "{:<38} {:>6} {:>6} {:>8} {:>8} {:>6} {:>6}",
        "recording", "width%", "rows%", "in all%", "chosen%", "gain", "best"
    )
}

/// A row of the table; where a case cannot be measured, why.
pub fn row(case: &Case) -> String {
    let percent = |v: f64| format!("{:.0}", 100.0 * v);
    match measure(case) {
        Ok(f) => format!(
            "{:<38} {:>6} {:>6} {:>8} {:>8} {:>6.2} {:>6.2}",
            case.name,
            percent(f.chosen[0]),
            percent(f.chosen[1]),
            percent(f.amplitude[0]),
            percent(f.amplitude[1]),
            f.gain[0],
            f.gain[1],
        ),
        Err(error) => format!("{:<38} {error}", case.name),
    }
}
