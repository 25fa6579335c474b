//! Frames from a thread of their own, in a ring of buffers that are used again and again.
//!
//! The reader waits when the ring is full and whoever measures waits when it is empty, so memory stays
//! what it is however long the recording. Frames that are kept (while a reference is learned) are
//! replaced by new buffers, so keeping does not stop the reader.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::clock::{Clock, Times};
use super::error::InputError;
use super::frame_read::Next;
use super::pts::PtsError;
use super::recording::{About, Recording};
use super::source::FrameSource;
use super::{Camera, CameraOptions, ClipError, Frame, Turn};
use crate::ring::{Inlet, Next as Arrival, Outlet, ring};

/// Frames of a file ahead of the lines, bytes of luma: enough for the millisecond or two in which the reading thread's
/// processor computes a report.
const AHEAD_BYTES: usize = 15 << 20;
/// But so many frames, of a pipe no more.
const LEAST_AHEAD: usize = 3;
/// Blocks of frames ahead of the lines: handing one over costs some 10 µs. Whoever reads a pipe may be waiting for each
/// frame and gets it at once.
const BLOCKS: usize = 6;
/// Most frames of a block.
const BLOCK_FRAMES: usize = 64;

/// How often it is asked whether to stop, where no frame comes.
const ASKED_EVERY: Duration = Duration::from_millis(100);

/// How the reading ended.
#[derive(Debug)]
enum Ending {
    /// At the end of the file; with something to tell the user.
    End(Option<String>),
    /// Inside a frame: this many bytes of those it should have. The frames before it are good.
    Truncated { have: usize, need: usize },
    /// It could not go on.
    Failed(ClipError),
}

/// The frames of a recording, in order.
#[derive(Debug)]
pub struct Feed {
    inlet: Inlet<Frame, Ending>,
    /// The camera that recorded them.
    pub camera: Camera,
    /// What to call the recording in messages.
    pub name: String,
    /// How many frames there are, where the file's length tells.
    pub frames: Option<u64>,
    /// What is known of the recording beside that.
    pub about: About,
    /// What to tell the user before anything is measured.
    pub notes: Vec<String>,
    warning: Option<String>,
    delivered: u64,
    /// Columns and rows of a frame as it is stored.
    size: (usize, usize),
    stop: Option<Arc<AtomicBool>>,
    onlookers: Vec<Onlooker>,
}

/// Who is shown every frame.
struct Onlooker(Box<dyn FnMut(&Frame) + Send>);

impl std::fmt::Debug for Onlooker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Onlooker")
    }
}

impl Feed {
    /// Opens the input, reads its header, checks the options against it and starts the reading thread.
    ///
    /// # Errors
    /// [`ClipError`] for options or an input that cannot be used.
    pub fn open(args: &CameraOptions) -> Result<Self, ClipError> {
        args.check()?;
        Self::start(args, Recording::open(&args.input, args.name())?, None)
    }

    /// Reads `from` instead of the input that `args` name.
    ///
    /// # Errors
    /// As [`Feed::open`].
    pub fn read(args: &CameraOptions, from: impl Read + Send + 'static) -> Result<Self, ClipError> {
        args.check()?;
        Self::start(args, Recording::read(from, args.name())?, None)
    }

    /// Reads `from`, of which the frames' times are known otherwise than by a file that `args` name.
    ///
    /// # Errors
    /// As [`Feed::open`].
    pub fn at_times(
        args: &CameraOptions,
        from: impl Read + Send + 'static,
        times: Times,
    ) -> Result<Self, ClipError> {
        args.check()?;
        let mut recording = Recording::read(from, args.name())?;
        recording.about.frames = Some(times.len() as u64);
        Self::start(args, recording, Some(Clock::Times(times)))
    }

    /// Starts the reading thread. `clock`: the frames' times, where `args` do not say.
    fn start(
        args: &CameraOptions,
        recording: Recording,
        clock: Option<Clock>,
    ) -> Result<Self, ClipError> {
        let Recording { source, about } = recording;
        let name = args.name().to_owned();
        let clock = match clock {
            Some(clock) => clock,
            None => args.clock(source.header(), &about)?,
        };
        let camera = args.camera(source.header(), &clock)?;
        let notes = args.notes(source.header(), &about);
        let frames = about.frames;
        let size = (source.header().width, source.header().height);
        let ahead = match frames {
            Some(_) => AHEAD_BYTES / source.header().luma_bytes(),
            None => LEAST_AHEAD,
        };
        let block = (ahead / BLOCKS).clamp(1, BLOCK_FRAMES);
        let blocks = (ahead / block).clamp(LEAST_AHEAD, BLOCKS);
        let (outlet, inlet) = ring(blocks, block);
        let pts = args.pts.as_ref().map(|p| p.display().to_string());
        let thread = Reading {
            source,
            clock,
            turn: camera.turn,
            name: name.clone(),
            pts: pts.unwrap_or_default(),
            frames,
            ends_in_a_frame: about.ends_in_a_frame,
        };
        std::thread::spawn(move || thread.run(outlet));
        Ok(Self {
            inlet,
            camera,
            name,
            frames,
            notes,
            about,
            warning: None,
            delivered: 0,
            size,
            stop: None,
            onlookers: Vec::new(),
        })
    }

    /// Ends the recording at the next frame as soon as this says so, as if it were its last.
    pub fn stop_when(&mut self, stop: Arc<AtomicBool>) {
        self.stop = Some(stop);
    }

    /// Shows every frame to `onlooker` too, before it is measured, on the thread that measures.
    pub fn show_to(&mut self, onlooker: impl FnMut(&Frame) + Send + 'static) {
        self.onlookers.push(Onlooker(Box::new(onlooker)));
    }

    /// The next frame; `None` after the last.
    ///
    /// # Errors
    /// [`ClipError::Input`] when the input turns out to be unusable at this point: the frames before it
    /// were good. A recording without any frame is unusable.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, ClipError> {
        let stopped = || {
            self.stop
                .as_ref()
                .is_some_and(|stop| stop.load(Ordering::Relaxed))
        };
        let arrival = loop {
            if stopped() {
                return Ok(None);
            }
            if let Some(arrival) = self.inlet.receive_within(ASKED_EVERY) {
                break arrival;
            }
        };
        match arrival {
            Arrival::Item(frame) => {
                self.delivered += 1;
                if self.delivered == 2
                    && let Some(doubt) = self.camera.doubt.take()
                {
                    return Err(doubt.into());
                }
                for Onlooker(see) in &mut self.onlookers {
                    see(&frame);
                }
                Ok(Some(frame))
            }
            Arrival::End(Ending::Failed(error)) => Err(error),
            Arrival::End(Ending::Truncated { have, need }) if self.delivered > 0 => {
                self.warning = Some(format!(
                    "{}: the last frame is cut off ({have} of {need} bytes): the {} before it are \
                     used",
                    self.name, self.delivered
                ));
                Ok(None)
            }
            Arrival::End(Ending::Truncated { have, need }) => {
                let (width, height) = self.size;
                let why = InputError::FirstFrameCut {
                    have,
                    need,
                    width,
                    height,
                };
                Err(ClipError::input(&self.name, why))
            }
            Arrival::End(Ending::End(warning)) if self.delivered > 0 => {
                self.warning = warning.map(|warning| format!("{}: {warning}", self.name));
                Ok(None)
            }
            Arrival::Gone if self.delivered > 0 => Ok(None),
            Arrival::End(Ending::End(complaint)) => Err(ClipError::input(
                &self.name,
                InputError::NoFrame { complaint },
            )),
            Arrival::Gone => {
                let why = InputError::NoFrame { complaint: None };
                Err(ClipError::input(&self.name, why))
            }
        }
    }

    /// What is wrong with a frame that was cut off while it was read.
    pub fn cut_short(&self, frame: &Frame) -> ClipError {
        let frame = frame.number;
        ClipError::input(&self.name, InputError::CutWhileRead { frame })
    }

    /// Gives a frame's buffers back. A frame that is kept is replaced by a new one.
    pub fn recycle(&mut self, frame: Frame) {
        self.inlet.recycle(frame);
    }

    /// Something to tell the user after the last frame.
    pub fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }
}

/// The reading thread.
struct Reading {
    source: Box<dyn FrameSource + Send>,
    clock: Clock,
    turn: Turn,
    name: String,
    pts: String,
    frames: Option<u64>,
    ends_in_a_frame: bool,
}

impl Reading {
    /// Reads until the end, or until nobody listens any more.
    fn run(mut self, mut to: Outlet<Frame, Ending>) {
        for index in 0.. {
            let Some(mut frame) = to.spare() else {
                return;
            };
            let ending = match self.read(index, &mut frame) {
                Ok(Next::Frame { .. }) if to.put(frame) => continue,
                Ok(Next::Frame { .. }) => return,
                Ok(Next::End) => self.times_left(index).map_or_else(
                    || Ending::End(self.source.warning()),
                    |have| Ending::Failed(self.too_many_times(have, index)),
                ),
                Ok(Next::Truncated { have, need }) => Ending::Truncated { have, need },
                Err(error) => Ending::Failed(error),
            };
            return to.end(ending);
        }
    }

    fn read(&mut self, index: u64, frame: &mut Frame) -> Result<Next, ClipError> {
        let next = self.source.next_frame(&mut frame.raw)?;
        if let Next::Frame { luma } = next {
            self.check_times(index)?;
            let stamp = self.source.stamp();
            frame.coding = stamp.coding;
            if let Some((number, start_ns)) = self.clock.frame(index, stamp.time_ns) {
                (frame.number, frame.start_ns) = (number, start_ns);
            }
            frame.prepare(self.source.header(), luma, self.turn);
        }
        Ok(next)
    }

    /// Every frame has a time. With the first frame it is already clear whether the whole file has.
    fn check_times(&self, index: u64) -> Result<(), ClipError> {
        let Clock::Times(times) = &self.clock else {
            return Ok(());
        };
        let have = times.len() as u64;
        let need = match self.frames {
            Some(frames) if index == 0 => frames,
            _ => index + 1,
        };
        if let Some(frames) = self.frames
            && index == 0
            && have > frames + u64::from(self.ends_in_a_frame)
        {
            return Err(self.too_many_times(have, frames));
        }
        if need <= have {
            return Ok(());
        }
        Err(self.times(PtsError::TooFew {
            have,
            need,
            at_least: self.frames.is_none(),
            recording: self.name.clone(),
        }))
    }

    /// How many times there are, where the recording has ended after `frames` frames and has fewer.
    fn times_left(&self, frames: u64) -> Option<u64> {
        match &self.clock {
            Clock::Times(times) if self.frames.is_none() && frames > 0 => {
                Some(times.len() as u64).filter(|&have| have > frames)
            }
            _ => None,
        }
    }

    fn too_many_times(&self, have: u64, frames: u64) -> ClipError {
        self.times(PtsError::TooMany {
            have,
            frames,
            recording: self.name.clone(),
        })
    }

    /// Something is wrong with the file of times.
    fn times(&self, why: PtsError) -> ClipError {
        ClipError::Times {
            path: self.pts.clone(),
            why,
        }
    }
}
