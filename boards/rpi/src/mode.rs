//! Which of the sensor's modes to use, and why.
//!
//! A mode is better the more lines a second are read: that is what the sensitivity grows with (as its square
//! root). Among equals the one with more frames a second is better: fewer frequencies are near a multiple of
//! its frame rate, and columns outside the region are of no use. Only modes with room for the region and
//! enough lines for the highest wanted frequency are taken.

use std::fmt;

use crate::config::{Config, Wish};

/// Lines a period of the highest frequency that are wanted at least.
const LINES_A_PERIOD: f64 = 2.5;

/// A mode that the camera offers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offer {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// From one row to the next, s, where it is known.
    pub line_time_s: Option<f64>,
    /// Fastest, Hz, where it is known.
    pub max_fps: Option<f64>,
}

impl Offer {
    /// Rows a second while a frame is read.
    pub fn lines_hz(&self) -> Option<f64> {
        self.line_time_s.map(f64::recip)
    }

    /// Share of the time in which no row is read at the fastest frame rate.
    pub fn blank(&self) -> Option<f64> {
        Some((1.0 - f64::from(self.height) * self.line_time_s? * self.max_fps?).clamp(0.0, 1.0))
    }
}

/// What a mode must be able to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// Highest frequency to measure, Hz.
    pub highest_hz: f64,
    /// Columns and rows that the region reaches to.
    pub reach: (u16, u16),
}

impl Needs {
    /// What the configuration asks for.
    pub fn of(config: &Config) -> Self {
        let reach = config.settings.roi.map_or((0, 0), |r| {
            (r.x.saturating_add(r.width), r.y.saturating_add(r.height))
        });
        Self {
            highest_hz: config.highest_hz().into(),
            reach,
        }
    }
}

/// A choice and its reasons.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The chosen mode.
    pub offer: Offer,
    /// One line a mode, the chosen one marked.
    pub reasons: String,
}

/// No mode does what is needed.
#[derive(Clone, Debug, PartialEq)]
pub struct NoMode {
    /// One line a mode.
    pub reasons: String,
}

impl fmt::Display for NoMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "no mode of the camera fits: change [camera] mode or roi, or measure.max_hz\n{}",
            self.reasons.trim_end()
        )
    }
}

impl std::error::Error for NoMode {}

/// Chooses among the offers.
///
/// ```
/// use rowtone_rpi::config::Wish;
/// use rowtone_rpi::mode::{choose, Needs, Offer};
/// let offer = |width, height, line_time_s, max_fps| Offer {
///     width, height, line_time_s: Some(line_time_s), max_fps: Some(max_fps),
/// };
/// let imx477 = [offer(4056, 3040, 28.57e-6, 10.0), offer(1332, 990, 7.933e-6, 120.1)];
/// let needs = Needs { highest_hz: 1000.0, reach: (640, 400) };
/// let choice = choose(&imx477, Wish::Auto, &needs)?;
/// assert_eq!(choice.offer.width, 1332);
/// assert!(choice.reasons.contains("126 k lines/s"));
/// # Ok::<(), rowtone_rpi::mode::NoMode>(())
/// ```
///
/// # Errors
/// [`NoMode`] with a reason for each.
pub fn choose(offers: &[Offer], wish: Wish, needs: &Needs) -> Result<Choice, NoMode> {
    let refusal = |o: &Offer| -> Option<String> {
        if let Wish::Size { width, height } = wish
            && (width, height) != (o.width, o.height)
        {
            return Some("not the size asked for".to_owned());
        }
        if o.width < needs.reach.0 || o.height < needs.reach.1 {
            return Some(format!(
                "the region reaches to {}x{}",
                needs.reach.0, needs.reach.1
            ));
        }
        let lines = o.lines_hz()?;
        (wish == Wish::Auto && lines < LINES_A_PERIOD * needs.highest_hz)
            .then(|| format!("too few lines for {} Hz", needs.highest_hz))
    };
    // Unknown line times come last.
    let worth = |o: &Offer| {
        let read = 1.0 - o.blank().unwrap_or(0.0);
        (o.lines_hz().unwrap_or(0.0) * read, o.max_fps.unwrap_or(0.0))
    };
    let fitting = offers.iter().filter(|o| refusal(o).is_none());
    let best = fitting.max_by(|a, b| {
        let (a, b) = (worth(a), worth(b));
        // Line rates within 5 % count as equal.
        if (a.0 - b.0).abs() <= 0.05 * a.0.max(b.0) {
            a.1.total_cmp(&b.1)
        } else {
            a.0.total_cmp(&b.0)
        }
    });
    let mut reasons = String::new();
    for offer in offers {
        let chosen = best.is_some_and(|b| std::ptr::eq(b, offer));
        let mark = if chosen { "->" } else { "  " };
        reasons += &format!("{mark} {offer}");
        match refusal(offer) {
            Some(why) => reasons += &format!(": {why}"),
            None if chosen => reasons += ": the most lines a second that are really read",
            None => {}
        }
        reasons.push('\n');
    }
    match best {
        Some(&offer) => Ok(Choice { offer, reasons }),
        None => Err(NoMode { reasons }),
    }
}

impl fmt::Display for Offer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)?;
        let Some(lines) = self.lines_hz() else {
            return f.write_str(" (line time not known: calibrate)");
        };
        write!(f, " {:.0} k lines/s", lines * 1e-3)?;
        if let Some(fps) = self.max_fps {
            write!(f, ", {fps:.1} frames/s")?;
        }
        if let Some(blank) = self.blank() {
            write!(f, ", {:.0} % blank", 100.0 * blank)?;
        }
        // Single rows could go on to half the line rate; a few of them make a sample.
        write!(f, ", up to {:.0} Hz", lines / LINES_A_PERIOD)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::MODES;

    fn offers(sensor: &str) -> Vec<Offer> {
        let of = MODES.iter().filter(|m| m.sensor == sensor);
        of.map(|m| {
            let (line_time_s, _) = m.line_time_s(None);
            Offer {
                width: m.width,
                height: m.height,
                line_time_s: Some(line_time_s),
                max_fps: Some(m.max_fps(line_time_s)),
            }
        })
        .collect()
    }

    fn auto(sensor: &str, reach: (u16, u16)) -> (u16, u16) {
        let needs = Needs {
            highest_hz: 1000.0,
            reach,
        };
        let offer = choose(&offers(sensor), Wish::Auto, &needs).unwrap().offer;
        (offer.width, offer.height)
    }

    #[test]
    fn the_fastest_mode_with_room_for_the_region() {
        assert_eq!(auto("imx219", (0, 0)), (640, 480));
        // Binned in the analogue part, so twice as many rows a second as the modes that are not.
        assert_eq!(auto("imx219", (1000, 1000)), (1640, 1232));
        assert_eq!(auto("imx219", (1900, 1000)), (1920, 1080));
        assert_eq!(auto("imx477", (0, 0)), (1332, 990));
        assert_eq!(auto("imx708", (0, 0)), (1536, 864));
    }

    #[test]
    fn a_refusal_says_why() {
        let needs = Needs {
            highest_hz: 1000.0,
            reach: (5000, 10),
        };
        let error = choose(&offers("imx219"), Wish::Auto, &needs).unwrap_err();
        assert!(
            error.to_string().contains("the region reaches to 5000x10"),
            "{error}"
        );
        let wish = "123x45".parse().unwrap();
        assert!(choose(&offers("imx219"), wish, &needs).is_err());
        assert!("12".parse::<Wish>().is_err());
    }

    #[test]
    fn an_unknown_line_time_is_better_than_nothing() {
        let offer = Offer {
            width: 640,
            height: 480,
            line_time_s: None,
            max_fps: None,
        };
        let needs = Needs {
            highest_hz: 1000.0,
            reach: (640, 480),
        };
        let choice = choose(&[offer], Wish::Auto, &needs).unwrap();
        assert!(choice.reasons.contains("calibrate"), "{}", choice.reasons);
    }
}
