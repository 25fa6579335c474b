//! Frames from a thread of their own, in a ring of buffers that are used again and again.
//!
//! The reader waits when the ring is full and whoever measures waits when it is empty, so memory stays
//! what it is however long the recording. Frames that are kept (while a reference is learned) are
//! replaced by new buffers, so keeping does not stop the reader.

use std::fs::File;
use std::io::{self, Read};

use super::clock::{Clock, Times};
use super::mapped::MappedReader;
use super::y4m::{FrameSource, Next, Reader};
use super::{Camera, CameraArgs, Frame, Turn};
use crate::ring::{Inlet, Next as Arrival, Outlet, ring};
use rowtone_failure::Failure;

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

/// How the reading ended.
#[derive(Debug)]
enum Ending {
    /// At the end of the file.
    End,
    /// Inside a frame; the frames before it are good.
    Truncated(String),
    /// It could not go on.
    Failed(Failure),
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
    warning: Option<String>,
    delivered: u64,
}

impl Feed {
    /// Opens the input, reads its header, checks the options against it and starts the reading thread.
    ///
    /// # Errors
    /// [`Failure`] for options or an input that cannot be used.
    pub fn open(args: &CameraArgs) -> Result<Self, Failure> {
        args.check()?;
        if args.input == "-" {
            return Self::read(args, io::stdin());
        }
        let cannot = |what: &str, error: &io::Error| {
            Failure::input(format!("{}: cannot be {what}: {error}", args.input))
        };
        let file = File::open(&args.input).map_err(|e| cannot("opened", &e))?;
        let meta = file.metadata().map_err(|e| cannot("read", &e))?;
        if meta.is_dir() {
            return Err(Failure::input(format!(
                "{}: is a folder: give a Y4M file",
                args.input
            )));
        }
        if !meta.is_file() {
            return Self::read(args, file);
        }
        let reader = Reader::open(file, args.name())?;
        let behind_header = meta.len().saturating_sub(reader.header_bytes() as u64);
        let frames = Some(behind_header / reader.stride() as u64);
        match MappedReader::new(&reader) {
            Ok(mapped) => Self::start(args, mapped, frames, None),
            Err(_) => Self::start(args, reader, frames, None),
        }
    }

    /// Reads `from` instead of the input that `args` name.
    ///
    /// # Errors
    /// As [`Feed::open`].
    pub fn read(args: &CameraArgs, from: impl Read + Send + 'static) -> Result<Self, Failure> {
        args.check()?;
        let reader = Reader::open(from, args.name())?;
        Self::start(args, reader, None, None)
    }

    /// Reads `from`, of which the frames' times are known otherwise than by a file that `args` name.
    ///
    /// # Errors
    /// As [`Feed::open`].
    pub fn at_times(
        args: &CameraArgs,
        from: impl Read + Send + 'static,
        times: Times,
    ) -> Result<Self, Failure> {
        args.check()?;
        let reader = Reader::open(from, args.name())?;
        let frames = Some(times.len() as u64);
        Self::start(args, reader, frames, Some(Clock::Times(times)))
    }

    /// Starts the reading thread. `frames`: how many there are, where that is known; `clock`: their times, where `args`
    /// do not say.
    fn start(
        args: &CameraArgs,
        source: impl FrameSource + Send + 'static,
        frames: Option<u64>,
        clock: Option<Clock>,
    ) -> Result<Self, Failure> {
        let name = args.name().to_owned();
        let clock = match clock {
            Some(clock) => clock,
            None => args.clock(source.header())?,
        };
        let camera = args.camera(source.header(), clock.fps())?;
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
        };
        std::thread::spawn(move || thread.run(outlet));
        Ok(Self {
            inlet,
            camera,
            name,
            frames,
            warning: None,
            delivered: 0,
        })
    }

    /// The next frame; `None` after the last.
    ///
    /// # Errors
    /// [`Failure::Input`] when the input turns out to be unusable at this point: the frames before it
    /// were good. A recording without any frame is unusable.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, Failure> {
        match self.inlet.receive() {
            Arrival::Item(frame) => {
                self.delivered += 1;
                if self.delivered == 2
                    && let Some(doubt) = self.camera.doubt.take()
                {
                    return Err(doubt);
                }
                Ok(Some(frame))
            }
            Arrival::End(Ending::Failed(failure)) => Err(failure),
            Arrival::End(Ending::Truncated(text)) if self.delivered > 0 => {
                self.warning = Some(text);
                Ok(None)
            }
            Arrival::End(Ending::Truncated(text)) => Err(Failure::input(text)),
            Arrival::End(Ending::End) | Arrival::Gone if self.delivered > 0 => Ok(None),
            Arrival::End(Ending::End) | Arrival::Gone => Err(Failure::input(format!(
                "{}: there is no frame in it",
                self.name
            ))),
        }
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
struct Reading<S> {
    source: S,
    clock: Clock,
    turn: Turn,
    name: String,
    pts: String,
    frames: Option<u64>,
}

impl<S: FrameSource> Reading<S> {
    /// Reads until the end, or until nobody listens any more.
    fn run(mut self, mut to: Outlet<Frame, Ending>) {
        for index in 0.. {
            let Some(mut frame) = to.spare() else {
                return;
            };
            let ending = match self.read(index, &mut frame) {
                Ok(Next::Frame { .. }) if to.put(frame) => continue,
                Ok(Next::Frame { .. }) => return,
                Ok(Next::End) => Ending::End,
                Ok(Next::Truncated { have, need }) => {
                    Ending::Truncated(self.truncated(index, have, need))
                }
                Err(failure) => Ending::Failed(failure),
            };
            return to.end(ending);
        }
    }

    fn read(&mut self, index: u64, frame: &mut Frame) -> Result<Next, Failure> {
        let next = self.source.next_frame(&mut frame.raw)?;
        if let Next::Frame { luma } = next {
            self.check_times(index)?;
            if let Some((number, start_ns)) = self.clock.frame(index) {
                (frame.number, frame.start_ns) = (number, start_ns);
            }
            frame.prepare(self.source.header(), luma, self.turn);
        }
        Ok(next)
    }

    /// Every frame has a time. With the first frame it is already clear whether the whole file has.
    fn check_times(&self, index: u64) -> Result<(), Failure> {
        let Clock::Times(times) = &self.clock else {
            return Ok(());
        };
        let have = times.len() as u64;
        let need = match self.frames {
            Some(frames) if index == 0 => frames,
            _ => index + 1,
        };
        if need <= have {
            return Ok(());
        }
        let at_least = if self.frames.is_some() {
            ""
        } else {
            "at least "
        };
        Err(Failure::input(format!(
            "{}: only {have} times for {at_least}{need} frames of {}: every frame needs its own",
            self.pts, self.name
        )))
    }

    fn truncated(&self, index: u64, have: usize, need: usize) -> String {
        let size = self.source.header();
        if index == 0 {
            format!(
                "{}: not even one frame: {have} bytes where a frame of {}x{} has {need}",
                self.name, size.width, size.height
            )
        } else {
            format!(
                "{}: the last frame is cut off ({have} of {need} bytes): the {index} before it are \
                 used",
                self.name
            )
        }
    }
}
