//! How far the readings of a recording are, and where they end once they are stopped.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rowtone_clip::Feed;

/// One reading after the other. The first that is stopped says where those after it end.
pub(super) struct Readings<S> {
    stop: Arc<AtomicBool>,
    /// Frames after which a reading ends, once one was stopped there.
    end: Option<u64>,
    /// Frames of the recording, where they are known.
    frames: Option<u64>,
    /// How often each is read.
    times: u64,
    /// Frames of this reading.
    read: u64,
    step: S,
}

impl<S: FnMut(Option<u64>)> Readings<S> {
    /// None yet, of a recording of `frames` frames that is read so many `times`.
    pub(super) fn new(stop: &Arc<AtomicBool>, frames: Option<u64>, times: u64, step: S) -> Self {
        Self {
            stop: Arc::clone(stop),
            end: None,
            frames,
            times,
            read: 0,
            step,
        }
    }

    /// Begins a reading.
    pub(super) fn begin(&mut self, mut feed: Feed) -> Feed {
        self.read = 0;
        // After one that was stopped the flag stays set, and would end this one at once.
        if self.end.is_none() {
            feed.stop_when(Arc::clone(&self.stop));
        }
        feed
    }

    /// A frame was read.
    pub(super) fn frame(&mut self) {
        self.read += 1;
        let frames = self.end.or(self.frames);
        (self.step)(frames.map(|frames| frames * self.times));
    }

    /// This reading has come to where one before it was stopped.
    pub(super) fn is_over(&self) -> bool {
        self.end.is_some_and(|end| self.read >= end)
    }

    /// Ends a reading.
    pub(super) fn end(&mut self) {
        if self.end.is_none() && self.stop.load(Ordering::Relaxed) {
            self.end = Some(self.read);
        }
    }

    /// That readings were stopped, for the user, after so many seconds of the recording.
    pub(super) fn note(&self, seconds: f64) -> Option<String> {
        let end = self.end?;
        let whole = self.frames.is_some_and(|frames| end >= frames);
        let all = self
            .frames
            .map_or(String::new(), |all| format!(" of {all}"));
        (!whole).then(|| {
            format!("stopped: shapes of the first {end}{all} frames ({seconds:.1} s) only")
        })
    }
}
