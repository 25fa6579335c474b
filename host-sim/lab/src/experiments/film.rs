//! Simulated recordings of the thesis's set-up, and who measures them.

use rowtone::camera::Timing;

use super::working_on;
use crate::LabError;
use crate::methods::core::Core;
use crate::methods::study::{Recording, record};
use crate::methods::thesis::Thesis;
use crate::methods::visual::{By, VisualMicrophone};
use crate::methods::{Method, Shifts};
use host_sim::{Config, Motion, Optics, Preset, Scene, Sensor};

/// A camera and what it looks at.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The camera.
    pub sensor: Sensor,
    /// Frames.
    pub frames: u32,
    /// What it looks at.
    pub scene: Scene,
    /// Up to where the lens passes details ([`Optics::blur_for_cutoff`]), cycles/px.
    pub cutoff_cycles_per_px: f64,
    /// Same seed, same recording.
    pub seed: u64,
}

impl Setup {
    /// The thesis's camera (1048 rows, 120 frames a second, 3 % blank), so many columns of it, at a speckled face.
    /// Exposed for 0.1 ms: the thesis does not say.
    pub fn thesis(cols: u32, frames: u32, seed: u64) -> Self {
        let mut sensor = Preset::Thesis.sensor();
        (sensor.cols, sensor.exposure_ns) = (cols, 100_000);
        Self {
            sensor,
            frames,
            scene: Scene::Speckle { grain_px: 2.0 },
            cutoff_cycles_per_px: 0.1,
            seed,
        }
    }

    /// Details down to the pixels, where `sharp` is wanted: the finest sub-bands then hold more than noise.
    #[must_use]
    pub fn sharp(mut self, sharp: bool) -> Self {
        if sharp {
            self.scene = Scene::Speckle { grain_px: 0.7 };
            self.cutoff_cycles_per_px = 0.25;
        }
        self
    }

    /// Films a motion.
    ///
    /// # Errors
    /// [`LabError`] for what cannot be simulated.
    pub fn film(&self, motion: &Motion) -> Result<Film, LabError> {
        let mut config = Config {
            seed: self.seed,
            sensor: self.sensor.clone(),
            frames: self.frames,
            scene: self.scene.clone(),
            motion: motion.clone(),
            ..Config::default()
        };
        config.optics.blur_px = Optics::blur_for_cutoff(self.cutoff_cycles_per_px);
        let sensor = &self.sensor;
        let timing = Timing::new(sensor.line_time_ps, sensor.exposure_ns, sensor.rows as u16)?;
        Ok(Film {
            recording: record(config)?,
            core: Core {
                timing,
                frame_ns: (1e9 / sensor.fps).round() as i64,
                bits: sensor.bits,
            },
            motion: motion.clone(),
            row_s: f64::from(sensor.line_time_ps) * 1e-12,
        })
    }
}

/// A recording and its truth.
#[derive(Clone, Debug)]
pub struct Film {
    /// The pictures and what is true of their rows.
    pub recording: Recording,
    /// This project's method for this camera.
    pub core: Core,
    /// The motion itself.
    pub motion: Motion,
    /// From row to row, s.
    pub row_s: f64,
}

impl Film {
    /// Who measures it: this project, the thesis's method twice, the Visual Microphone row by row.
    pub fn methods(&self) -> Vec<Box<dyn Method>> {
        vec![
            Box::new(self.core),
            Box::new(Thesis::default()),
            Box::new(Thesis::coarse()),
            Box::new(VisualMicrophone { by: By::Row }),
        ]
    }

    /// What each of [`Self::methods`] makes of it, with its name.
    pub fn measured(&self, what: &str) -> Vec<(&'static str, Shifts)> {
        let methods = self.methods();
        let measured = methods.iter().map(|method| {
            working_on(&format!("{what}: {}", method.name()));
            (method.name(), method.shifts(&self.recording.clip))
        });
        measured.collect()
    }
}
