//! The alarms of the machine that this device looks at: judged with each report, shown on a contact.

use std::io;
use std::time::{Duration, Instant};

use rowtone::alarm::Level;
use rowtone::report::Report;
use rowtone_report::alarms::{Book, FileError, Said};

use crate::config::{AlarmsConfig, ContactConfig};
use crate::gpio::OutputLine;
use crate::journal::log;

/// After so long without a report a contact that is to fail safe opens.
const SILENT: Duration = Duration::from_secs(30);

/// What a contact's line is driven by.
trait Drive: Send {
    fn set(&mut self, high: bool) -> io::Result<()>;
}

impl Drive for OutputLine {
    fn set(&mut self, high: bool) -> io::Result<()> {
        OutputLine::set(self, high)
    }
}

/// The contact and what it shows.
struct Contact {
    line: Box<dyn Drive>,
    at: Level,
    fail_safe: bool,
    high: Option<bool>,
}

/// The rules and their contact.
pub struct Desk {
    book: Book,
    contact: Option<Contact>,
    heard: Instant,
}

impl std::fmt::Debug for Desk {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Desk")
            .field("book", &self.book)
            .finish_non_exhaustive()
    }
}

impl Desk {
    /// Reads the rules and takes the contact's line; `None` where the configuration has no rules. A line that cannot be had
    /// is logged, and alarms are judged all the same.
    ///
    /// # Errors
    /// [`FileError`] for rules that cannot be used.
    pub fn open(config: &AlarmsConfig) -> Result<Option<Self>, FileError> {
        let Some(rules) = &config.rules else {
            return Ok(None);
        };
        let book = Book::read(rules)?;
        let contact = config.contact.as_ref().and_then(|contact| {
            let ContactConfig { chip, line, .. } = contact;
            let failed = |e: &io::Error| {
                log(&format!(
                    "alarms: {}, line {line}: {e}; there is no contact",
                    chip.display()
                ));
            };
            // Until a window was judged a contact that fails safe is open, and so is the other.
            let taken = OutputLine::request(chip, *line, false)
                .inspect_err(failed)
                .ok()?;
            Some(Contact {
                line: Box::new(taken),
                at: contact.at,
                fail_safe: contact.fail_safe,
                high: Some(false),
            })
        });
        Ok(Some(Self {
            book,
            contact,
            heard: Instant::now(),
        }))
    }

    /// Judges a report, logs what has changed, and sets the contact.
    pub fn window(&mut self, report: &Report) -> Said {
        self.heard = Instant::now();
        let said = self.book.window(report);
        said.lines().for_each(|line| log(&line));
        self.show();
        said
    }

    /// Acknowledges all alarms.
    pub fn acknowledge(&mut self) {
        if let Some(said) = self.book.acknowledge(None) {
            said.lines().for_each(|line| log(&line));
        }
        self.show();
    }

    /// Opens a contact that fails safe where no report has come for long.
    pub fn hear_silence(&mut self, now: Instant) {
        if let Some(contact) = &mut self.contact
            && contact.fail_safe
            && now.saturating_duration_since(self.heard) >= SILENT
        {
            contact.drive(false);
        }
    }

    fn show(&mut self) {
        let alarm = |at: Level| self.book.level() >= at;
        let blind = self.book.alarms().is_blind();
        if let Some(contact) = &mut self.contact {
            let high = match contact.fail_safe {
                true => !alarm(contact.at) && !blind,
                false => alarm(contact.at),
            };
            contact.drive(high);
        }
    }
}

impl Contact {
    fn drive(&mut self, high: bool) {
        if self.high == Some(high) {
            return;
        }
        match self.line.set(high) {
            Ok(()) => self.high = Some(high),
            Err(e) => {
                // Once, until it goes again.
                if self.high.take().is_some() {
                    log(&format!("alarms: the contact cannot be set: {e}"));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    const RULES: &str = "blind_windows = 5\n[[alarm]]\nname = 'fan'\nquantity = 'velocity'\n\
        warning = 4.5\ntrip = 7\ndelay = 2\nlatch = true";

    #[derive(Clone, Default)]
    struct Wire(Arc<Mutex<Vec<bool>>>);

    impl Drive for Wire {
        fn set(&mut self, high: bool) -> io::Result<()> {
            self.0.lock().unwrap().push(high);
            Ok(())
        }
    }

    fn desk(fail_safe: bool) -> (Desk, Wire) {
        let wire = Wire::default();
        let contact = Contact {
            line: Box::new(wire.clone()),
            at: Level::Trip,
            fail_safe,
            high: Some(false),
        };
        let desk = Desk {
            book: Book::parse(RULES, "f").unwrap(),
            contact: Some(contact),
            heard: Instant::now(),
        };
        (desk, wire)
    }

    fn feed(desk: &mut Desk, windows: usize, mm_s: f32) {
        let report = Report {
            um_per_px: Some(10.0),
            velocity_mm_s_rms: Some(mm_s),
            ..Report::EMPTY
        };
        (0..windows).for_each(|_| drop(desk.window(&report)));
    }

    fn seen(wire: &Wire) -> Vec<bool> {
        std::mem::take(&mut wire.0.lock().unwrap())
    }

    #[test]
    fn a_contact_closes_at_its_level_and_opens_when_it_is_acknowledged() {
        let (mut desk, wire) = desk(false);
        feed(&mut desk, 4, 5.0);
        assert!(seen(&wire).is_empty());
        feed(&mut desk, 4, 8.0);
        feed(&mut desk, 4, 1.0);
        assert_eq!(seen(&wire), [true]);
        desk.acknowledge();
        assert_eq!(seen(&wire), [false]);
        desk.hear_silence(Instant::now() + SILENT);
        assert!(seen(&wire).is_empty());
    }

    #[test]
    fn a_contact_that_fails_safe_is_closed_only_while_all_is_seen_to_be_well() {
        let (mut desk, wire) = desk(true);
        feed(&mut desk, 1, 1.0);
        assert_eq!(seen(&wire), [true]);
        feed(&mut desk, 8, f32::NAN);
        assert_eq!(seen(&wire), [false]);
        feed(&mut desk, 1, 1.0);
        assert_eq!(seen(&wire), [true]);
        desk.hear_silence(Instant::now() + SILENT);
        assert_eq!(seen(&wire), [false]);
        feed(&mut desk, 1, 1.0);
        feed(&mut desk, 4, 8.0);
        assert_eq!(seen(&wire), [true, false]);
    }

    #[test]
    fn no_rules_are_no_alarms_and_a_missing_chip_is_no_reason_to_end() {
        let mut config = AlarmsConfig::default();
        assert!(Desk::open(&config).unwrap().is_none());
        let path = std::env::temp_dir().join(format!("rowtone-alarms-{}.toml", std::process::id()));
        std::fs::write(&path, RULES).unwrap();
        config.rules = Some(path.clone());
        config.contact = Some(ContactConfig {
            chip: "/nowhere/gpiochip0".into(),
            line: 17,
            at: Level::Trip,
            fail_safe: true,
        });
        assert!(Desk::open(&config).unwrap().is_some());
        std::fs::remove_file(&path).unwrap();
        assert!(Desk::open(&config).is_err());
    }
}
