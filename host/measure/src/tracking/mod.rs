//! From frames to displacements, on a thread of its own.
//!
//! [`Shifts::start`] takes a [`Feed`] and tracks its lines; [`Shifts::next_frame`] delivers what the
//! lines of each frame came to, in order: row by row, or combined as they are measured, so that some
//! samples leave the thread and not every row. A tracker first learns its reference; so that nothing is
//! lost, the first frames are kept until it has, and then measured like all others: a clip of six frames
//! gets the displacements of six frames. Queues are short and their buffers are used again, so memory
//! does not grow with the length of the recording, and nothing is sent line by line.

mod background;
mod codec;
mod columns;
mod engine;
mod lines;
mod pattern;
pub mod region;
mod together;

use rowtone::pipeline::Reading;
use rowtone::report::Warnings;
use rowtone::timeline::{Displacement, Group, Sample};
use rowtone::tracker::Axes;

pub use background::subtract;
pub use engine::{Engine, Wanted};

use crate::MeasureError;
use rowtone_clip::ring::{Inlet, Next, ring};
use rowtone_clip::{Camera, Feed, Rect};
use rowtone_memory::TrackerMemory;

/// Blocks of displacements on their way: the lines go on while a report is computed, which takes a millisecond or two,
/// of as much as a hundred frames.
const BLOCKS: usize = 4;
/// Frames of a block, where nobody waits for each.
const BLOCK_FRAMES: usize = 32;

/// What the lines of one frame came to.
#[derive(Debug, Default)]
pub struct FrameShifts {
    /// Number of the frame; a lost one leaves a gap.
    pub number: u32,
    /// Start of exposure of its first row, ns.
    pub start_ns: i64,
    /// Rows that were measured, from the top of the part, the background's motion subtracted; none where
    /// they are combined.
    pub rows: Vec<Displacement>,
    /// The rows combined, where that was asked for, and what became of the frame's rows.
    pub readings: Vec<Reading>,
    /// With the first frame: what is measured.
    pub chosen: Option<Chosen>,
    /// What was found out about the recording, from this frame on.
    warnings: Warnings,
    /// Something to tell the user at once, a line each, without the recording's name.
    pub notes: Vec<String>,
}

/// What is measured of the picture, and what was seen on the way to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// The part, in the picture as it was given.
    pub part: Rect,
    /// By how much all of the picture shakes along the rows, zero to peak, px, where that is more than
    /// a part of it vibrates.
    pub shake_px: Option<f64>,
    /// A codec took something of the frames between key frames, which the end of a file tells.
    pub keyed: bool,
}

/// How the lines ended.
type Ending = Result<Finale, MeasureError>;

/// What is known when the lines have ended.
#[derive(Debug, Default)]
struct Finale {
    /// What the user is told in the end.
    warning: Option<String>,
    /// The samples of the key frames, against a reference learned from them alone.
    keys: Vec<Sample>,
}

/// The displacements of a recording, frame by frame.
#[derive(Debug)]
pub struct Shifts {
    inlet: Inlet<FrameShifts, Ending>,
    warning: Option<String>,
    keys: Vec<Sample>,
    /// Its file has frames that were predicted from others.
    pub(crate) predicted: bool,
    /// The camera that recorded them.
    pub camera: Camera,
    /// The part of the turned picture that is measured.
    pub part: Rect,
    /// The axes along which it is measured: along the rows alone where a part has too few of them.
    pub axes: Axes,
    /// How many frames there are, where the file's length tells.
    pub frames: Option<u64>,
    /// What to call the recording in messages.
    pub name: String,
}

/// What both the part and the background can be measured along.
fn axes_of_both(part: &Rect, camera: &Camera) -> Axes {
    let axes = engine::axes_of(part, camera.axes);
    match &camera.background {
        Some(background) => engine::axes_of(background, axes),
        None => axes,
    }
}

impl Shifts {
    /// Starts tracking. Rows are delivered one by one, or combined to samples in these groups.
    ///
    /// # Errors
    /// [`MeasureError`] when the part to measure cannot be measured.
    pub fn start(feed: Feed, groups: Option<Group>) -> Result<Self, MeasureError> {
        let camera = feed.camera.clone();
        let part = camera.part_or_rest()?;
        let block = if feed.frames.is_some() {
            BLOCK_FRAMES
        } else {
            1
        };
        let (outlet, inlet) = ring(BLOCKS * BLOCK_FRAMES / block, block);
        let (frames, name) = (feed.frames, feed.name.clone());
        let probe = feed.about.probe.as_ref();
        let predicted = probe.is_some_and(rowtone_clip::ffmpeg::Probe::is_predicted);
        let axes = axes_of_both(&part, &camera);
        // Made here and dropped at once: a part that cannot be measured is refused before anything
        // is read.
        for part in [Some(part), camera.background].into_iter().flatten() {
            let mut memory = TrackerMemory::for_axes(part.width, part.height, axes);
            let (timing, bits) = (camera.timing, camera.bits);
            let wanted = Wanted { axes, group: None };
            Engine::new(part, timing, wanted, bits, 1, &mut memory).map_err(|why| {
                let name = name.clone();
                MeasureError::Part { name, why }
            })?;
        }
        std::thread::spawn(move || lines::run(feed, part, groups, outlet));
        Ok(Self {
            inlet,
            axes,
            warning: None,
            keys: Vec::new(),
            predicted,
            camera,
            part,
            frames,
            name,
        })
    }

    /// The next frame's displacements; `None` after the last.
    ///
    /// # Errors
    /// [`MeasureError::Clip`] when the input turns out to be unusable at this point; what came before was
    /// good.
    pub fn next_frame(&mut self) -> Result<Option<FrameShifts>, MeasureError> {
        match self.inlet.receive() {
            Next::Item(frame) => {
                self.camera.warnings = self.camera.warnings.union(frame.warnings);
                Ok(Some(frame))
            }
            Next::End(ending) => {
                let finale = ending?;
                (self.warning, self.keys) = (finale.warning, finale.keys);
                Ok(None)
            }
            Next::Gone => Ok(None),
        }
    }

    /// What to say when no row of the recording could be measured.
    pub fn nothing_measured(&self) -> MeasureError {
        MeasureError::NothingMeasured {
            name: self.name.clone(),
            part: self.part,
        }
    }

    /// Gives a frame's buffers back.
    pub fn recycle(&mut self, frame: FrameShifts) {
        self.inlet.recycle(frame);
    }

    /// After the last frame: the samples of its key frames, where a codec took something of those between.
    pub fn key_samples(&self) -> &[Sample] {
        &self.keys
    }

    /// Something to tell the user after the last frame.
    pub fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }
}
