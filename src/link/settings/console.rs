//! Carries out commands.

use core::fmt::{self, Write};

use crate::link::outbox::Outbox;
use crate::wire::{Message, Reply, SettingsOrigin, Status, binary};

use super::command::{Command, CommandError, parse};
use super::lock::LockError;
use super::store::{Keep, Started};
use super::{Key, Limits, Settings, SettingsError};

/// What is fixed about a board: its firmware, its camera and memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Version of the firmware: major, minor, patch.
    pub version: [u16; 3],
    /// What its camera and memory allow.
    pub limits: Limits,
    /// Its built-in settings; they must be within the limits.
    pub defaults: Settings,
}

/// The settings in use, and who may change them.
///
/// ```
/// use rowtone::link::outbox::Outbox;
/// use rowtone::link::settings::{Board, Console, Limits, Settings, store::{Nowhere, Started}};
/// use rowtone::wire::{Message, SettingsOrigin};
///
/// let board = Board {
///     version: [0, 1, 0],
///     limits: Limits { width: 320, height: 240, min_width: 16, max_window_s: 10.0 },
///     defaults: Settings::default(),
/// };
/// let started = Started { session: 1, settings: None, origin: SettingsOrigin::Defaults };
/// let mut console = Console::new(board, started)?;
/// let mut slots = [const { None }; 4];
/// let mut outbox = Outbox::new(&mut slots);
///
/// let said = console.carry_out("set window 0.5 hop 0.25", 12_000, &mut outbox, &mut Nowhere);
/// assert!(matches!(said, Message::Reply(reply) if reply.ok));
/// assert_eq!(console.settings().window_s, 0.5);
///
/// let said = console.carry_out("set window 0.1", 13_000, &mut outbox, &mut Nowhere);
/// let Message::Reply(reply) = said else { panic!() };
/// assert_eq!(reply.text, "hop is 0.25 s; give 0.01 to the window's length, 0.1; nothing was changed");
/// # Ok::<(), rowtone::link::settings::SettingsError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Console {
    pub(super) settings: Settings,
    origin: SettingsOrigin,
    board: Board,
    session: u32,
    refused: u32,
    fixed: bool,
    /// When a wrong number was last tried on the lock, ms since the start.
    pub(super) wrong_number_at_ms: Option<u64>,
}

impl Console {
    /// Starts with what [`super::store::Store::start`] found, or with a [`Started`] of one's own.
    /// Saved settings that the board does not allow (any more) are replaced by its defaults, and
    /// the origin says [`SettingsOrigin::Corrupt`].
    ///
    /// # Errors
    /// The board's own defaults are not within its limits.
    pub fn new(board: Board, started: Started) -> Result<Self, SettingsError> {
        board.defaults.check(&board.limits)?;
        let (settings, origin) = match started.settings {
            Some(saved) if saved.check(&board.limits).is_ok() => (saved, started.origin),
            Some(_) => (board.defaults, SettingsOrigin::Corrupt),
            None => (board.defaults, started.origin),
        };
        Ok(Self {
            settings,
            origin,
            board,
            session: started.session,
            refused: 0,
            fixed: false,
            wrong_number_at_ms: None,
        })
    }

    /// Refuses every command that changes or saves settings: for whoever takes them from elsewhere,
    /// from a command line say.
    #[must_use]
    pub fn fixed(self) -> Self {
        Self {
            fixed: true,
            ..self
        }
    }

    /// The settings in use. The measuring side compares them with those it has, and starts anew
    /// where they differ.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What is fixed about the board.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// Tells the size of the picture, for a board that knows its camera only later: from now on regions
    /// are checked against it. Settings that are in use stay.
    pub fn set_picture(&mut self, width: u16, height: u16) {
        self.board.limits.width = width;
        self.board.limits.height = height;
    }

    /// Number of the session, as every report carries it.
    pub fn session(&self) -> u32 {
        self.session
    }

    /// Replaces all settings at once, but for the lock, which [`Console::lock`] is for.
    ///
    /// # Errors
    /// They are locked, do not fit together, or do not fit the board; the old ones stay.
    pub fn replace(&mut self, settings: Settings) -> Result<(), SettingsError> {
        if self.is_locked() {
            return Err(SettingsError::Locked);
        }
        let lock = None;
        let settings = Settings { lock, ..settings };
        settings.check(&self.board.limits)?;
        if settings != self.settings {
            self.settings = settings;
            self.origin = SettingsOrigin::Changed;
        }
        Ok(())
    }

    /// Carries out one command line and says what to answer. `uptime_ms` is the time since the
    /// board started; `store` keeps what is saved ([`super::store::Nowhere`] where nothing can).
    pub fn carry_out(
        &mut self,
        line: &str,
        uptime_ms: u64,
        outbox: &mut Outbox<'_>,
        store: &mut impl Keep,
    ) -> Message {
        let done = parse(line).and_then(|command| self.done(command, uptime_ms, outbox, store));
        done.unwrap_or_else(|error| self.refuse(&error))
    }

    /// Counts a line that was no command, and says what to answer.
    pub fn refuse(&mut self, error: &CommandError<'_>) -> Message {
        self.count_refused();
        reply(false, format_args!("{error}"))
    }

    /// Counts a line that is not even answered.
    pub(crate) fn count_refused(&mut self) {
        self.refused = self.refused.saturating_add(1);
    }

    /// How the board is doing.
    pub fn status(&self, uptime_ms: u64, outbox: &Outbox<'_>) -> Status {
        Status {
            version: self.board.version,
            session: self.session,
            uptime_ms,
            next_seq: outbox.next_seq(),
            oldest_seq: outbox.oldest(),
            dropped_reports: outbox.dropped(),
            refused_commands: self.refused,
            settings: self.origin,
        }
    }

    /// Keeps the settings in use.
    ///
    /// # Errors
    /// As the store's.
    pub fn save(&mut self, store: &mut impl Keep) -> Result<(), super::store::SaveError> {
        store.save(self.session, &self.settings)?;
        self.origin = SettingsOrigin::Saved;
        Ok(())
    }

    fn done<'a>(
        &mut self,
        command: Command<'a>,
        uptime_ms: u64,
        outbox: &mut Outbox<'_>,
        store: &mut impl Keep,
    ) -> Result<Message, CommandError<'a>> {
        let message = match command {
            Command::Set(_) | Command::Save | Command::Defaults if self.fixed => {
                return Err(CommandError::Fixed);
            }
            Command::Lock(Some(_)) | Command::Unlock(_) if self.fixed => {
                return Err(CommandError::Fixed);
            }
            Command::Set(_) | Command::Save | Command::Defaults if self.is_locked() => {
                return Err(CommandError::Lock(LockError::Locked));
            }
            Command::Lock(None) => {
                let state = if self.is_locked() {
                    "locked"
                } else {
                    "not locked"
                };
                reply(true, format_args!("{state}"))
            }
            Command::Lock(Some(number)) => {
                self.lock(number, store).map_err(CommandError::Lock)?;
                reply(true, format_args!("locked"))
            }
            Command::Unlock(number) => {
                let unlocked = self.unlock(number, uptime_ms, store);
                unlocked.map_err(CommandError::Lock)?;
                reply(true, format_args!("unlocked"))
            }
            Command::Version => {
                let [major, minor, patch] = self.board.version;
                let format = binary::FORMAT;
                reply(
                    true,
                    format_args!("rowtone {major}.{minor}.{patch} wire {format}"),
                )
            }
            Command::Status => Message::Status(self.status(uptime_ms, outbox)),
            Command::Get(Some(key)) => {
                reply(true, format_args!("{}", Said(&[key], &self.settings)))
            }
            Command::Get(None) => reply(true, format_args!("{}", Said(&Key::ALL, &self.settings))),
            Command::Set(changes) => {
                let settings = changes.apply(&self.settings)?;
                self.replace(settings).map_err(CommandError::Settings)?;
                reply(true, format_args!("{}", Said(&Key::ALL, &self.settings)))
            }
            Command::Save => {
                self.save(store).map_err(CommandError::Save)?;
                reply(true, format_args!("saved"))
            }
            Command::Defaults => {
                self.replace(self.board.defaults)
                    .map_err(CommandError::Settings)?;
                reply(true, format_args!("{}", Said(&Key::ALL, &self.settings)))
            }
            Command::Resend(from, to) => {
                let (first, last) = outbox.resend(from, to).map_err(CommandError::Resend)?;
                reply(true, format_args!("resending {first} to {last}"))
            }
            Command::Help => reply(
                true,
                format_args!(
                    "version, status, get [KEY], set KEY VALUE ..., save, defaults, resend N [M], lock [N], unlock N, help"
                ),
            ),
        };
        Ok(message)
    }
}

/// Settings as `name=value name=value`.
struct Said<'a>(&'a [Key], &'a Settings);

impl fmt::Display for Said<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, key) in self.0.iter().enumerate() {
            if i > 0 {
                f.write_str(" ")?;
            }
            key.write(self.1, f)?;
        }
        Ok(())
    }
}

/// A reply that can always be encoded: what may not stand in a sentence becomes `?`, and what is
/// too long is cut.
fn reply(ok: bool, text: fmt::Arguments<'_>) -> Message {
    struct Clean(Reply);

    impl Write for Clean {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            for c in text.chars() {
                let plain = matches!(c, ' '..='~') && c != '$' && c != '*';
                self.0
                    .text
                    .push(if plain { c } else { '?' })
                    .map_err(|_| fmt::Error)?;
            }
            Ok(())
        }
    }

    let mut clean = Clean(Reply {
        ok,
        text: heapless::String::new(),
    });
    // An error means that it is full: what fits is said.
    let _ = clean.write_fmt(text);
    Message::Reply(clean.0)
}
