//! The last pictures, handed over by whoever takes them, who never waits.
//!
//! The camera's side calls [`Frames::offer`] once a frame. While nobody looks that costs one look at a clock; while
//! somebody does, the frame's bytes are copied as they lie, into the next of a ring of slots. A slot that is being read is
//! passed over: the frame is missing in the ring, and in nothing else. Memory for the slots, unpacking, shrinking and
//! encoding are the reader's work, on the reader's thread: whoever allocates may wait for somebody else who does.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rowtone::camera::{Pixels, RawFormat};

/// Most slots.
const SLOTS: usize = 1024;
/// So long after somebody last asked for a picture frames are kept.
const WATCHED: Duration = Duration::from_secs(10);

/// How a frame lies in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Bytes from one row to the next.
    pub stride: usize,
    /// Pixels of a row.
    pub format: RawFormat,
    /// Neighbouring pixels are of different colours.
    pub bayer: bool,
}

impl Layout {
    /// Bytes that a frame has at least.
    pub fn bytes(&self) -> usize {
        let last_row = usize::from(self.height).saturating_sub(1) * self.stride;
        last_row + self.format.bytes(self.width.into())
    }
}

/// One frame as it was taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shot {
    /// Counts the frames that were kept, from 1.
    pub number: u64,
    /// Number of the frame as the camera counts.
    pub frame: u32,
    /// Start of exposure of its first row, ns on the camera's clock.
    pub start_ns: i64,
    /// How it lies in `bytes`.
    pub layout: Layout,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl Shot {
    const EMPTY: Self = Self {
        number: 0,
        frame: 0,
        start_ns: 0,
        layout: Layout {
            width: 0,
            height: 0,
            stride: 0,
            format: RawFormat::Raw8,
            bayer: false,
        },
        bytes: Vec::new(),
    };

    /// How the pixels of a row lie, how many there are, and the bytes from it on.
    fn row(&self, row: usize) -> (RawFormat, usize, &[u8]) {
        let bytes = self.bytes.get(row * self.layout.stride..);
        let width = usize::from(self.layout.width);
        (self.layout.format, width, bytes.unwrap_or_default())
    }

    /// One row's upper 8 bits, appended to `to`.
    pub fn grey_row(&self, row: usize, to: &mut Vec<u8>) {
        let (format, width, bytes) = self.row(row);
        let mut room = vec![0; width];
        match format.upper_line(bytes, width, &mut room) {
            Ok(pixels) => to.extend(pixels.values().map(|value| value as u8)),
            Err(_) => to.resize(to.len() + width, 0),
        }
    }

    /// One row with all its bits, little-endian words where it has more than 8, appended to `to`.
    pub fn full_row(&self, row: usize, to: &mut Vec<u8>) {
        let (format, width, bytes) = self.row(row);
        let mut room = vec![0; width];
        match format.line(bytes, width, &mut room) {
            Ok(Pixels::U16(pixels)) => to.extend(pixels.iter().flat_map(|v| v.to_le_bytes())),
            Ok(pixels) => to.extend(pixels.values().map(|value| value as u8)),
            Err(_) => {}
        }
    }
}

/// See the [module](self).
#[derive(Debug)]
pub struct Frames {
    slots: Vec<Mutex<Shot>>,
    /// Most bytes of all slots together.
    room: usize,
    /// How many slots of frames of this size have room.
    used: AtomicUsize,
    kept: AtomicU64,
    /// Frames passed over because their slot was being read.
    missed: AtomicU64,
    /// Bytes of a frame for which the slots had no memory; 0 where they have.
    needed: AtomicUsize,
    /// Until when frames are wanted, ms after `began`.
    wanted_ms: AtomicU64,
    began: Instant,
}

impl Frames {
    /// A ring for at most this many bytes, and for two frames at least.
    pub fn new(room: usize) -> Self {
        Self {
            slots: (0..SLOTS).map(|_| Mutex::new(Shot::EMPTY)).collect(),
            room,
            used: AtomicUsize::new(2),
            kept: AtomicU64::new(0),
            missed: AtomicU64::new(0),
            needed: AtomicUsize::new(0),
            wanted_ms: AtomicU64::new(0),
            began: Instant::now(),
        }
    }

    fn now_ms(&self) -> u64 {
        self.began.elapsed().as_millis() as u64
    }

    /// Somebody looks: frames are kept for some seconds from now on. Gets memory for them where that is missing.
    pub fn want(&self) {
        let until = self.now_ms() + WATCHED.as_millis() as u64;
        self.wanted_ms.store(until, Ordering::Relaxed);
        let needed = self.needed.swap(0, Ordering::AcqRel);
        if needed > 0 {
            self.get_memory(needed);
        }
    }

    /// Memory of so many bytes for each slot in use, written once, so that its pages are there.
    fn get_memory(&self, bytes: usize) {
        let lacks = |shot: &Shot| shot.bytes.capacity() < bytes;
        for slot in self.slots.iter().take(self.slots_of(bytes)) {
            let lock = || slot.lock().unwrap_or_else(PoisonError::into_inner);
            if !lacks(&lock()) {
                continue;
            }
            let mut fresh = vec![1; bytes];
            fresh.clear();
            let mut shot = lock();
            if lacks(&shot) {
                std::mem::swap(&mut shot.bytes, &mut fresh);
                shot.number = 0;
            }
        }
    }

    /// How many slots of frames of so many bytes have room.
    fn slots_of(&self, bytes: usize) -> usize {
        (self.room / bytes.max(1)).clamp(2, SLOTS)
    }

    /// Whether frames are kept.
    pub fn is_wanted(&self) -> bool {
        self.now_ms() < self.wanted_ms.load(Ordering::Relaxed)
    }

    /// Shows a frame. It never waits and never allocates: the frame is copied where somebody looks, its slot is free, and
    /// there is memory for it, which the next [`Frames::want`] gets.
    pub fn offer(&self, frame: u32, start_ns: i64, layout: Layout, bytes: &[u8]) {
        if self.is_wanted() {
            self.put(frame, start_ns, layout, bytes, false);
        }
    }

    /// The same whether anybody looks or not, and with memory of its own: of a recording, the last frame is still looked at
    /// when all are read.
    pub fn keep(&self, frame: u32, start_ns: i64, layout: Layout, bytes: &[u8]) {
        self.put(frame, start_ns, layout, bytes, true);
    }

    fn put(&self, frame: u32, start_ns: i64, layout: Layout, bytes: &[u8], may_allocate: bool) {
        let length = layout.bytes();
        let Some(bytes) = bytes.get(..length) else {
            return;
        };
        let used = self.slots_of(length);
        self.used.store(used, Ordering::Relaxed);
        // One side offers, so nobody else counts.
        let number = self.kept.load(Ordering::Relaxed) + 1;
        let slot = self.slots.get((number % used as u64) as usize);
        let Some(Ok(mut shot)) = slot.map(|slot| slot.try_lock()) else {
            self.missed.fetch_add(1, Ordering::Relaxed);
            return;
        };
        if !may_allocate && shot.bytes.capacity() < length {
            self.needed.store(length, Ordering::Release);
            self.missed.fetch_add(1, Ordering::Relaxed);
            return;
        }
        shot.bytes.clear();
        shot.bytes.extend_from_slice(bytes);
        (shot.number, shot.frame, shot.start_ns, shot.layout) = (number, frame, start_ns, layout);
        drop(shot);
        self.kept.store(number, Ordering::Release);
    }

    /// Frames kept so far, and frames that were passed over.
    pub fn counts(&self) -> (u64, u64) {
        (
            self.kept.load(Ordering::Acquire),
            self.missed.load(Ordering::Relaxed),
        )
    }

    /// The newest frame, copied.
    pub fn newest(&self) -> Option<Shot> {
        let number = self.kept.load(Ordering::Acquire);
        let used = self.used.load(Ordering::Relaxed) as u64;
        let slot = self.slots.get((number % used) as usize)?;
        let shot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        (number > 0 && shot.number > 0).then(|| shot.clone())
    }

    /// Shows `see` the frames that are kept and follow each other without a gap up to the newest, the oldest first; all of
    /// one size. Each is locked only while it is seen, so the oldest may be gone by then: `see` is told what is there.
    pub fn last(&self, mut see: impl FnMut(&Shot)) {
        let newest = self.kept.load(Ordering::Acquire);
        let used = self.used.load(Ordering::Relaxed) as u64;
        let Some(layout) = self.newest().map(|shot| shot.layout) else {
            return;
        };
        // The next one to be written is left out.
        let oldest = newest.saturating_sub(used.saturating_sub(2)).max(1);
        for number in oldest..=newest {
            let Some(slot) = self.slots.get((number % used) as usize) else {
                continue;
            };
            let shot = slot.lock().unwrap_or_else(PoisonError::into_inner);
            if shot.number == number && shot.layout == layout {
                see(&shot);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUT: Layout = Layout {
        width: 4,
        height: 2,
        stride: 4,
        format: RawFormat::Raw8,
        bayer: false,
    };

    #[test]
    fn nothing_is_kept_while_nobody_looks() {
        let frames = Frames::new(1000);
        frames.offer(1, 0, LAYOUT, &[1; 8]);
        assert_eq!((frames.counts(), frames.newest()), ((0, 0), None));
        frames.want();
        frames.offer(2, 5, LAYOUT, &[2; 8]);
        assert_eq!(frames.counts(), (0, 1), "there is no memory for it yet");
        frames.want();
        frames.offer(2, 5, LAYOUT, &[2; 8]);
        let newest = frames.newest().expect("it was wanted");
        assert_eq!(
            (newest.frame, newest.start_ns, newest.bytes.len()),
            (2, 5, 8)
        );
        // One that is shorter than it says is none.
        frames.offer(3, 6, LAYOUT, &[3; 7]);
        assert_eq!(frames.newest().map(|shot| shot.frame), Some(2));
    }

    #[test]
    fn a_slot_that_is_read_is_passed_over_and_counted() {
        let frames = Frames::new(0); // two slots
        frames.want();
        frames.get_memory(8);
        for frame in 1..=2 {
            frames.offer(frame, 0, LAYOUT, &[0; 8]);
        }
        let reading = frames.slots[1].lock();
        frames.offer(3, 0, LAYOUT, &[0; 8]);
        assert_eq!(frames.counts(), (2, 1));
        drop(reading);
        frames.offer(4, 0, LAYOUT, &[0; 8]);
        assert_eq!(frames.newest().map(|shot| shot.frame), Some(4));
    }

    #[test]
    fn the_last_frames_follow_each_other() {
        let frames = Frames::new(8 * 10);
        frames.want();
        frames.get_memory(8);
        for frame in 1..=25 {
            frames.offer(frame, 0, LAYOUT, &[0; 8]);
        }
        let mut seen = vec![];
        frames.last(|shot| seen.push(shot.frame));
        assert_eq!(seen, (17..=25).collect::<Vec<_>>());
    }

    #[test]
    fn rows_are_unpacked_by_whoever_reads() {
        let frames = Frames::new(1000);
        frames.want();
        frames.get_memory(8);
        let layout = Layout {
            width: 2,
            height: 2,
            stride: 4,
            format: RawFormat::Raw12,
            bayer: false,
        };
        frames.offer(1, 0, layout, &[0x34, 0x02, 0xff, 0x0f, 0, 0, 0x80, 0x08]);
        let shot = frames.newest().unwrap();
        let (mut grey, mut full) = (vec![], vec![]);
        shot.grey_row(0, &mut grey);
        shot.full_row(0, &mut full);
        assert_eq!(grey, [0x23, 0xff]);
        assert_eq!(full, [0x34, 0x02, 0xff, 0x0f]);
        shot.grey_row(9, &mut grey);
        assert_eq!(grey, [0x23, 0xff, 0, 0], "a row that is not there is black");
    }
}
