//! From the interrupt that fills line buffers to the core that works on them: two buffers, nobody waits.
//!
//! While one buffer is being worked on, the DMA fills the other. If that is full and the work is still not
//! done, the line in it is dropped and counted, and the buffer is filled again: a line that comes while the
//! last is still being worked on is counted, not waited for.

use crate::capture::{LINE_WORDS, missing_samples};
use crate::frames::Place;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::zerocopy_channel::{Receiver, Sender};

/// One line as the DMA left it.
#[derive(Clone, Copy, Debug)]
pub struct LineBuffer {
    /// What the PIO program sent.
    pub words: [u32; LINE_WORDS],
    /// Row, frame, time.
    pub place: Place,
}

impl LineBuffer {
    /// Empty.
    pub const NEW: Self = Self {
        words: [0; LINE_WORDS],
        place: Place {
            frame: 0,
            row: 0,
            frame_start_ns: 0,
        },
    };

    /// Its pixels where they lie, or how many samples of them are missing.
    ///
    /// # Errors
    /// The number of missing samples: such a line is not measured.
    pub fn pixels(&self) -> Result<&[u8], u32> {
        let [words @ .., last] = &self.words;
        match missing_samples(*last) {
            // The first pixel in the lowest byte, which both cores and every host have first in memory.
            0 => Ok(bytemuck::cast_slice(words)),
            missing => Err(missing),
        }
    }
}

/// Lines lost between the pins and the core, since the start.
#[derive(Debug, Default)]
pub struct LineLosses {
    /// Lines that came while the last was still being worked on.
    pub overruns: AtomicU32,
    /// Lines whose pixel clock or HREF broke off.
    pub short: AtomicU32,
    /// Lines during which the DMA was late and the state machine had to wait.
    pub stalled: AtomicU32,
}

impl LineLosses {
    /// None yet.
    pub const fn new() -> Self {
        Self {
            overruns: AtomicU32::new(0),
            short: AtomicU32::new(0),
            stalled: AtomicU32::new(0),
        }
    }
}

/// Count one.
pub fn count(counter: &AtomicU32) {
    // Only one core writes each counter, so load and store do (and saturate).
    counter.store(
        counter.load(Ordering::Relaxed).saturating_add(1),
        Ordering::Relaxed,
    );
}

/// The filling side of a channel of exactly two [`LineBuffer`]s.
pub struct Filler<'a, M: RawMutex> {
    sender: Sender<'a, M, LineBuffer>,
    losses: &'a LineLosses,
}

/// What became of a filled buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filled {
    /// It was handed over.
    HandedOver,
    /// The core still works on the line before: this one is dropped and counted.
    Overrun,
    /// It is no line of the picture: dropped.
    Stray,
}

impl<'a, M: RawMutex> Filler<'a, M> {
    /// Fill buffers for the receiver at the other end.
    pub fn new(sender: Sender<'a, M, LineBuffer>, losses: &'a LineLosses) -> Self {
        Self { sender, losses }
    }

    /// The buffer to fill next. There always is one: at most one is with the core.
    pub fn buffer(&mut self) -> Option<&mut LineBuffer> {
        self.sender.try_send()
    }

    /// The buffer is full; `place` says which line it is.
    pub fn filled(&mut self, place: Option<Place>) -> Filled {
        let Some(place) = place else {
            return Filled::Stray;
        };
        if !self.sender.is_empty() {
            count(&self.losses.overruns);
            return Filled::Overrun;
        }
        if let Some(buffer) = self.sender.try_send() {
            buffer.place = place;
        }
        self.sender.send_done();
        Filled::HandedOver
    }
}

/// The working side.
pub struct Taker<'a, M: RawMutex> {
    receiver: Receiver<'a, M, LineBuffer>,
}

impl<'a, M: RawMutex> Taker<'a, M> {
    /// Take buffers from the sender at the other end.
    pub fn new(receiver: Receiver<'a, M, LineBuffer>) -> Self {
        Self { receiver }
    }

    /// Wait for a line, work on it, and give its buffer back.
    pub async fn work<R>(&mut self, work: impl FnOnce(&LineBuffer) -> R) -> R {
        let result = work(self.receiver.receive().await);
        self.receiver.receive_done();
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::LINE_PIXELS;
    use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
    use embassy_sync::zerocopy_channel::Channel;

    fn place(row: u16) -> Option<Place> {
        Some(Place {
            frame: 1,
            row,
            frame_start_ns: 5,
        })
    }

    #[test]
    fn lines_that_come_during_work_are_counted_not_waited_for() {
        let mut buffers = [LineBuffer::NEW; 2];
        let mut channel = Channel::<CriticalSectionRawMutex, _>::new(&mut buffers);
        let (sender, mut receiver) = channel.split();
        let losses = LineLosses::new();
        let mut filler = Filler::new(sender, &losses);

        filler.buffer().unwrap().words[0] = 10;
        assert_eq!(filler.filled(place(0)), Filled::HandedOver);
        let working = receiver.try_receive().unwrap();
        assert_eq!((working.words[0], working.place.row), (10, 0));
        // The core is still at row 0 while rows 1 and 2 come.
        for row in 1..=2 {
            filler.buffer().unwrap().words[0] = 10 + u32::from(row);
            assert_eq!(filler.filled(place(row)), Filled::Overrun);
        }
        receiver.receive_done();
        assert_eq!(losses.overruns.load(Ordering::Relaxed), 2);
        // In time again: row 3 comes through as itself.
        filler.buffer().unwrap().words[0] = 13;
        assert_eq!(filler.filled(place(3)), Filled::HandedOver);
        let line = receiver.try_receive().unwrap();
        assert_eq!((line.words[0], line.place.row), (13, 3));
    }

    #[test]
    fn the_buffer_in_work_is_never_filled() {
        let mut buffers = [LineBuffer::NEW; 2];
        let mut channel = Channel::<CriticalSectionRawMutex, _>::new(&mut buffers);
        let (sender, mut receiver) = channel.split();
        let losses = LineLosses::new();
        let mut filler = Filler::new(sender, &losses);
        for row in 0..1000_u16 {
            let filling = core::ptr::from_ref(filler.buffer().unwrap());
            filler.filled(place(row));
            let working = core::ptr::from_ref(receiver.try_receive().unwrap());
            assert_eq!(filling, working);
            for _ in 0..row % 3 {
                assert_ne!(core::ptr::from_ref(filler.buffer().unwrap()), working);
                filler.filled(place(row));
            }
            receiver.receive_done();
        }
        assert_eq!(losses.overruns.load(Ordering::Relaxed), 999);
    }

    #[test]
    fn stray_lines_are_not_handed_over() {
        let mut buffers = [LineBuffer::NEW; 2];
        let mut channel = Channel::<CriticalSectionRawMutex, _>::new(&mut buffers);
        let (sender, mut receiver) = channel.split();
        let losses = LineLosses::new();
        let mut filler = Filler::new(sender, &losses);
        assert_eq!(filler.filled(None), Filled::Stray);
        assert!(receiver.try_receive().is_none());
    }

    #[test]
    fn pixels_come_in_order_and_short_lines_are_refused() {
        let mut line = LineBuffer::NEW;
        line.words[0] = u32::from_le_bytes([1, 2, 3, 4]);
        line.words[LINE_WORDS - 2] = u32::from_le_bytes([5, 6, 7, 8]);
        line.words[LINE_WORDS - 1] = u32::MAX;
        let bytes = line.pixels().unwrap();
        assert_eq!(bytes.len(), LINE_PIXELS);
        assert_eq!(
            (&bytes[..4], &bytes[LINE_PIXELS - 4..]),
            (&[1, 2, 3, 4][..], &[5, 6, 7, 8][..])
        );
        line.words[LINE_WORDS - 1] = 6;
        assert_eq!(line.pixels(), Err(7));
    }
}
