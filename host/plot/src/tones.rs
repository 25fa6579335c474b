//! The tones of the last window as a list, with all that is said of them.

use plotters::prelude::*;
use rowtone::report::{Peak, Report};
use rowtone_report::text::digits;
use rowtone_report::{sentence, velocity_mm_s_rms};

use super::draw::{Area, Drawn, MUTED, TONE, X_AXIS, Y_AXIS, font};

/// Tones in the list; the rest is counted.
const MOST: usize = 8;
/// Height of a line.
const LINE: i32 = 23;
/// Letters of a note in a line.
const LETTERS: usize = 92;

/// Draws the list: frequency, amplitude, its components, flags; with a scale µm and mm/s; below, what the report warns of.
pub(super) fn list<B>(area: &Area<B>, report: &Report) -> Drawn
where
    B: DrawingBackend,
    B::ErrorType: 'static,
{
    let um = report.um_per_px.map(f64::from);
    let heads: &[(i32, &str)] = if um.is_some() {
        &[
            (30, "Hz"),
            (130, "px"),
            (200, "µm"),
            (275, "mm/s RMS"),
            (365, "x, px"),
            (435, "y, px"),
        ]
    } else {
        &[(30, "Hz"), (150, "px"), (260, "x, px"), (350, "y, px")]
    };
    let flags_at = if um.is_some() { 505 } else { 440 };
    area.draw(&Text::new("Tones of the last window", (10, 12), font(16)))?;
    let mut y = 44;
    for (x, head) in heads {
        area.draw(&Text::new(*head, (*x, y), font(13).color(&MUTED)))?;
    }
    y += LINE;
    for peak in report.peaks.iter().take(MOST) {
        mark(area, (17, y + 7), peak)?;
        let px = f64::from(peak.amplitude_px);
        let part = |v: Option<f32>| v.map_or("–".to_owned(), |v| digits(v.into(), 3));
        let motion = peak.motion.as_ref();
        let [along_x, along_y] = [motion.and_then(|m| m.x_px), motion.and_then(|m| m.y_px)];
        let mut cells = vec![format!("{:.3}", peak.hz), digits(px, 3)];
        if let Some(um) = um {
            cells.push(digits(px * um, 3));
            cells.push(digits(velocity_mm_s_rms(peak.hz.into(), px * um), 3));
        }
        cells.extend([part(along_x), part(along_y)]);
        for ((x, _), cell) in heads.iter().zip(cells) {
            area.draw(&Text::new(cell, (*x, y), font(14)))?;
        }
        area.draw(&Text::new(
            flags(peak),
            (flags_at, y),
            font(13).color(&MUTED),
        ))?;
        y += LINE;
    }
    let more = report.peaks.len().saturating_sub(MOST);
    if report.peaks.is_empty() {
        area.draw(&Text::new("none above the noise", (30, y), font(14)))?;
        y += LINE;
    } else if more > 0 {
        area.draw(&Text::new(format!("and {more} more"), (30, y), font(13)))?;
        y += LINE;
    }
    legend(area, y + 8)?;
    y += 2 * LINE + 4;
    let bottom = area.dim_in_pixel().1 as i32 - LINE;
    for warning in report.warnings.iter().map(sentence) {
        let lines = wrapped(warning);
        if y + lines.len() as i32 * (LINE - 6) > bottom {
            break;
        }
        for line in lines {
            area.draw(&Text::new(line, (10, y), font(13)))?;
            y += LINE - 6;
        }
        y += 4;
    }
    Ok(())
}

/// How a tone is drawn: full where it is sure, hollow where it may be another frequency.
pub(super) fn mark<B>(area: &Area<B>, at: (i32, i32), peak: &Peak) -> Drawn
where
    B: DrawingBackend,
    B::ErrorType: 'static,
{
    area.draw(&Circle::new(at, 5, WHITE.filled()))?;
    if peak.ambiguous {
        area.draw(&Circle::new(at, 4, TONE.stroke_width(2)))?;
    } else {
        area.draw(&Circle::new(at, 5, TONE.filled()))?;
    }
    Ok(())
}

/// What is said of a tone, in a few words.
pub(super) fn flags(peak: &Peak) -> String {
    let mut flags = Vec::new();
    if peak.ambiguous {
        flags.push("ambiguous".to_owned());
    }
    if let Some(n) = peak.harmonic {
        flags.push(if n == 1 {
            "running speed".to_owned()
        } else {
            format!("{n}x harmonic")
        });
    }
    if let Some(motion) = &peak.motion {
        let said = [
            (!motion.rigid, "bends"),
            (motion.decay_s.is_some(), "dies away"),
            (motion.modulation.is_some(), "modulated"),
            (motion.spread_hz.is_some(), "unsteady"),
        ];
        let words = said.iter().filter(|(is, _)| *is);
        flags.extend(words.map(|(_, word)| (*word).to_owned()));
    }
    flags.join(", ")
}

/// What the marks and lines of the spectrum are.
fn legend<B>(area: &Area<B>, y: i32) -> Drawn
where
    B: DrawingBackend,
    B::ErrorType: 'static,
{
    let middle = y + 7;
    area.draw(&Circle::new((17, middle), 5, TONE.filled()))?;
    area.draw(&Text::new("tone", (28, y), font(13)))?;
    area.draw(&Circle::new((82, middle), 4, TONE.stroke_width(2)))?;
    area.draw(&Text::new("ambiguous", (93, y), font(13)))?;
    for (x, colour, name) in [
        (180, X_AXIS, "x: part of a tone, and what is left"),
        (420, Y_AXIS, "y: the same"),
    ] {
        let line = vec![(x, middle), (x + 22, middle)];
        area.draw(&PathElement::new(line, colour.stroke_width(2)))?;
        area.draw(&Text::new(name, (x + 29, y), font(13)))?;
    }
    Ok(())
}

/// In lines of no more letters than fit.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last().map_or(0, |l| l.chars().count());
        if line > 0 && line + 1 + word.chars().count() > LETTERS {
            lines.push("   ".to_owned());
        }
        if let Some(line) = lines.last_mut() {
            let gap = if line.trim().is_empty() { "" } else { " " };
            *line += gap;
            *line += word;
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::report::Motion;

    #[test]
    fn flags_are_in_words_and_notes_are_not_cut() {
        let peak = Peak {
            hz: 49.2,
            hz_sd: 0.01,
            amplitude_px: 0.1,
            amplitude_px_sd: 0.001,
            snr_db: 40.0,
            ambiguous: true,
            track: 0,
            harmonic: Some(2),
            motion: Some(Motion {
                rigid: false,
                ..Motion::STEADY
            }),
        };
        assert_eq!(flags(&peak), "ambiguous, 2x harmonic, bends");
        let text = "word ".repeat(40);
        let lines = wrapped(text.trim());
        assert!(lines.iter().all(|l| l.chars().count() <= LETTERS + 3));
        let words: usize = lines.iter().map(|l| l.split_whitespace().count()).sum();
        assert_eq!((lines.len(), words), (3, 40));
    }
}
