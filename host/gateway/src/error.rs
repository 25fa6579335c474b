//! What can be wrong before the gateway runs.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Why the gateway cannot start. The text is one line that names the key or the file.
#[derive(Debug)]
pub enum GatewayError {
    /// The configuration cannot be read.
    Unreadable {
        /// Its path.
        path: PathBuf,
        /// What the operating system says.
        why: io::Error,
    },
    /// Something in the configuration is wrong.
    Config {
        /// Its path.
        path: PathBuf,
        /// Number of the line, the key, and what is wrong with it.
        why: String,
    },
    /// A file that the configuration names cannot be used.
    File {
        /// The key.
        key: &'static str,
        /// The file's path.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// Two boards have one device.
    Twins {
        /// The port of the second of them, as the configuration has it.
        port: String,
        /// The boards' names, the second one first.
        boards: [String; 2],
        /// The device.
        device: PathBuf,
    },
    /// Everybody can read the password, and where.
    OpenSecret(String),
    /// The spool cannot be used.
    Spool {
        /// Its folder.
        dir: PathBuf,
        /// What the operating system says.
        why: io::Error,
    },
    /// There is no thread for a board's line.
    Thread {
        /// The board's name.
        board: String,
        /// What the operating system says.
        why: io::Error,
    },
}

impl fmt::Display for GatewayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable { path, why } => {
                write!(f, "{}: cannot be read: {why}", path.display())
            }
            Self::Config { path, why } => write!(f, "{}:{why}", path.display()),
            Self::File { key, path, why } => write!(f, "{key}: {}: {why}", path.display()),
            Self::Twins {
                port,
                boards: [board, other],
                device,
            } => {
                let device = device.display();
                write!(
                    f,
                    "board.port: {port}: {board} and {other} are one and the same device, {device}"
                )
            }
            Self::OpenSecret(why) => f.write_str(why),
            Self::Spool { dir, why } => write!(f, "spool.dir: {}: {why}", dir.display()),
            Self::Thread { board, why } => {
                write!(f, "board {board}: no thread for its line: {why}")
            }
        }
    }
}

impl std::error::Error for GatewayError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Unreadable { why, .. } | Self::Spool { why, .. } | Self::Thread { why, .. } => {
                Some(why)
            }
            _ => None,
        }
    }
}
