//! The line path: a frame's rows through the core's line side into the window being collected.
//!
//! Nothing here waits, and nothing is allocated after [`Lines::new`].

use rowtone::camera::{Line, Pixels, RawError, RawFormat};
use rowtone::pipeline::{Collector, Light, LineSide};
use rowtone::spectrum::{self, SampleBuffer};
use rowtone::tracker::{self, Counts, Storage, Tracker};
use rowtone_page::frames::Layout;
use rowtone_page::live::Live;
use rowtone_page::motion::MotionWriter;

use crate::capture::Frame;
use crate::clock::{Due, FrameClock};
use crate::setup::Setup;

/// See the [module](self).
#[derive(Debug)]
pub struct Lines<'a> {
    setup: &'a Setup,
    lines: LineSide<'a>,
    collector: Collector<'a>,
    clock: FrameClock,
    room: Room,
    /// Bytes of a whole frame.
    frame_bytes: usize,
    /// Displacements on their way to the page, and whether somebody looks at it.
    motion: MotionWriter,
    shown: bool,
}

/// Where rows of more than 8 bits are unpacked to, or the upper bytes of right-aligned words.
#[derive(Debug)]
struct Room {
    words: Vec<u16>,
    upper: Vec<u8>,
}

/// Why the core refused.
#[derive(Clone, Debug, PartialEq)]
pub enum LinesError {
    /// The tracker.
    Tracker(tracker::ConfigError),
    /// The spectrum.
    Spectrum(spectrum::ConfigError),
}

impl std::fmt::Display for LinesError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Tracker(e) => e.fmt(f),
            Self::Spectrum(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for LinesError {}

impl<'a> Lines<'a> {
    /// A line path that has learned nothing yet.
    ///
    /// # Errors
    /// [`LinesError`] where the core refuses the setup.
    pub fn new(
        setup: &'a Setup,
        clock: FrameClock,
        (tracker, line_room): (Storage<'a>, &'a mut [u8]),
        collected: SampleBuffer<'a>,
    ) -> Result<Self, LinesError> {
        let collector = Collector::new(&setup.spectrum, setup.group, collected);
        let last_row = usize::from(setup.part.y + setup.part.height - 1);
        let shape = &setup.shape;
        let line_end = shape.format.bytes((setup.part.x + setup.part.width).into());
        Ok(Self {
            lines: LineSide::new(setup.tracker, setup.group, tracker)
                .map_err(LinesError::Tracker)?
                .with_line_room(line_room),
            collector: collector.map_err(LinesError::Spectrum)?,
            clock,
            room: Room {
                words: vec![0; setup.part.width.into()],
                upper: vec![0; setup.part.width.into()],
            },
            frame_bytes: last_row * shape.stride + line_end,
            motion: MotionWriter::default(),
            shown: false,
            setup,
        })
    }

    /// Takes a frame. Whenever a window is complete, `complete` is called with what is to be handed over.
    pub fn frame(&mut self, frame: &Frame<'_>, complete: &mut dyn FnMut(&mut Collector<'a>)) {
        let whole = frame.bytes.len() >= self.frame_bytes;
        let Some(due) = self.clock.frame(frame, whole) else {
            return;
        };
        // Once a frame, not once a line: how a row is cut.
        let format = self.setup.shape.format;
        match format {
            _ if self.setup.tracker.bits > 8 => {
                self.rows(due, frame.bytes, complete, &|bytes, width, room| {
                    format.line(bytes, width, &mut room.words)
                })
            }
            RawFormat::Raw8 => self.rows(due, frame.bytes, complete, &|bytes, width, room| {
                RawFormat::Raw8.upper_line(bytes, width, &mut room.upper)
            }),
            RawFormat::Packed10 => self.rows(due, frame.bytes, complete, &|bytes, width, room| {
                RawFormat::Packed10.upper_line(bytes, width, &mut room.upper)
            }),
            RawFormat::Packed12 => self.rows(due, frame.bytes, complete, &|bytes, width, room| {
                RawFormat::Packed12.upper_line(bytes, width, &mut room.upper)
            }),
            RawFormat::Raw16 => self.rows(due, frame.bytes, complete, &|bytes, width, room| {
                RawFormat::Raw16.upper_line(bytes, width, &mut room.upper)
            }),
            RawFormat::Raw10 | RawFormat::Raw12 => {
                self.rows(due, frame.bytes, complete, &|bytes, width, room| {
                    format.upper_line(bytes, width, &mut room.upper)
                })
            }
        }
    }

    /// The rows of a frame that is whole, each cut by `cut` from the bytes that it begins with.
    #[inline(always)]
    fn rows(
        &mut self,
        due: Due,
        bytes: &[u8],
        complete: &mut dyn FnMut(&mut Collector<'a>),
        cut: &impl for<'b> Fn(&'b [u8], usize, &'b mut Room) -> Result<Pixels<'b>, RawError>,
    ) {
        let Setup {
            shape,
            part,
            group,
            part_start_ns,
            ..
        } = *self.setup;
        let start_ns = due.start_ns.saturating_add(part_start_ns);
        let first = usize::from(part.y) * shape.stride + shape.format.bytes(part.x.into());
        let mut rest = bytes.get(first..).unwrap_or_default();
        for row in 0..part.height {
            let Ok(pixels) = cut(rest, part.width.into(), &mut self.room) else {
                return; // `whole` rules it out
            };
            let line = Line {
                frame: due.number,
                row,
                start_ns: start_ns.saturating_add(group.timing().start_ns(row)),
                pixels,
            };
            rest = rest.get(shape.stride..).unwrap_or_default();
            let Some(&reading) = self.lines.push(&line) else {
                continue;
            };
            if let (true, Some(sample)) = (self.shown, &reading.sample) {
                self.motion.sample(sample);
            }
            if self.collector.push(reading) {
                complete(&mut self.collector);
            }
        }
    }

    /// Shows a frame that was taken, and how it moved, to whoever looks at the page. Nothing is waited for: while nobody
    /// looks it costs a look at a clock.
    pub fn show(&mut self, frame: &Frame<'_>, live: &Live) {
        let shape = &self.setup.shape;
        self.shown = live.frames.is_wanted();
        if !self.shown || !frame.intact {
            return;
        }
        self.motion.hand_over(&live.motion);
        let layout = Layout {
            width: shape.width,
            height: shape.height,
            stride: shape.stride,
            format: shape.format,
            bayer: shape.bayer,
        };
        let start_ns = frame.start_ns.unwrap_or_default();
        live.frames
            .offer(frame.sequence, start_ns, layout, frame.bytes);
    }

    /// The end: what is left becomes the last window, if it is long enough.
    pub fn finish(&mut self, complete: &mut dyn FnMut(&mut Collector<'a>)) {
        let last = self.lines.finish();
        let full = last.is_some_and(|reading| self.collector.push(reading));
        if full {
            complete(&mut self.collector);
        }
        self.collector.push(self.lines.rest());
        if self.collector.finish() {
            complete(&mut self.collector);
        }
    }

    /// The frames so far.
    pub fn clock(&mut self) -> &mut FrameClock {
        &mut self.clock
    }

    /// What became of the lines so far.
    pub fn counts(&self) -> Counts {
        self.lines.counts()
    }

    /// How bright the picture is.
    pub fn light(&self) -> Light {
        self.lines.light()
    }

    /// The tracker.
    pub fn tracker(&self) -> &Tracker<'a> {
        self.lines.tracker()
    }
}
