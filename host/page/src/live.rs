//! What the page shows: handed over by whoever measures, read by whoever looks.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use rowtone::report::Report;
use serde::Serialize;

use crate::frames::Frames;
use crate::motion::Motion;
use crate::reports::Reports;

/// Bytes that the last pictures may take, unless told otherwise.
pub const USUAL_FRAME_ROOM: usize = 64 << 20;

/// What is measured, and with what.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct About {
    /// What the page calls it: a file, a camera, a port.
    pub name: String,
    /// Columns and rows of the picture; none where there are no pictures.
    pub picture: Option<[usize; 2]>,
    /// The part of it that is measured: x, y, width, height, px; none where that is not known.
    pub part: Option<[usize; 4]>,
    /// From one row to the next, µs.
    pub line_time_us: Option<f64>,
    /// Exposure of a row, µs.
    pub exposure_us: Option<f64>,
    /// Frame rate, Hz.
    pub fps: Option<f64>,
}

/// What the measurement does now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// It begins: the picture is being learned.
    #[default]
    Starting,
    /// Reports come, or are to come.
    Measuring,
    /// The recording has been read to its end; what is shown stays.
    Ended,
    /// It cannot go on; the text says why.
    Failed,
}

/// See the [module](self).
#[derive(Debug)]
pub struct Live {
    /// The reports.
    pub reports: Reports,
    /// The pictures.
    pub frames: Frames,
    /// The displacements.
    pub motion: Motion,
    /// What was lost, since the program began.
    pub lost: Lost,
    state: Mutex<(About, Phase, String)>,
    /// When the program began.
    pub began: Instant,
}

/// Counters of what was lost, each a total.
#[derive(Debug, Default)]
pub struct Lost {
    /// Frames that the camera took and nobody got.
    pub frames: AtomicU64,
    /// Windows or reports that were dropped because what comes after them was busy.
    pub reports: AtomicU64,
    /// Rows that were measured.
    pub rows: AtomicU64,
}

impl Default for Live {
    fn default() -> Self {
        Self::new(USUAL_FRAME_ROOM)
    }
}

impl Live {
    /// Nothing to show yet; the last pictures may take so many bytes.
    pub fn new(frame_room: usize) -> Self {
        Self {
            reports: Reports::default(),
            frames: Frames::new(frame_room),
            motion: Motion::default(),
            lost: Lost::default(),
            state: Mutex::default(),
            began: Instant::now(),
        }
    }

    fn state(&self) -> MutexGuard<'_, (About, Phase, String)> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says what is measured.
    pub fn describe(&self, about: About) {
        self.state().0 = about;
    }

    /// Says which part of the picture is measured: x, y, width, height, px.
    pub fn set_part(&self, part: [usize; 4]) {
        self.state().0.part = Some(part);
    }

    /// What is measured.
    pub fn about(&self) -> About {
        self.state().0.clone()
    }

    /// Says what the measurement does; `why` where that needs a reason.
    pub fn set_phase(&self, phase: Phase, why: &str) {
        let mut state = self.state();
        (state.1, state.2) = (phase, why.to_owned());
    }

    /// What the measurement does, and why where that needs a reason.
    pub fn phase(&self) -> (Phase, String) {
        let state = self.state();
        (state.1, state.2.clone())
    }

    /// Takes in a report, and its JSON as `rowtone analyze` writes it.
    pub fn report(&self, report: &Report, json: String) {
        self.lost
            .frames
            .fetch_add(report.lost_frames.into(), Ordering::Relaxed);
        self.lost
            .rows
            .fetch_add(report.lines.into(), Ordering::Relaxed);
        self.reports.push(report, json);
    }

    /// Other settings hold from now on: what was shown belongs to those before.
    pub fn restart(&self) {
        self.set_phase(Phase::Starting, "");
        self.motion.clear();
        self.reports.restart();
    }
}
