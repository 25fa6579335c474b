//! What a host can ask of a board: lines of text, one command each.
//!
//! | line | does |
//! | --- | --- |
//! | `version` | says which firmware and wire this is |
//! | `status` | sends a [`crate::wire::Status`] |
//! | `get`, `get KEY` | says all settings, or one |
//! | `set KEY VALUE [KEY VALUE …]` | changes settings, all of them or none |
//! | `save` | keeps the settings over the next start |
//! | `defaults` | goes back to the built-in settings (`save` keeps that too) |
//! | `resend N`, `resend N M` | sends report N, or reports N to M, once more |
//! | `lock N` | locks the settings with a number of one's own, over the next start too |
//! | `lock` | says whether they are locked |
//! | `unlock N` | takes the lock away |
//! | `help` | names the commands |
//!
//! A person types them as they are. A program puts them into a sentence with a checksum,
//! `$RTCMD,set window 1.0*XXXXXXXX`, so that a noisy line cannot turn one command into another.

use core::fmt;

use heapless::String;

use super::real::whole;
use super::{Key, LockError, Settings, SettingsError, ValueError};
use crate::link::outbox::ResendError;
use crate::wire::text::command_in_sentence;

/// Longest command line, bytes.
pub const MAX_COMMAND: usize = 192;

/// A command, read but not carried out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command<'a> {
    /// Say which firmware and wire this is.
    Version,
    /// Send the status.
    Status,
    /// Say one setting, or all.
    Get(Option<Key>),
    /// Change settings.
    Set(Changes<'a>),
    /// Keep the settings.
    Save,
    /// Go back to the built-in settings.
    Defaults,
    /// Send reports once more, first and last number.
    Resend(u32, u32),
    /// Lock the settings with a number, or say whether they are.
    Lock(Option<u32>),
    /// Take the lock away.
    Unlock(u32),
    /// Name the commands.
    Help,
}

/// Why a command was not carried out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CommandError<'a> {
    /// No such command.
    Unknown(&'a str),
    /// The line goes on after the command's end.
    TooMuch(&'a str),
    /// Something is missing; says what.
    Missing(&'static str),
    /// No such setting.
    Key(&'a str),
    /// Not a value of this setting.
    Value(&'a str, ValueError),
    /// Not the number of a report.
    Number(&'a str),
    /// The settings do not fit together or do not fit the board; nothing was changed.
    Settings(SettingsError),
    /// The reports cannot be sent again.
    Resend(ResendError),
    /// Longer than [`MAX_COMMAND`].
    TooLong,
    /// The checksum of a `$RTCMD` sentence is wrong or missing, or it is another sentence.
    Checksum,
    /// Not printable ASCII.
    NotText,
    /// The settings cannot be changed over this line, see [`super::Console::fixed`].
    Fixed,
    /// The settings could not be kept; says why.
    Save(super::store::SaveError),
    /// Not the number of a lock, which is 1 to 4294967295.
    Code(&'a str),
    /// The settings are locked, or are not, see [`LockError`].
    Lock(LockError),
}

impl fmt::Display for CommandError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(word) => write!(f, "{word}: no such command; try help"),
            Self::TooMuch(word) => write!(f, "{word}: not expected here; try help"),
            Self::Missing(what) => write!(f, "missing: {what}"),
            Self::Key(word) => write!(f, "{word}: no such setting; try get"),
            Self::Value(text, error) => write!(f, "{}: {text} is not {error}", error.0.name()),
            Self::Number(text) => write!(f, "{text}: not the number of a report"),
            Self::Settings(error) => write!(f, "{error}; nothing was changed"),
            Self::Resend(error) => error.fmt(f),
            Self::TooLong => write!(f, "line: longer than {MAX_COMMAND} characters"),
            Self::Checksum => write!(f, "line: its checksum is wrong; send it again"),
            Self::NotText => write!(f, "line: not plain text; send it again"),
            Self::Fixed => write!(
                f,
                "settings: fixed here; give them to the program that measures"
            ),
            Self::Save(error) => error.fmt(f),
            Self::Code(text) => write!(f, "{text}: give a number of 1 to 4294967295"),
            Self::Lock(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for CommandError<'_> {}

/// Settings to change and their values, as they were typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Changes<'a>(&'a str);

impl<'a> Changes<'a> {
    /// The settings with all of the changes made, unchecked.
    ///
    /// # Errors
    /// An unknown setting, or a value that it cannot read.
    pub(crate) fn apply(self, settings: &Settings) -> Result<Settings, CommandError<'a>> {
        let mut changed = *settings;
        let mut words = self.0.split_ascii_whitespace();
        while let Some(word) = words.next() {
            let key = Key::from_name(word).ok_or(CommandError::Key(word))?;
            let value = words.next().ok_or(CommandError::Missing("a value"))?;
            key.set(&mut changed, value)
                .map_err(|error| CommandError::Value(value, error))?;
        }
        Ok(changed)
    }
}

/// Reads one line, without its line end: a command as typed, or in a sentence with a checksum.
///
/// # Errors
/// Says what is wrong with it.
pub fn parse<'a>(line: &'a str) -> Result<Command<'a>, CommandError<'a>> {
    let line = if line.starts_with('$') {
        command_in_sentence(line).ok_or(CommandError::Checksum)?
    } else {
        line
    };
    let line = line.trim_ascii();
    let mut words = line.split_ascii_whitespace();
    let word = words.next().unwrap_or("");
    let rest = line.get(word.len()..).unwrap_or("").trim_ascii();
    let command = match word {
        "version" => Command::Version,
        "status" => Command::Status,
        "save" => Command::Save,
        "defaults" => Command::Defaults,
        "help" => Command::Help,
        "get" => Command::Get(match words.next() {
            Some(name) => Some(Key::from_name(name).ok_or(CommandError::Key(name))?),
            None => None,
        }),
        "set" if rest.is_empty() => return Err(CommandError::Missing("a setting and its value")),
        "set" => return Ok(Command::Set(Changes(rest))),
        "resend" => {
            let number = |text: &'a str| whole(text).ok_or(CommandError::Number(text));
            let missing = CommandError::Missing("the number of a report");
            let from = number(words.next().ok_or(missing)?)?;
            let to = words.next().map_or(Ok(from), number)?;
            Command::Resend(from, to)
        }
        "lock" => Command::Lock(words.next().map(code).transpose()?),
        "unlock" => {
            let missing = CommandError::Missing("the number that locks the settings");
            Command::Unlock(words.next().map(code).ok_or(missing)??)
        }
        word => return Err(CommandError::Unknown(word)),
    };
    match words.next() {
        Some(word) => Err(CommandError::TooMuch(word)),
        None => Ok(command),
    }
}

/// The number of a lock.
fn code(text: &str) -> Result<u32, CommandError<'_>> {
    let number = whole(text).filter(|&number| number != 0);
    number.ok_or(CommandError::Code(text))
}

/// Whether a line is a sentence of a board: answered, its answer would come back too, and so on.
fn is_own(line: &str) -> bool {
    ["$RTRPT,", "$RTSTA,", "$RTACK,", "$RTERR,"]
        .iter()
        .any(|start| line.starts_with(start))
}

/// Collects a command line from bytes as they come.
#[derive(Clone, Debug, Default)]
pub struct LineReader {
    line: String<MAX_COMMAND>,
    too_long: bool,
    not_text: bool,
    complete: bool,
}

impl LineReader {
    /// Waits for the first line.
    pub const fn new() -> Self {
        Self {
            line: String::new(),
            too_long: false,
            not_text: false,
            complete: false,
        }
    }

    /// Takes the next byte. The line comes with its end (`\r`, `\n`, or both); empty lines do not, and
    /// neither do a board's own sentences, which come back on a line that echoes.
    ///
    /// # Errors
    /// The line was too long or is not text; the next one starts anew.
    pub fn push(&mut self, byte: u8) -> Option<Result<&str, CommandError<'static>>> {
        if self.complete {
            *self = Self::new();
        }
        if !matches!(byte, b'\r' | b'\n') {
            let plain = matches!(byte, b' '..=b'~' | b'\t');
            self.not_text |= !plain;
            // What is no text takes its place all the same.
            let plain = if plain { byte } else { b'?' };
            self.too_long |= self.line.push(char::from(plain)).is_err();
            return None;
        }
        self.complete = true;
        if self.line.is_empty() || is_own(&self.line) {
            return None;
        }
        Some(match () {
            () if self.too_long => Err(CommandError::TooLong),
            () if self.not_text => Err(CommandError::NotText),
            () => Ok(&self.line),
        })
    }
}
