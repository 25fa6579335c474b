//! What a board says, decoded: bytes from standard input, as they come, in either of the wires that a
//! board speaks unasked.
//!
//! ```text
//! stty -F /dev/ttyUSB0 115200 raw && cargo run --release --example decode < /dev/ttyUSB0
//! ```

use std::io::{Read, stdin};

use rowtone::wire::{Message, binary, text};

/// A listener that understands both wires: what is no message of one is left to the other.
#[derive(Default)]
pub(crate) struct Listener {
    text: text::Decoder<{ text::MAX_LINE }>,
    binary: binary::Decoder<{ binary::MAX_FRAME }>,
}

impl Listener {
    /// Takes a byte; gives the message that it completes.
    pub(crate) fn hear(&mut self, byte: u8) -> Option<Message> {
        let text = self.text.push(byte).and_then(Result::ok);
        let binary = self.binary.push(byte).and_then(Result::ok);
        text.or(binary)
    }
}

/// A message in a few words.
pub(crate) fn line(message: &Message) -> String {
    match message {
        Message::Report { session, report } => {
            let peak =
                |p: &rowtone::report::Peak| format!(" {:.3} Hz {:.4} px", p.hz, p.amplitude_px);
            let peaks: String = report.peaks.iter().map(peak).collect();
            format!("session {session}, report {}:{peaks}", report.seq)
        }
        other => format!("{other:?}"),
    }
}

#[allow(dead_code, reason = "the test uses `Listener`")]
fn main() {
    let mut listener = Listener::default();
    for byte in stdin().lock().bytes().map_while(Result::ok) {
        if let Some(message) = listener.hear(byte) {
            println!("{}", line(&message));
        }
    }
}
