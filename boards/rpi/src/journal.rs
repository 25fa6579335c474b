//! What the program says, for the journal.

use std::io::Write;

/// One line of it, or as many as the text has. Where nobody reads it any more it is lost, and that is no reason to end.
pub fn log(text: &str) {
    for line in text.lines() {
        let _ = writeln!(std::io::stderr(), "rowtone-rpi: {line}");
    }
}
