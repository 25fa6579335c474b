//! The line path: a frame's rows through tracker and binner into the window being collected.
//!
//! Nothing here waits, and nothing is allocated after [`Lines::new`].

use rowtone::camera::{Line, Pixels, UpperBytes};
use rowtone::camera::{RawError, RawFormat};
use rowtone::pipeline::Collector;
use rowtone::report::{Warning, Warnings};
use rowtone::spectrum::{self, SampleBuffer};
use rowtone::timeline::Binner;
use rowtone::tracker::{self, Counts, Storage, Tracker};

use crate::capture::Frame;
use crate::clock::{Due, FrameClock};
use crate::setup::Setup;

/// See the [module](self).
#[derive(Debug)]
pub struct Lines<'a> {
    setup: &'a Setup,
    tracker: Tracker<'a>,
    binner: Binner,
    collector: Collector<'a>,
    clock: FrameClock,
    light: Light,
    room: Room,
    /// Where a row is brought together whose brightness is looked at.
    seen: Vec<u8>,
    /// Bytes of a whole frame.
    frame_bytes: usize,
    /// As they were when the last window was complete.
    told: Counts,
}

/// Where rows of more than 8 bits are unpacked to, or the upper bytes of right-aligned words.
#[derive(Debug)]
struct Room {
    words: Vec<u16>,
    upper: Vec<u8>,
}

/// How bright the picture is; shares from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// Mean value.
    pub mean: f32,
    /// Pixels at the upper end.
    pub saturated: f32,
}

impl Light {
    /// Too dark, or too many pixels saturated.
    pub fn is_bad(&self) -> bool {
        // Raw pixels have a black level of 6 % on these sensors.
        self.mean < 0.09 || self.saturated > 0.1
    }

    fn of(pixels: Pixels<'_>, bits: u8) -> Self {
        let full = (1u32 << bits) - 1;
        let high = (full - full / 64) as u16;
        let (mut sum, mut saturated) = (0, 0);
        let mut add = |value: u16| {
            sum += u32::from(value); // of at most 65 535 pixels
            saturated += u32::from(value >= high);
        };
        // Each by itself: the compiler finds vectors for what is simple.
        match pixels {
            Pixels::U8(p) => p.iter().for_each(|&p| add(p.into())),
            Pixels::U16(p) => p.iter().for_each(|&p| add(p)),
            Pixels::Upper(p) => p.iter().for_each(|p| add(p.into())),
        }
        let n = pixels.len().max(1) as f32;
        Self {
            mean: sum as f32 / n / full as f32,
            saturated: saturated as f32 / n,
        }
    }

    /// A running mean over some 16 rows.
    fn add(&mut self, new: Self) {
        self.mean += (new.mean - self.mean) / 16.0;
        self.saturated += (new.saturated - self.saturated) / 16.0;
    }
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
            tracker: Tracker::new(setup.tracker, tracker)
                .map_err(LinesError::Tracker)?
                .with_line_room(line_room),
            binner: Binner::new(setup.group),
            collector: collector.map_err(LinesError::Spectrum)?,
            clock,
            light: Light {
                mean: 0.5,
                saturated: 0.0,
            },
            room: Room {
                words: vec![0; setup.part.width.into()],
                upper: vec![0; setup.part.width.into()],
            },
            seen: vec![0; usize::from(setup.part.width) + UpperBytes::SPARE],
            frame_bytes: last_row * shape.stride + line_end,
            told: Counts::default(),
            setup,
        })
    }

    /// Takes a frame. Whenever a window is complete, `complete` is called with what is to be handed over and
    /// the warnings that belong to it.
    pub fn frame(
        &mut self,
        frame: &Frame<'_>,
        complete: &mut dyn FnMut(&mut Collector<'a>, Warnings),
    ) {
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
        complete: &mut dyn FnMut(&mut Collector<'a>, Warnings),
        cut: &impl for<'b> Fn(&'b [u8], usize, &'b mut Room) -> Result<Pixels<'b>, RawError>,
    ) {
        let Setup {
            shape,
            part,
            group,
            part_start_ns,
            ref tracker,
            ..
        } = *self.setup;
        let start_ns = due.start_ns.saturating_add(part_start_ns);
        let first = usize::from(part.y) * shape.stride + shape.format.bytes(part.x.into());
        let looked_at = (due.number % u32::from(part.height)) as u16;
        let mut rest = bytes.get(first..).unwrap_or_default();
        for row in 0..part.height {
            let Ok(pixels) = cut(rest, part.width.into(), &mut self.room) else {
                return; // `whole` rules it out
            };
            if row == looked_at {
                let seen = match pixels {
                    Pixels::Upper(p) => p.gather(tracker.kernel, &mut self.seen).map(Pixels::U8),
                    _ => Some(pixels),
                };
                self.light
                    .add(Light::of(seen.unwrap_or(pixels), tracker.bits));
            }
            let line = Line {
                frame: due.number,
                row,
                start_ns: start_ns.saturating_add(group.timing().start_ns(row)),
                pixels,
            };
            rest = rest.get(shape.stride..).unwrap_or_default();
            let Some(sample) = self.tracker.push_into(&line, &mut self.binner) else {
                continue;
            };
            if self.collector.push(sample) {
                let warnings = warnings(&self.light, self.tracker.counts(), &mut self.told);
                complete(&mut self.collector, warnings);
            }
        }
    }

    /// The end: what is left becomes the last window, if it is long enough.
    pub fn finish(&mut self, complete: &mut dyn FnMut(&mut Collector<'a>, Warnings)) {
        let last = self.binner.finish();
        let full = last.is_some_and(|sample| self.collector.push(sample));
        if full {
            complete(&mut self.collector, Warnings::NONE);
        }
        if self.collector.finish() {
            let warnings = warnings(&self.light, self.tracker.counts(), &mut self.told);
            complete(&mut self.collector, warnings);
        }
    }

    /// The frames so far.
    pub fn clock(&mut self) -> &mut FrameClock {
        &mut self.clock
    }

    /// What became of the lines so far.
    pub fn counts(&self) -> Counts {
        self.tracker.counts()
    }

    /// How bright the picture is.
    pub fn light(&self) -> Light {
        self.light
    }

    /// The tracker.
    pub fn tracker(&self) -> &Tracker<'a> {
        &self.tracker
    }
}

/// What the user should know of the lines since the last window.
fn warnings(light: &Light, now: Counts, told: &mut Counts) -> Warnings {
    let measured = now.measured - told.measured;
    let no_texture = now.no_texture - told.no_texture;
    let disturbed = now.occluded - told.occluded;
    let all = measured + no_texture + disturbed;
    let mut warnings = Warnings::NONE;
    warnings.insert_if(disturbed * 100 > all, Warning::Occluded);
    warnings.insert_if(now.relearned > told.relearned, Warning::Relearned);
    warnings.insert_if(no_texture * 2 > all, Warning::LittleTexture);
    warnings.insert_if(light.is_bad(), Warning::BadLight);
    *told = now;
    warnings
}
