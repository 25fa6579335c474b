//! From frames to displacements, on a thread of its own.
//!
//! [`Shifts::start`] takes a [`Feed`] and tracks its lines; [`Shifts::next_frame`] delivers what the
//! lines of each frame came to, in order: row by row, or combined as they are measured, so that some
//! samples leave the thread and not every row. A tracker first learns its reference; so that nothing is
//! lost, the first frames are kept until it has, and then measured like all others: a clip of six frames
//! gets the displacements of six frames. Queues are short and their buffers are used again, so memory
//! does not grow with the length of the recording, and nothing is sent line by line.

mod background;
mod engine;
pub mod region;

use rowtone::timeline::{Binner, Displacement, Group, Sample};

pub use background::subtract;
pub use engine::{Engine, Unmeasured};
use region::Region;

use crate::failure::Failure;
use crate::input::{Camera, Feed, Frame, Rect};
use crate::memory::TrackerMemory;
use crate::ring::{Inlet, Next, Outlet, ring};

/// Frames that the reference is learned from.
const LEARN_FRAMES: usize = 30;
/// Frames of the first round.
const ROUGH_FRAMES: usize = 10;
/// Fewer where they are so large that keeping them would take more than this, bytes of luma.
const LEARN_BYTES: usize = 512 << 20;
/// Blocks of displacements on their way: the lines go on while a report is computed.
const BLOCKS: usize = 4;
/// Frames of a block, where nobody waits for each.
const BLOCK_FRAMES: usize = 8;

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
    /// The rows combined, where that was asked for.
    pub samples: Vec<Sample>,
    /// Rows that were not measured.
    pub unmeasured: Unmeasured,
    /// Something to tell the user at once.
    note: Option<String>,
}

/// How the lines ended, with the warning that the user is told in the end.
type Ending = Result<Option<String>, Failure>;

/// The displacements of a recording, frame by frame.
#[derive(Debug)]
pub struct Shifts {
    inlet: Inlet<FrameShifts, Ending>,
    warning: Option<String>,
    /// The camera that recorded them.
    pub camera: Camera,
    /// The part of the turned picture that is measured.
    pub part: Rect,
    /// How many frames there are, where the file's length tells.
    pub frames: Option<u64>,
    /// What to call the recording in messages.
    pub name: String,
    /// What was chosen for the user is not told on standard error.
    pub quiet: bool,
}

impl Shifts {
    /// Starts tracking. Rows are delivered one by one, or combined to samples in these groups.
    ///
    /// # Errors
    /// [`Failure`] when the part to measure cannot be measured.
    pub fn start(feed: Feed, groups: Option<Group>) -> Result<Self, Failure> {
        let camera = feed.camera.clone();
        let part = camera.part_or_rest()?;
        let block = if feed.frames.is_some() {
            BLOCK_FRAMES
        } else {
            1
        };
        let (outlet, inlet) = ring(BLOCKS * BLOCK_FRAMES / block, block);
        let (frames, name) = (feed.frames, feed.name.clone());
        // Made here and dropped at once: a part that cannot be measured is refused before anything
        // is read.
        for part in [Some(part), camera.background].into_iter().flatten() {
            let mut memory = TrackerMemory::new(part.width, part.height);
            Engine::new(part, camera.timing, camera.bits, 1, &mut memory, &name)?;
        }
        std::thread::spawn(move || run(feed, part, groups, outlet));
        Ok(Self {
            inlet,
            warning: None,
            camera,
            part,
            frames,
            name,
            quiet: false,
        })
    }

    /// The next frame's displacements; `None` after the last.
    ///
    /// # Errors
    /// [`Failure::Input`] when the input turns out to be unusable at this point; what came before was
    /// good.
    pub fn next_frame(&mut self) -> Result<Option<FrameShifts>, Failure> {
        match self.inlet.receive() {
            Next::Item(mut frame) => {
                if let Some(note) = frame.note.take()
                    && !self.quiet
                {
                    eprintln!("rowtone: {}: {note}", self.name);
                }
                Ok(Some(frame))
            }
            Next::End(ending) => {
                self.warning = ending?;
                Ok(None)
            }
            Next::Gone => Ok(None),
        }
    }

    /// Gives a frame's buffers back.
    pub fn recycle(&mut self, frame: FrameShifts) {
        self.inlet.recycle(frame);
    }

    /// Something to tell the user after the last frame.
    pub fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }
}

/// The line thread.
fn run(mut feed: Feed, part: Rect, groups: Option<Group>, mut to: Outlet<FrameShifts, Ending>) {
    let memory_for = |part: &Rect| TrackerMemory::new(part.width, part.height);
    let mut memory = memory_for(&part);
    let mut still_memory = feed.camera.background.as_ref().map(memory_for);
    let (kept, ending) = keep_first(&mut feed);
    let whole = Region::whole(&part);
    let region = match feed.camera.part.is_none() {
        true => region::choose(&kept, &part, &feed.camera.timing),
        false => whole.clone(),
    };
    let note = (region != whole).then(|| told(&region, &feed.camera));
    let ending = Lines::new(feed, part, &region, &mut memory, still_memory.as_mut()).and_then(
        |mut lines| {
            lines.binner = groups.map(Binner::new);
            lines.run(kept, ending, note, &mut to)
        },
    );
    to.end(ending);
}

/// What `--roi auto` chose.
fn told(region: &Region, camera: &Camera) -> String {
    let Region { columns, rows } = region;
    let part = Rect {
        x: columns.start,
        y: rows.start,
        width: columns.len(),
        height: rows.len(),
    };
    // As the user gives it: in the picture as it was.
    let (width, height) = camera.size;
    let part = camera.turn.back().part(part, width, height);
    format!(
        "--roi auto measures {},{},{},{}: the rest does not move with it (--roi full for all of it)",
        part.x, part.y, part.width, part.height
    )
}

/// The frames to learn from, and whether more follow.
fn keep_first(feed: &mut Feed) -> (Vec<Frame>, Result<bool, Failure>) {
    let (width, height) = feed.camera.size;
    let most = (LEARN_BYTES / (width * height)).clamp(2, LEARN_FRAMES);
    let mut kept = Vec::new();
    while kept.len() < most {
        match feed.next_frame() {
            Ok(Some(frame)) => kept.push(frame),
            Ok(None) => return (kept, Ok(false)),
            Err(failure) => return (kept, Err(failure)),
        }
    }
    (kept, Ok(true))
}

/// State of the line thread.
struct Lines<'a> {
    feed: Feed,
    moving: Engine<'a>,
    still: Option<Engine<'a>>,
    /// The background's rows of this frame.
    still_rows: Vec<Displacement>,
    /// Where rows are combined.
    binner: Option<Binner>,
}

impl<'a> Lines<'a> {
    fn new(
        feed: Feed,
        part: Rect,
        region: &Region,
        memory: &'a mut TrackerMemory,
        still_memory: Option<&'a mut TrackerMemory>,
    ) -> Result<Self, Failure> {
        let camera = &feed.camera;
        let learn = LEARN_FRAMES as u16;
        let engine =
            |part, memory| Engine::new(part, camera.timing, camera.bits, learn, memory, &feed.name);
        let columns = Rect {
            x: region.columns.start,
            width: region.columns.len(),
            ..part
        };
        let first = region.rows.start - part.y;
        let moving = engine(columns, memory)?.only_rows(first..first + region.rows.len());
        let still = match (camera.background, still_memory) {
            (Some(part), Some(memory)) => Some(engine(part, memory)?),
            _ => None,
        };
        Ok(Self {
            feed,
            moving,
            still,
            still_rows: Vec::new(),
            binner: None,
        })
    }

    /// Learns, then measures every frame. The warning at the end is the feed's.
    fn run(
        &mut self,
        kept: Vec<Frame>,
        mut ending: Result<bool, Failure>,
        mut note: Option<String>,
        to: &mut Outlet<FrameShifts, Ending>,
    ) -> Ending {
        if kept.len() < 2 {
            ending?;
            return Err(Failure::input(format!(
                "{}: only one frame: motion shows only from frame to frame",
                self.feed.name
            )));
        }
        // The first round only has to find the motion: some frames, spread over all of them, will do.
        let rough = kept.len().div_ceil(ROUGH_FRAMES);
        for step in [rough, 1] {
            for engine in [Some(&mut self.moving), self.still.as_mut()]
                .into_iter()
                .flatten()
            {
                kept.iter()
                    .step_by(step)
                    .for_each(|frame| engine.learn(frame));
                engine.end_round();
            }
        }
        for frame in kept {
            if !self.measure(frame, note.take(), to) {
                return Ok(None);
            }
        }
        while let Ok(true) = ending {
            match self.feed.next_frame() {
                Ok(Some(frame)) => {
                    if !self.measure(frame, None, to) {
                        return Ok(None);
                    }
                }
                Ok(None) => ending = Ok(false),
                Err(failure) => ending = Err(failure),
            }
        }
        ending.map(|_| self.feed.warning().map(str::to_owned))
    }

    /// Measures a frame and sends what came of it. `false` when nobody listens any more.
    fn measure(
        &mut self,
        frame: Frame,
        note: Option<String>,
        to: &mut Outlet<FrameShifts, Ending>,
    ) -> bool {
        let Some(mut shifts) = to.spare() else {
            return false;
        };
        shifts.number = frame.number;
        shifts.start_ns = frame.start_ns;
        shifts.note = note;
        shifts.rows.clear();
        shifts.samples.clear();
        if let Some(binner) = &mut self.binner {
            binner.set_curvature(self.moving.curvature());
        }
        let (rows, samples) = (&mut shifts.rows, &mut shifts.samples);
        match (&mut self.still, &mut self.binner) {
            (None, Some(binner)) => {
                let take = |sample| samples.push(sample);
                shifts.unmeasured = self.moving.measure_into(&frame, binner, take);
            }
            (still, binner) => {
                shifts.unmeasured = self.moving.measure(&frame, |row| rows.push(row));
                if let Some(still) = still {
                    self.still_rows.clear();
                    still.measure(&frame, |row| self.still_rows.push(row));
                    background::subtract(rows, &self.still_rows);
                }
                if let Some(binner) = binner {
                    samples.extend(rows.drain(..).filter_map(|row| binner.push(row)));
                }
            }
        }
        // No group reaches over the end of a frame.
        samples.extend(self.binner.as_mut().and_then(Binner::finish));
        self.feed.recycle(frame);
        to.put(shifts)
    }
}
