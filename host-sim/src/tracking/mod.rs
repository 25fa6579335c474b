//! From frames to displacements, on a thread of its own.
//!
//! [`Shifts::start`] takes a [`Feed`] and tracks its lines; [`Shifts::next_frame`] delivers what the
//! lines of each frame came to, in order. A tracker first learns its reference; so that nothing is
//! lost, the first frames are kept until it has, and then measured like all others: a clip of six frames
//! gets the displacements of six frames. Queues are short and their buffers are used again, so memory
//! does not grow with the length of the recording, and nothing is sent line by line.

mod background;
mod engine;
mod region;

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use rowtone::timeline::Displacement;

pub use background::subtract;
pub use engine::{Buffers, Engine, Unmeasured};
use region::Region;

use crate::failure::Failure;
use crate::input::{Camera, Feed, Frame, Rect};

/// Frames that the reference is learned from.
const LEARN_FRAMES: usize = 30;
/// Frames of the first round.
const ROUGH_FRAMES: usize = 10;
/// Fewer where they are so large that keeping them would take more than this, bytes of luma.
const LEARN_BYTES: usize = 512 << 20;
/// Frames of displacements on their way: the lines go on while a report is computed.
const QUEUE: usize = 32;

/// What the lines of one frame came to.
#[derive(Debug, Default)]
pub struct FrameShifts {
    /// Number of the frame; a lost one leaves a gap.
    pub number: u32,
    /// Start of exposure of its first row, ns.
    pub start_ns: i64,
    /// Rows that were measured, from the top of the part, the background's motion subtracted.
    pub rows: Vec<Displacement>,
    /// Rows that were not.
    pub unmeasured: Unmeasured,
    still: Vec<Displacement>,
}

enum Message {
    Frame(FrameShifts),
    Failed(Failure),
    /// Something to tell the user at once.
    Note(String),
    Done {
        warning: Option<String>,
    },
}

/// The displacements of a recording, frame by frame.
#[derive(Debug)]
pub struct Shifts {
    messages: Receiver<Message>,
    recycled: SyncSender<FrameShifts>,
    warning: Option<String>,
    /// The camera that recorded them.
    pub camera: Camera,
    /// The part of the turned picture that is measured.
    pub part: Rect,
    /// How many frames there are, where the file's length tells.
    pub frames: Option<u64>,
    /// What to call the recording in messages.
    pub name: String,
}

impl Shifts {
    /// Starts tracking.
    ///
    /// # Errors
    /// [`Failure`] when the part to measure cannot be measured.
    pub fn start(feed: Feed) -> Result<Self, Failure> {
        let camera = feed.camera.clone();
        let part = camera.part_or_rest()?;
        let (to_us, messages) = sync_channel(QUEUE);
        let (recycled, used) = sync_channel(QUEUE);
        for _ in 0..QUEUE {
            let _ = recycled.try_send(FrameShifts::default());
        }
        let (frames, name) = (feed.frames, feed.name.clone());
        // Made here and dropped at once: a part that cannot be measured is refused before anything
        // is read.
        for part in [Some(part), camera.background].into_iter().flatten() {
            let mut buffers = Buffers::new(&part);
            Engine::new(part, camera.timing, camera.bits, 1, &mut buffers, &name)?;
        }
        std::thread::spawn(move || run(feed, part, &to_us, &used));
        Ok(Self {
            messages,
            recycled,
            warning: None,
            camera,
            part,
            frames,
            name,
        })
    }

    /// The next frame's displacements; `None` after the last.
    ///
    /// # Errors
    /// [`Failure::Input`] when the input turns out to be unusable at this point; what came before was
    /// good.
    pub fn next_frame(&mut self) -> Result<Option<FrameShifts>, Failure> {
        loop {
            match self.messages.recv() {
                Ok(Message::Frame(mut frame)) => {
                    if self.camera.background.is_some() {
                        background::subtract(&mut frame.rows, &frame.still);
                    }
                    return Ok(Some(frame));
                }
                Ok(Message::Note(note)) => eprintln!("rowtone: {}: {note}", self.name),
                Ok(Message::Failed(failure)) => return Err(failure),
                Ok(Message::Done { warning }) => {
                    self.warning = warning;
                    return Ok(None);
                }
                Err(_) => return Ok(None),
            }
        }
    }

    /// Gives a frame's buffers back.
    pub fn recycle(&self, frame: FrameShifts) {
        let _ = self.recycled.try_send(frame);
    }

    /// Something to tell the user after the last frame.
    pub fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }
}

/// The line thread.
fn run(mut feed: Feed, part: Rect, to: &SyncSender<Message>, used: &Receiver<FrameShifts>) {
    let mut buffers = Buffers::new(&part);
    let mut still_buffers = feed.camera.background.as_ref().map(Buffers::new);
    let (kept, ending) = keep_first(&mut feed);
    let whole = Region::whole(&part);
    let region = match feed.camera.part.is_none() {
        true => region::choose(&kept, &part),
        false => whole.clone(),
    };
    if region != whole {
        let _ = to.send(Message::Note(told(&region)));
    }
    let outcome = Lines::new(feed, part, &region, &mut buffers, still_buffers.as_mut())
        .and_then(|mut lines| lines.run(kept, ending, to, used));
    let message = match outcome {
        Ok(warning) => Message::Done { warning },
        Err(failure) => Message::Failed(failure),
    };
    // Nobody listens any more: then nobody needs to know.
    let _ = to.send(message);
}

/// What `--roi auto` chose.
fn told(region: &Region) -> String {
    let Region { columns, rows } = region;
    format!(
        "--roi auto measures {},{},{},{}: the rest stands still (--roi full for all of it)",
        columns.start,
        rows.start,
        columns.len(),
        rows.len()
    )
}

/// The frames to learn from, and whether more follow.
fn keep_first(feed: &mut Feed) -> (Vec<Frame>, Result<bool, Failure>) {
    let (width, height) = feed.camera.size;
    let most = (LEARN_BYTES / (width * height)).clamp(2, LEARN_FRAMES);
    let mut kept = Vec::new();
    while kept.len() < most {
        match feed.next_frame() {
            Ok(Some(frame)) => {
                kept.push(frame);
                feed.replace();
            }
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
}

impl<'a> Lines<'a> {
    fn new(
        feed: Feed,
        part: Rect,
        region: &Region,
        buffers: &'a mut Buffers,
        still_buffers: Option<&'a mut Buffers>,
    ) -> Result<Self, Failure> {
        let camera = &feed.camera;
        let learn = LEARN_FRAMES as u16;
        let engine = |part, buffers| {
            Engine::new(part, camera.timing, camera.bits, learn, buffers, &feed.name)
        };
        let columns = Rect {
            x: region.columns.start,
            width: region.columns.len(),
            ..part
        };
        let first = region.rows.start - part.y;
        let moving = engine(columns, buffers)?.only_rows(first..first + region.rows.len());
        let still = match (camera.background, still_buffers) {
            (Some(part), Some(buffers)) => Some(engine(part, buffers)?),
            _ => None,
        };
        Ok(Self {
            feed,
            moving,
            still,
        })
    }

    /// Learns, then measures every frame. The warning at the end is the feed's.
    fn run(
        &mut self,
        kept: Vec<Frame>,
        mut ending: Result<bool, Failure>,
        to: &SyncSender<Message>,
        used: &Receiver<FrameShifts>,
    ) -> Result<Option<String>, Failure> {
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
            if !self.measure(frame, to, used) {
                return Ok(None);
            }
        }
        while let Ok(true) = ending {
            match self.feed.next_frame() {
                Ok(Some(frame)) => {
                    if !self.measure(frame, to, used) {
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
        to: &SyncSender<Message>,
        used: &Receiver<FrameShifts>,
    ) -> bool {
        let Ok(mut shifts) = used.recv() else {
            return false;
        };
        shifts.number = frame.number;
        shifts.start_ns = frame.start_ns;
        shifts.rows.clear();
        shifts.still.clear();
        shifts.unmeasured = self.moving.measure(&frame, &mut shifts.rows);
        if let Some(still) = &mut self.still {
            still.measure(&frame, &mut shifts.still);
        }
        self.feed.recycle(frame);
        to.send(Message::Frame(shifts)).is_ok()
    }
}
