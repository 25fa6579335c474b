//! How far along a long piece of work is, on standard error and only if that is a terminal.

use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// It is drawn no more often than this.
const EVERY: Duration = Duration::from_millis(100);
/// Characters of the bar.
const BAR: u64 = 32;

/// A progress bar over frames; a counter where their number is not known.
#[derive(Debug)]
pub struct Progress {
    frames: Option<u64>,
    start: Instant,
    to_terminal: bool,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    done: u64,
    /// When it was drawn; `None` where it is not on the screen.
    drawn: Option<Instant>,
}

impl Progress {
    /// Starts a bar of `frames` frames. Drawn at most ten times a second.
    pub fn new(frames: Option<u64>) -> Self {
        Self {
            frames,
            start: Instant::now(),
            to_terminal: io::stderr().is_terminal(),
            state: Mutex::default(),
        }
    }

    /// One frame more is done.
    pub fn step(&self) {
        self.step_of(self.frames);
    }

    /// One frame more is done, of so many in all as they are known by now.
    pub fn step_of(&self, frames: Option<u64>) {
        let mut state = self.state();
        state.done += 1;
        if !self.to_terminal {
            return;
        }
        let now = Instant::now();
        let due = |drawn: Instant| now.saturating_duration_since(drawn) >= EVERY;
        // Work that is done at once needs no bar.
        if due(state.drawn.unwrap_or(self.start)) {
            let line = line(
                frames,
                state.done,
                now.saturating_duration_since(self.start),
            );
            let columns = crossterm::terminal::size().map_or(80, |(columns, _)| columns);
            let line: String = line
                .chars()
                .take(usize::from(columns.saturating_sub(1)))
                .collect();
            show(&format!("\r\x1b[2K{line}"));
            state.drawn = Some(now);
        }
    }

    /// Runs `print`, which writes to the terminal, with the bar out of the way.
    pub fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.clear();
        print()
    }

    /// Says something to the user in a line of its own.
    pub fn note(&self, text: &str) {
        self.aside(|| eprintln!("rowtone: {text}"));
    }

    fn clear(&self) {
        if self.state().drawn.take().is_some() {
            show("\r\x1b[2K");
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.clear();
    }
}

/// Writes to standard error; a bar that cannot be drawn is no reason to stop.
fn show(text: &str) {
    let mut to = io::stderr().lock();
    let _ = to.write_all(text.as_bytes()).and_then(|()| to.flush());
}

/// What the bar says.
fn line(frames: Option<u64>, done: u64, elapsed: Duration) -> String {
    let per_s = done as f64 / elapsed.as_secs_f64().max(1e-3);
    let Some(frames) = frames else {
        return format!("{done} frames, {per_s:.0}/s");
    };
    let filled = (BAR * done.min(frames)).checked_div(frames).unwrap_or(BAR);
    let bar: String = (0..BAR)
        .map(|k| if k < filled { '█' } else { '░' })
        .collect();
    let left_s = frames.saturating_sub(done) as f64 / per_s.max(1e-6);
    let left = match left_s {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    };
    format!("{bar} {done}/{frames} frames, {per_s:.0}/s, {left} left")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_says_how_much_is_done_how_fast_and_how_long_it_will_take() {
        let s = Duration::from_secs;
        let half = line(Some(480), 240, s(2));
        assert!(half.ends_with(" 240/480 frames, 120/s, 2 s left"), "{half}");
        assert_eq!(half.matches('█').count(), 16);
        assert_eq!(half.matches('░').count(), 16);
        assert_eq!(line(None, 240, s(2)), "240 frames, 120/s");
        assert!(line(Some(100_000), 100, s(10)).ends_with("10/s, 2.8 h left"));
        assert!(line(Some(10_000), 100, s(10)).ends_with("10/s, 16 min left"));
        // More frames than the header promised, none promised, none done yet.
        for (frames, done, elapsed) in [(10, 11, s(1)), (0, 0, s(0)), (0, 5, s(1)), (9, 0, s(0))] {
            let text = line(Some(frames), done, elapsed);
            assert!(text.contains(" left"), "{text}");
        }
    }
}
