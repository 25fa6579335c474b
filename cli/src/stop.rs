//! Ctrl-C and SIGTERM: what has been measured is kept.
//!
//! The first of them is only noted, and whatever reads a recording takes it as the recording's end: the
//! last window is finished, files are written, and the program ends as if the input had. The second ends
//! it at once.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Has the signals noted from now on. What this returns says whether one came.
pub fn on_signals() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGINT, SIGTERM};
        use signal_hook::flag;
        for signal in [SIGINT, SIGTERM] {
            // Asked in this order: the first finds it unset. Where neither can be had, a signal ends the
            // program, as it would without this.
            let _ = flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&stop));
            let _ = flag::register(signal, Arc::clone(&stop));
        }
    }
    stop
}

/// Has the same signals noted in `flag` too.
pub fn also_in(flag: &Arc<AtomicBool>) {
    #[cfg(unix)]
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // Where it cannot be had, whoever waits for this flag sees the other one.
        let _ = signal_hook::flag::register(signal, Arc::clone(flag));
    }
    #[cfg(not(unix))]
    let _ = flag;
}

/// A file that grows beyond what is allowed (`ulimit -f`) is an error of its writing, not the end of the
/// program.
pub fn outlive_large_files() {
    #[cfg(unix)]
    {
        /// "File size limit exceeded", on Linux and the BSDs.
        const SIGXFSZ: i32 = 25;
        let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    }
}
