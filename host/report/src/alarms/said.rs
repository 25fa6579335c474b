//! What alarms say of a window, as JSON and as text.

use rowtone::alarm::{Alarms, Event, Happening, Level, Rule, Status};
use serde::Serialize;

use crate::json;
use crate::text::digits;

/// How all rules stand after a window, and what has changed by it.
#[derive(Clone, Debug, Serialize)]
pub struct Said {
    /// The worst level that is shown.
    #[serde(rename = "alarm_level")]
    level: &'static str,
    /// The machine runs, as far as the gate tells.
    running: bool,
    alarms: Vec<AlarmObject>,
    alarm_events: Vec<EventObject>,
}

#[derive(Clone, Debug, Serialize)]
struct AlarmObject {
    name: String,
    level: &'static str,
    active: &'static str,
    acknowledged: bool,
    blind: bool,
    value: Option<f32>,
    unit: &'static str,
    warning_at: Option<f32>,
    trip_at: Option<f32>,
    learning: u16,
}

#[derive(Clone, Debug, Default, Serialize)]
struct EventObject {
    /// `null` of the machine as a whole.
    name: Option<String>,
    event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    from: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    to: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    centre: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    spread: Option<f32>,
    #[serde(skip)]
    sentence: String,
}

impl AlarmObject {
    fn new(rule: &Rule, status: &Status) -> Self {
        Self {
            name: rule.name.as_str().to_owned(),
            level: status.shown.name(),
            active: status.active.name(),
            acknowledged: status.acknowledged,
            blind: status.blind,
            value: status.reading.number(),
            unit: rule.quantity.unit(),
            warning_at: status.warning_at,
            trip_at: status.trip_at,
            learning: status.learning,
        }
    }
}

impl EventObject {
    fn new(event: &Event, of: Option<(&Rule, Status)>) -> Self {
        let unit = of.as_ref().map_or("", |(rule, _)| rule.quantity.unit());
        let name = of.as_ref().map(|(rule, _)| rule.name.as_str().to_owned());
        let told = |value: f32| format!("{} {unit}", digits(value.into(), 3));
        let plain = |event, sentence: &str| Self {
            event,
            sentence: sentence.to_owned(),
            ..Self::default()
        };
        let object = match event.happening {
            Happening::Level { from, to, value } => {
                let value_told = value.map_or("not measured".to_owned(), told);
                let limit = of.as_ref().and_then(|(_, status)| match to {
                    Level::Trip => status.trip_at,
                    _ => status.warning_at,
                });
                let limit = limit.filter(|_| to > from);
                let limit = limit.map_or(String::new(), |at| format!(", limit {}", told(at)));
                Self {
                    from: Some(from.name()),
                    to: Some(to.name()),
                    value,
                    ..plain("level", &format!("{} ({value_told}{limit})", to.name()))
                }
            }
            Happening::Acknowledged => plain("acknowledged", "acknowledged"),
            Happening::Learned { centre, spread } => Self {
                centre: Some(centre),
                spread: Some(spread),
                ..plain(
                    "learned",
                    &format!("learned: usually {}, ± {}", told(centre), told(spread)),
                )
            },
            Happening::Blind => plain("blind", "blind: its windows tell nothing"),
            Happening::Sighted => plain("sighted", "its windows tell something again"),
            Happening::Started => plain("started", "the machine has started"),
            Happening::Stopped => plain("stopped", "the machine has stopped"),
        };
        Self { name, ..object }
    }
}

impl Said {
    pub(super) fn new(alarms: &Alarms, events: &[Event]) -> Self {
        let statuses = alarms.statuses();
        let of = |event: &Event| alarms.statuses().nth(event.rule?.into());
        Self {
            level: alarms.level().name(),
            running: alarms.is_running(),
            alarms: statuses
                .map(|(rule, status)| AlarmObject::new(rule, &status))
                .collect(),
            alarm_events: events
                .iter()
                .map(|event| EventObject::new(event, of(event)))
                .collect(),
        }
    }

    /// Nothing has changed.
    pub fn is_quiet(&self) -> bool {
        self.alarm_events.is_empty()
    }

    /// The same as a JSON object.
    pub fn json(&self) -> String {
        // Numbers, strings and lists of them always serialise.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// A JSON object, such as that of a report, with these keys at its end.
    ///
    /// ```
    /// use rowtone_report::{alarms::Book, example, json};
    /// let text = "[[alarm]]\nname = 'fan'\nquantity = 'velocity'\nwarning = 4.5";
    /// let mut book = Book::parse(text, "a.toml")?;
    /// let report = example(Some(100.0));
    /// let whole = book.window(&report).added_to(json::report(&report));
    /// assert!(whole.starts_with("{\"seq\":3,"));
    /// assert!(whole.contains(",\"alarm_level\":\"normal\",\"running\":true,\"alarms\":[{\"name\":\"fan\""));
    /// # Ok::<(), rowtone_report::alarms::FileError>(())
    /// ```
    #[must_use]
    pub fn added_to(&self, object: String) -> String {
        json::extended(object, self)
    }

    /// What has changed, a line each: `alarm fan: warning (4.90 mm/s, limit 4.50 mm/s)`.
    pub fn lines(&self) -> impl Iterator<Item = String> {
        self.alarm_events.iter().map(|event| match &event.name {
            Some(name) => format!("alarm {name}: {}", event.sentence),
            None => format!("alarm: {}", event.sentence),
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::alarms::Book;
    use rowtone::report::{Report, Warning, Warnings};

    const PAGE: &str = include_str!("../../../../docs/alarms.md");

    fn shaking(mm_s: f32) -> Report {
        Report {
            um_per_px: Some(10.0),
            velocity_mm_s_rms: Some(mm_s),
            ..Report::EMPTY
        }
    }

    #[test]
    fn every_change_is_a_line_and_an_object_of_the_page() {
        let text = "learn_windows = 20\n[running]\nquantity = 'velocity'\nabove = 1\n\
            [[alarm]]\nname = 'fan'\nquantity = 'velocity'\nlatch = true\nwarning = 4.5\n\
            trip = { share = 0.5, spreads = 10 }";
        let mut book = Book::parse(text, "f").unwrap();
        let (mut lines, mut json) = (Vec::new(), String::new());
        let mut take = |said: crate::alarms::Said| {
            lines.extend(said.lines());
            json += &said.json();
        };
        let spoilt = Report {
            warnings: Warnings::of(Warning::Occluded),
            ..shaking(3.0)
        };
        let course = [
            (22, shaking(4.0)),
            (5, shaking(4.9)),
            (70, spoilt),
            (5, shaking(3.0)),
        ];
        for (windows, report) in course {
            (0..windows).for_each(|_| take(book.window(&report)));
        }
        take(book.acknowledge(Some("fan")).unwrap());
        assert!(book.acknowledge(Some("pump")).is_none());
        (0..2).for_each(|_| take(book.window(&shaking(0.1))));
        assert_eq!(
            lines,
            [
                "alarm: the machine has started",
                "alarm fan: learned: usually 4.00 mm/s, ± 0 mm/s",
                "alarm fan: warning (4.90 mm/s, limit 4.50 mm/s)",
                "alarm fan: blind: its windows tell nothing",
                "alarm fan: its windows tell something again",
                "alarm fan: acknowledged",
                "alarm fan: normal (3.00 mm/s)",
                "alarm: the machine has stopped",
            ]
        );
        let keys: Vec<_> = json.split('"').skip(1).step_by(2).collect();
        for key in keys.into_iter().filter(|key| !["fan", ""].contains(key)) {
            assert!(PAGE.contains(key), "{key} is not on the page");
        }
    }
}
