//! Signals while the terminal is not as it was: it is restored first, then they do what they do.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The signals that came.
#[derive(Debug, Default)]
pub(super) struct Signals {
    /// The one that ends the program; 0 while none has come.
    end: Arc<AtomicUsize>,
    /// The one that stops it until it is continued.
    pause: Arc<AtomicUsize>,
}

#[cfg(unix)]
mod unix {
    use signal_hook::consts::*;

    /// All that end a program unless it says otherwise, but for those of its own faults and those that
    /// cannot be caught.
    pub(super) const END: [i32; 12] = [
        SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF, SIGXCPU,
        SIGXFSZ, SIGABRT,
    ];
    pub(super) const PAUSE: [i32; 3] = [SIGTSTP, SIGTTIN, SIGTTOU];
}

impl Signals {
    /// Catches them from now on.
    pub(super) fn catch() -> Self {
        let signals = Self::default();
        #[cfg(unix)]
        {
            let of = [
                (&unix::END[..], &signals.end),
                (&unix::PAUSE[..], &signals.pause),
            ];
            for (numbers, flag) in of {
                for &signal in numbers {
                    let value = usize::try_from(signal).unwrap_or(0);
                    // One that cannot be caught ends the program as it is.
                    let _ = signal_hook::flag::register_usize(signal, Arc::clone(flag), value);
                }
            }
        }
        signals
    }

    /// The program is to end.
    pub(super) fn is_to_end(&self) -> bool {
        self.end.load(Ordering::Relaxed) != 0
    }

    /// The program is to be stopped.
    pub(super) fn is_to_pause(&self) -> bool {
        self.pause.load(Ordering::Relaxed) != 0
    }

    /// Stops the program until it is continued.
    pub(super) fn pause(&self) {
        self.do_as_usual(self.pause.swap(0, Ordering::Relaxed));
    }

    /// Ends the program as the signal does that came, if one did.
    pub(super) fn pass_on(&self) {
        self.do_as_usual(self.end.load(Ordering::Relaxed));
    }

    #[cfg(unix)]
    fn do_as_usual(&self, signal: usize) {
        if let Ok(signal) = i32::try_from(signal)
            && signal != 0
        {
            // Where that is not to be had, the program ends as if it were left.
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    }

    #[cfg(not(unix))]
    fn do_as_usual(&self, _signal: usize) {}
}
