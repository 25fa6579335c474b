//! The alarms of a machine on a host: rules from a file, and what they say of each report.

mod file;
mod said;

use std::path::Path;

use rowtone::alarm::{Alarms, Config, Level};
use rowtone::report::Report;

pub use file::{FileError, parse};
pub use said::Said;

/// The rules of a machine and how they stand.
#[derive(Clone, Debug)]
pub struct Book {
    alarms: Alarms,
    config: Config,
}

impl Book {
    /// Rules from a file as `docs/alarms.md` describes it.
    ///
    /// # Errors
    /// [`FileError`], with the line where it is known.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let text = std::fs::read_to_string(path).map_err(|e| FileError {
            file: path.display().to_string(),
            line: None,
            why: format!("cannot be read: {e}"),
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Rules from a file's text; `name` is what errors call it.
    ///
    /// # Errors
    /// As [`Book::read`].
    ///
    /// ```
    /// use rowtone_report::alarms::Book;
    /// let text = "[[alarm]]\nname = 'fan'\nquantity = 'velocity'\nwarning = 4.5\ntrip = 3";
    /// let error = Book::parse(text, "a.toml").unwrap_err();
    /// assert_eq!(error.to_string(), "a.toml:2: alarm fan: the warning must be below the trip");
    /// ```
    pub fn parse(text: &str, name: &str) -> Result<Self, FileError> {
        let config = parse(text, name)?;
        let alarms = Alarms::new(config.clone()).map_err(|e| FileError {
            file: name.to_owned(),
            line: None,
            why: e.to_string(),
        })?;
        Ok(Self { alarms, config })
    }

    /// Takes the next window's report, and says how all rules stand and what has changed.
    pub fn window(&mut self, report: &Report) -> Said {
        let events = self.alarms.window(report);
        Said::new(&self.alarms, &events)
    }

    /// Forgets all that was seen and learned: another recording begins.
    pub fn restart(&mut self) {
        // They were possible before.
        if let Ok(alarms) = Alarms::new(self.config.clone()) {
            self.alarms = alarms;
        }
    }

    /// Acknowledges one rule's alarm by its name, or all; what has changed, `None` where no rule has the name.
    pub fn acknowledge(&mut self, name: Option<&str>) -> Option<Said> {
        let index = match name {
            None => None,
            Some(name) => {
                let mut rules = self.alarms.statuses().map(|(rule, _)| rule.name.as_str());
                Some(rules.position(|rule| rule == name)?)
            }
        };
        let events = self.alarms.acknowledge(index);
        Some(Said::new(&self.alarms, &events))
    }

    /// The worst level that is shown.
    pub fn level(&self) -> Level {
        self.alarms.level()
    }

    /// The core's alarms.
    pub fn alarms(&self) -> &Alarms {
        &self.alarms
    }

    /// The same, to give back baselines that were kept.
    pub fn alarms_mut(&mut self) -> &mut Alarms {
        &mut self.alarms
    }
}
