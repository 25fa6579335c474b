//! Frames from a thread of their own, in a ring of buffers that are used again and again.
//!
//! The reader waits when the ring is full and whoever measures waits when it is empty, so memory stays
//! what it is however long the recording. Frames that are kept (while a reference is learned) are
//! replaced by new buffers, so keeping does not stop the reader.

use std::fs::File;
use std::io::{self, Read};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use super::clock::Clock;
use super::y4m::{Next, Reader};
use super::{Camera, CameraArgs, Frame, Turn};
use crate::failure::Failure;

/// Frames read ahead. Few, so that they stay in the cache between reading and measuring.
const RING: usize = 4;

/// What the reading thread has to say.
enum Message {
    Frame(Frame),
    /// The file ended inside a frame; the frames before it are good.
    Truncated(String),
    Failed(Failure),
}

/// The frames of a recording, in order.
#[derive(Debug)]
pub struct Feed {
    messages: Receiver<Message>,
    recycled: SyncSender<Frame>,
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
            return Self::read(args, io::stdin(), None);
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
        let bytes = meta.is_file().then_some(meta.len());
        Self::read(args, file, bytes)
    }

    /// Reads `from`, which has `bytes` bytes where that is known, instead of the input that `args` name.
    ///
    /// # Errors
    /// As [`Feed::open`].
    pub fn read(
        args: &CameraArgs,
        from: impl Read + Send + 'static,
        bytes: Option<u64>,
    ) -> Result<Self, Failure> {
        args.check()?;
        let name = args.name().to_owned();
        let reader = Reader::open(from, &name)?;
        let clock = args.clock(reader.header())?;
        let camera = args.camera(reader.header(), clock.fps())?;
        let frames = bytes
            .map(|all| all.saturating_sub(reader.header_bytes() as u64) / reader.stride() as u64);
        let (to_us, messages) = sync_channel(RING);
        let (recycled, used) = sync_channel(RING);
        for _ in 0..RING {
            let _ = recycled.try_send(Frame::default());
        }
        let pts = args.pts.as_ref().map(|p| p.display().to_string());
        let thread = Reading {
            reader,
            clock,
            turn: camera.turn,
            name: name.clone(),
            pts: pts.unwrap_or_default(),
            frames,
        };
        std::thread::spawn(move || thread.run(&to_us, &used));
        Ok(Self {
            messages,
            recycled,
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
        match self.messages.recv() {
            Ok(Message::Frame(frame)) => {
                self.delivered += 1;
                if self.delivered == 2
                    && let Some(doubt) = self.camera.doubt.take()
                {
                    return Err(doubt);
                }
                Ok(Some(frame))
            }
            Ok(Message::Failed(failure)) => Err(failure),
            Ok(Message::Truncated(text)) if self.delivered > 0 => {
                self.warning = Some(text);
                Ok(None)
            }
            Ok(Message::Truncated(text)) => Err(Failure::input(text)),
            Err(_) if self.delivered > 0 => Ok(None),
            Err(_) => Err(Failure::input(format!(
                "{}: there is no frame in it",
                self.name
            ))),
        }
    }

    /// Gives a frame's buffers back.
    pub fn recycle(&self, frame: Frame) {
        // A full ring means that kept frames came back late: let the surplus go.
        let _ = self.recycled.try_send(frame);
    }

    /// Puts an empty buffer into the ring in place of a frame that is kept.
    pub fn replace(&self) {
        self.recycle(Frame::default());
    }

    /// Something to tell the user after the last frame.
    pub fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }
}

/// The reading thread.
struct Reading<R> {
    reader: Reader<R>,
    clock: Clock,
    turn: Turn,
    name: String,
    pts: String,
    frames: Option<u64>,
}

impl<R: Read> Reading<R> {
    /// Reads until the end, or until nobody listens any more.
    fn run(mut self, to: &SyncSender<Message>, used: &Receiver<Frame>) {
        for index in 0.. {
            let Ok(mut frame) = used.recv() else {
                return;
            };
            let message = match self.read(index, &mut frame) {
                Ok(Next::Frame { .. }) => Message::Frame(frame),
                Ok(Next::End) => return,
                Ok(Next::Truncated { have, need }) => {
                    Message::Truncated(self.truncated(index, have, need))
                }
                Err(failure) => Message::Failed(failure),
            };
            let last = !matches!(message, Message::Frame(_));
            if to.send(message).is_err() || last {
                return;
            }
        }
    }

    fn read(&mut self, index: u64, frame: &mut Frame) -> Result<Next, Failure> {
        let next = self.reader.read_frame(&mut frame.raw)?;
        if let Next::Frame { luma } = next {
            self.check_times(index)?;
            if let Some((number, start_ns)) = self.clock.frame(index) {
                (frame.number, frame.start_ns) = (number, start_ns);
            }
            frame.prepare(self.reader.header(), luma, self.turn);
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
        let size = self.reader.header();
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
