//! What can be wrong with a line.

use std::fmt;
use std::io;

use rowtone::link::settings::SettingsError;

/// Why a line cannot be used. The text is one line that names the port or the file.
#[derive(Debug)]
pub enum SerialError {
    /// A serial port cannot be opened.
    Open {
        /// Its name.
        port: String,
        /// What the operating system says.
        why: serialport::Error,
    },
    /// A file in a port's place cannot be opened.
    OpenFile {
        /// Its path.
        path: String,
        /// What the operating system says.
        why: io::Error,
    },
    /// A file or standard input cannot be read on.
    Read {
        /// Its path.
        path: String,
        /// What the operating system says.
        why: io::Error,
    },
    /// The program has no file descriptors left for a port.
    NoRoom(io::Error),
    /// The settings that a board's end of a line is to tell.
    Settings(SettingsError),
    /// A board's end of a line took no more reports, and why.
    Stopped(String),
}

impl fmt::Display for SerialError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Open { port, why } => write!(f, "serial port {port}: cannot be opened: {why}"),
            Self::OpenFile { path, why } => write!(f, "{path}: cannot be opened: {why}"),
            Self::Read { path, why } => write!(f, "{path}: cannot be read: {why}"),
            Self::NoRoom(why) => write!(f, "no port can be opened: {why}"),
            Self::Settings(why) => why.fmt(f),
            Self::Stopped(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for SerialError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Open { why, .. } => Some(why),
            Self::OpenFile { why, .. } | Self::Read { why, .. } | Self::NoRoom(why) => Some(why),
            Self::Settings(_) | Self::Stopped(_) => None,
        }
    }
}
