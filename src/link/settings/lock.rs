//! A lock for the settings: who knows its number takes it away.
//!
//! It keeps off whoever does not know the number, and mistakes. It is no cipher: who can listen to the
//! line hears the number when it is used.

use core::fmt;

use super::Console;
use super::store::{Keep, SaveError};

/// After a wrong number the next one is not looked at for so long, ms: all 32-bit numbers take a
/// century, and six digits a week.
const WAIT_MS: u64 = 1000;

/// Why something was not done for the lock's sake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LockError {
    /// The settings are locked.
    Locked,
    /// The settings are not locked.
    NotLocked,
    /// It is another number.
    WrongNumber,
    /// It came too soon after a wrong number.
    TooSoon,
    /// The change holds until the next start: it could not be kept.
    NotKept(SaveError),
}

impl fmt::Display for LockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Locked => "settings: locked; unlock them first",
            Self::NotLocked => "unlock: the settings are not locked",
            Self::WrongNumber => "unlock: another number; wait a second and try again",
            Self::TooSoon => "unlock: too soon after a wrong number; wait a second",
            Self::NotKept(_) => "lock: changed, but not kept over the next start",
        })
    }
}

impl core::error::Error for LockError {}

impl Console {
    /// Whether the settings are locked: then nobody changes or saves them.
    pub fn is_locked(&self) -> bool {
        self.settings().lock.is_some()
    }

    /// Locks the settings in use with a number, 1 to 4294967295, and keeps them with the lock.
    ///
    /// # Errors
    /// [`LockError::Locked`] where they are locked already; [`LockError::NotKept`] where the lock holds
    /// until the next start only.
    pub fn lock(&mut self, number: u32, store: &mut impl Keep) -> Result<(), LockError> {
        if self.is_locked() {
            return Err(LockError::Locked);
        }
        self.put_lock(Some(number), store)
    }

    /// Takes the lock away, and keeps the settings without it. `uptime_ms` is the time since the
    /// board's start.
    ///
    /// # Errors
    /// See [`LockError`].
    pub fn unlock(
        &mut self,
        number: u32,
        uptime_ms: u64,
        store: &mut impl Keep,
    ) -> Result<(), LockError> {
        let lock = self.settings().lock.ok_or(LockError::NotLocked)?;
        let recent = |at: u64| uptime_ms.saturating_sub(at) < WAIT_MS;
        if self.wrong_number_at_ms.is_some_and(recent) {
            return Err(LockError::TooSoon);
        }
        if lock != number {
            self.wrong_number_at_ms = Some(uptime_ms);
            return Err(LockError::WrongNumber);
        }
        self.wrong_number_at_ms = None;
        self.put_lock(None, store)
    }

    fn put_lock(&mut self, lock: Option<u32>, store: &mut impl Keep) -> Result<(), LockError> {
        self.settings.lock = lock;
        self.save(store).map_err(LockError::NotKept)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::outbox::Outbox;
    use crate::link::settings::store::Started;
    use crate::link::settings::{Board, Limits, Settings};
    use crate::wire::{Message, SettingsOrigin};

    /// Keeps the last settings.
    #[derive(Default)]
    struct Memory(Option<Settings>);

    impl Keep for Memory {
        fn save(&mut self, _session: u32, settings: &Settings) -> Result<(), SaveError> {
            self.0 = Some(*settings);
            Ok(())
        }
    }

    fn console(settings: Option<Settings>) -> Console {
        let board = Board {
            version: [0, 1, 0],
            limits: Limits {
                width: 320,
                height: 240,
                min_width: 16,
                max_window_s: 10.0,
            },
            defaults: Settings::default(),
        };
        let origin = SettingsOrigin::Saved;
        let started = Started {
            session: 1,
            settings,
            origin,
        };
        Console::new(board, started).unwrap()
    }

    /// Whether it was done, and what was said.
    fn say(console: &mut Console, line: &str, uptime_ms: u64, store: &mut Memory) -> bool {
        let mut slots = [const { None }; 2];
        let mut outbox = Outbox::new(&mut slots);
        match console.carry_out(line, uptime_ms, &mut outbox, store) {
            Message::Reply(reply) => reply.ok,
            _ => true,
        }
    }

    #[test]
    fn locked_settings_can_be_read_and_not_changed() {
        let mut store = Memory::default();
        let mut console = console(None);
        assert!(say(&mut console, "set hop 0.25", 0, &mut store));
        assert!(say(&mut console, "lock 1234", 0, &mut store));
        let locked = *console.settings();
        assert_eq!(store.0, Some(locked), "kept with the lock");
        for refused in [
            "set hop 0.5",
            "save",
            "defaults",
            "lock 5",
            "lock 1234",
            "lock 0",
        ] {
            assert!(!say(&mut console, refused, 0, &mut store), "{refused}");
        }
        assert!(console.replace(Settings::default()).is_err());
        for allowed in ["get", "get hop", "status", "version", "help", "lock"] {
            assert!(say(&mut console, allowed, 0, &mut store), "{allowed}");
        }
        assert_eq!((*console.settings(), store.0), (locked, Some(locked)));
    }

    #[test]
    fn it_outlives_a_start_and_is_taken_away_by_its_number() {
        let mut store = Memory::default();
        assert!(say(&mut console(None), "lock 4294967295", 0, &mut store));
        let mut console = console(store.0);
        assert!(!say(&mut console, "unlock 1", 5000, &mut store));
        // The right one too soon after a wrong one.
        assert!(!say(&mut console, "unlock 4294967295", 5999, &mut store));
        assert!(console.is_locked());
        assert!(say(&mut console, "unlock 4294967295", 6000, &mut store));
        assert_eq!(store.0.unwrap().lock, None, "kept without the lock");
        assert!(say(&mut console, "set hop 0.5", 6001, &mut store));
        assert!(!say(&mut console, "unlock 4294967295", 6002, &mut store));
    }
}
