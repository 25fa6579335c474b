//! The file with the rules of a machine.

use std::fmt;

use rowtone::alarm::{Band, Config, Gate, Limit, Part, Quantity, Rule, RuleError, ToneMeasure};
use serde::Deserialize;
use toml::Spanned;

/// Why a file's rules cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    /// The file.
    pub file: String,
    /// The line, where it is known.
    pub line: Option<usize>,
    /// What is wrong, and what to do.
    pub why: String,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}: {}", self.file, self.why),
            None => write!(f, "{}: {}", self.file, self.why),
        }
    }
}

impl std::error::Error for FileError {}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    learn_windows: Option<u16>,
    blind_windows: Option<u16>,
    running: Option<Spanned<GateEntry>>,
    #[serde(default)]
    alarm: Vec<Spanned<RuleEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GateEntry {
    quantity: Name,
    unit: Option<String>,
    hz: Option<f32>,
    within_hz: Option<f32>,
    from_hz: Option<f32>,
    to_hz: Option<f32>,
    order: Option<u8>,
    above: f32,
    #[serde(default)]
    settle_windows: u16,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RuleEntry {
    name: Spanned<String>,
    quantity: Name,
    unit: Option<String>,
    hz: Option<f32>,
    within_hz: Option<f32>,
    from_hz: Option<f32>,
    to_hz: Option<f32>,
    order: Option<u8>,
    warning: Option<LimitEntry>,
    trip: Option<LimitEntry>,
    delay: Option<u8>,
    hysteresis: Option<f32>,
    #[serde(default)]
    latch: bool,
}

/// What a rule watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Name {
    Velocity,
    #[serde(rename = "velocity_from_2_hz")]
    VelocityFrom2Hz,
    Displacement,
    PeakToPeak,
    Acceleration,
    CrestFactor,
    Tone,
    Order,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(
    untagged,
    expecting = "give a number, or { share = 0.12, spreads = 3 } for one that is learned"
)]
enum LimitEntry {
    Fixed(f32),
    Learned { share: f32, spreads: f32 },
}

impl From<LimitEntry> for Limit {
    fn from(entry: LimitEntry) -> Self {
        match entry {
            LimitEntry::Fixed(value) => Self::Fixed(value),
            LimitEntry::Learned { share, spreads } => Self::Learned { share, spreads },
        }
    }
}

/// What says which frequencies.
struct Where {
    near: [Option<f32>; 2],
    range: [Option<f32>; 2],
    order: Option<u8>,
}

/// A quantity by its name, its unit and its frequencies.
fn quantity(name: Name, unit: Option<&str>, at: &Where) -> Result<Quantity, String> {
    let band = |band| (Part::Band(band), false);
    let velocity = !matches!(unit, Some("um" | "px"));
    let measure = match velocity {
        true => ToneMeasure::Velocity,
        false => ToneMeasure::Amplitude,
    };
    let (part, has_place) = match name {
        Name::Velocity => band(Band::Velocity),
        Name::VelocityFrom2Hz => band(Band::VelocityFrom2Hz),
        Name::Displacement => band(Band::Displacement),
        Name::PeakToPeak => band(Band::PeakToPeak),
        Name::Acceleration => band(Band::Acceleration),
        Name::CrestFactor => band(Band::CrestFactor),
        Name::Tone => (tone(at, measure)?, true),
        Name::Order => {
            let order = at.order.ok_or("give its order, as order = 1")?;
            (Part::Order { order, measure }, true)
        }
    };
    let places = at.near.iter().chain(&at.range).any(Option::is_some);
    if (places && name != Name::Tone)
        || (at.order.is_some() && name != Name::Order)
        || (!has_place && places)
    {
        return Err("hz, within_hz, from_hz, to_hz are a tone's, and order an order's".to_owned());
    }
    let either = [true, false].map(|scaled| Quantity { part, scaled });
    let unit = unit.unwrap_or(either[0].unit());
    let fits = either.into_iter().find(|quantity| quantity.unit() == unit);
    fits.ok_or_else(|| {
        let more = if has_place { ", \"um\" or \"px\"" } else { "" };
        let [scaled, plain] = either.map(|quantity| quantity.unit());
        format!("unit must be {scaled:?} or {plain:?}{more}")
    })
}

fn tone(at: &Where, measure: ToneMeasure) -> Result<Part, String> {
    let (from_hz, to_hz) = match (at.near, at.range) {
        ([Some(hz), within_hz], [None, None]) => {
            let within_hz = within_hz.unwrap_or(1.0);
            (hz - within_hz, hz + within_hz)
        }
        ([None, None], [Some(from_hz), Some(to_hz)]) => (from_hz, to_hz),
        _ => return Err("give the tone's hz and within_hz, or from_hz and to_hz".to_owned()),
    };
    Ok(Part::Tone {
        from_hz: from_hz.max(0.0),
        to_hz,
        measure,
    })
}

impl RuleEntry {
    fn rule(&self) -> Result<Rule, String> {
        let usual = Rule::velocity("");
        let name = self.name.get_ref();
        let too_long = |_| format!("its name is longer than {} bytes", rowtone::alarm::MAX_NAME);
        let at = Where {
            near: [self.hz, self.within_hz],
            range: [self.from_hz, self.to_hz],
            order: self.order,
        };
        let rule = Rule {
            name: name.as_str().try_into().map_err(too_long)?,
            quantity: quantity(self.quantity, self.unit.as_deref(), &at)?,
            warning: self.warning.map(Limit::from),
            trip: self.trip.map(Limit::from),
            delay: self.delay.unwrap_or(usual.delay),
            hysteresis: self.hysteresis.unwrap_or(usual.hysteresis),
            latch: self.latch,
        };
        rule.check().map_err(|e: RuleError| e.to_string())?;
        Ok(rule)
    }
}

impl GateEntry {
    fn gate(&self) -> Result<Gate, String> {
        let at = Where {
            near: [self.hz, self.within_hz],
            range: [self.from_hz, self.to_hz],
            order: self.order,
        };
        Ok(Gate {
            quantity: quantity(self.quantity, self.unit.as_deref(), &at)?,
            above: self.above,
            settle_windows: self.settle_windows,
        })
    }
}

/// The rules of a file's text; `name` is what errors call it.
///
/// # Errors
/// [`FileError`], with the line where it is known.
pub fn parse(text: &str, name: &str) -> Result<Config, FileError> {
    let wrong = |at: Option<usize>, why: String| {
        let before = |at: usize| {
            text.as_bytes()
                .iter()
                .take(at)
                .filter(|&&b| b == b'\n')
                .count()
        };
        FileError {
            file: name.to_owned(),
            line: at.map(|at| before(at) + 1),
            why,
        }
    };
    let file: File = toml::from_str(text).map_err(|e| {
        let why = e.message().lines().next().unwrap_or_default();
        wrong(e.span().map(|span| span.start), why.to_owned())
    })?;
    if file.alarm.is_empty() {
        return Err(wrong(
            None,
            "name at least one alarm, as [[alarm]]".to_owned(),
        ));
    }
    let mut config = Config::default();
    for entry in &file.alarm {
        let name = &entry.get_ref().name;
        let at = Some(name.span().start);
        let named = |why: String| wrong(at, format!("alarm {}: {why}", name.get_ref()));
        let rule = entry.get_ref().rule().map_err(named)?;
        let too_many = |_| wrong(at, "eight alarms at most".to_owned());
        config.rules.push(rule).map_err(too_many)?;
    }
    if let Some(entry) = &file.running {
        let at = Some(entry.span().start);
        let named = |why: String| wrong(at, format!("running: {why}"));
        config.running = Some(entry.get_ref().gate().map_err(named)?);
    }
    config.learn_windows = file.learn_windows.unwrap_or(config.learn_windows);
    config.blind_windows = file.blind_windows.unwrap_or(config.blind_windows);
    config.check().map_err(|e| wrong(None, e.to_string()))?;
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = include_str!("../../../../docs/alarms.md");

    #[test]
    fn the_file_on_the_page_is_one() {
        let text = PAGE
            .split("```toml")
            .nth(1)
            .unwrap()
            .split("```")
            .next()
            .unwrap();
        let config = parse(text, "page").unwrap();
        assert_eq!(config.rules.len(), 4);
        assert_eq!(config.rules[0].trip, Some(Limit::Fixed(7.1)));
        assert_eq!(config.rules[1].warning, Some(Limit::LEARNED_WARNING));
        let tone = Part::Tone {
            from_hz: 86.8,
            to_hz: 87.8,
            measure: ToneMeasure::Amplitude,
        };
        assert_eq!(config.rules[2].quantity.part, tone);
        let order = Part::Order {
            order: 2,
            measure: ToneMeasure::Velocity,
        };
        assert_eq!(config.rules[3].quantity.part, order);
        assert!(config.running.is_some_and(|gate| gate.settle_windows == 20));
    }

    #[test]
    fn a_line_says_what_is_wrong() {
        let alarm = |more: &str| format!("[[alarm]]\nname = \"a\"\n{more}");
        for (text, why) in [
            (String::new(), "f: name at least one alarm, as [[alarm]]"),
            (
                alarm("quantity = \"noise\""),
                "f:3: unknown variant `noise`",
            ),
            (
                alarm("quantity = \"velocity\""),
                "f:2: alarm a: it has neither",
            ),
            (
                alarm("quantity = \"velocity\"\nwarning = \"x\""),
                "f:4: give a number, or { share",
            ),
            (
                alarm("quantity = \"velocity\"\nhz = 3\nwarning = 1"),
                "f:2: alarm a: hz, within_hz",
            ),
            (
                alarm("quantity = \"tone\"\nhz = 3\nto_hz = 4\nwarning = 1"),
                "f:2: alarm a: give the tone's hz",
            ),
            (
                alarm("quantity = \"velocity\"\nunit = \"g\"\nwarning = 1"),
                "f:2: alarm a: unit must be \"mm/s\" or \"px/s\"",
            ),
            (
                alarm("quantity = \"order\"\nwarning = 1"),
                "f:2: alarm a: give its order",
            ),
            (
                alarm(
                    "quantity = \"velocity\"\nwarning = 1\n[running]\nquantity = \"velocity\"\nabove = nan",
                ),
                "f: what tells that the machine runs",
            ),
            (
                alarm("quantity = \"velocity\"\nwarning = nan"),
                "f:2: alarm a: a limit must",
            ),
            (
                format!(
                    "learn_windows = 3\n{}",
                    alarm("quantity = \"velocity\"\nwarning = 1")
                ),
                "f: learn_windows must be",
            ),
        ] {
            let error = parse(&text, "f").unwrap_err().to_string();
            assert!(error.starts_with(why), "{error}\nfor {why}");
        }
    }
}
