//! How far along a long piece of work is, on standard error and only if that is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar over frames; a counter where their number is not known.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Starts a bar of `frames` frames. Drawn at most ten times a second.
    pub fn new(frames: Option<u64>) -> Self {
        let bar = ProgressBar::with_draw_target(frames, ProgressDrawTarget::stderr_with_hz(10));
        let template = match frames {
            Some(_) => "{bar:32} {pos}/{len} frames, {per_sec}, {eta} left",
            None => "{spinner} {pos} frames, {per_sec}",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(500));
        Self { bar }
    }

    /// One frame more is done.
    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// Runs `print`, which writes to the terminal, with the bar out of the way.
    pub fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.bar.suspend(print)
    }

    /// Says something to the user in a line of its own.
    pub fn note(&self, text: &str) {
        self.aside(|| eprintln!("rowtone: {text}"));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
