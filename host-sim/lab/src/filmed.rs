//! A simulated recording in memory, to be read as `rowtone` reads a clip.

use std::io::Cursor;
use std::sync::Arc;

use host_sim::{Camera, y4m};
use rowtone::tracker::Axes;
use rowtone_clip::{CameraOptions, ClipError, Feed, Times};

use crate::LabError;

/// All frames of a camera that arrive, as Y4M, with their times.
#[derive(Clone, Debug)]
pub(crate) struct Filmed {
    clip: Arc<[u8]>,
    options: CameraOptions,
    times: Times,
}

impl Filmed {
    /// Films all that the camera sees, to be measured along these axes.
    pub(crate) fn new(camera: &Camera, axes: Axes) -> Result<Self, LabError> {
        let memory = |why| LabError::Write {
            path: "memory".into(),
            why,
        };
        let sensor = &camera.config().sensor;
        let mut clip = Vec::new();
        y4m::write_header(&mut clip, sensor).map_err(memory)?;
        for frame in camera.frames() {
            y4m::write_frame(&mut clip, &frame).map_err(memory)?;
        }
        let starts = camera.arriving().map(|slot| slot.start_ns).collect();
        Ok(Self {
            clip: clip.into(),
            options: CameraOptions {
                line_time_us: Some(f64::from(sensor.line_time_ps) * 1e-6),
                exposure_us: Some(f64::from(sensor.exposure_ns) * 1e-3),
                axes,
                ..CameraOptions::of("the simulated recording")
            },
            times: Times::new(starts, Some(sensor.fps)).ok_or(LabError::NoFrame)?,
        })
    }

    /// The recording from its first frame on.
    pub(crate) fn feed(&self) -> Result<Feed, ClipError> {
        let clip = Cursor::new(Arc::clone(&self.clip));
        Feed::at_times(&self.options, clip, self.times.clone())
    }
}
