//! One report of one board, as a line of the spool.

use rowtone::report::Report;
use rowtone::wire::{EncodeError, Message, text};

/// One report of one board.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// When it came, ms since 1970.
    pub unix_ms: u64,
    /// Name of the board.
    pub board: String,
    /// Number of the board's session.
    pub session: u32,
    /// What it measured.
    pub report: Report,
}

impl Entry {
    /// When it came, which board's it is, and its `text` sentence, whose checksum also tells a line
    /// that was cut short.
    ///
    /// # Errors
    /// It holds a number that no sentence can.
    pub(super) fn to_line(&self) -> Result<String, EncodeError> {
        let mut line = format!("{} {} ", self.unix_ms, self.board);
        let message = Message::Report {
            session: self.session,
            report: self.report.clone(),
        };
        text::encode(&message, &mut line)?;
        Ok(line)
    }

    /// What a whole line says; `None` for any other.
    pub(super) fn from_line(line: &[u8]) -> Option<Self> {
        let line = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
        let (unix_ms, rest) = line.split_once(' ')?;
        let (board, sentence) = rest.split_once(' ')?;
        match text::decode_line(sentence).ok()? {
            Message::Report { session, report } => Some(Self {
                unix_ms: unix_ms.parse().ok()?,
                board: board.to_owned(),
                session,
                report,
            }),
            _ => None,
        }
    }
}
