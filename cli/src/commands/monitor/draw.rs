//! The live view drawn: peaks with bars and trends, a waterfall, and what was lost.

use std::time::Instant;

use rowtone::report::{Peak, Report};

use super::history::{History, TREND};
use super::view::{Age, View};
use crate::terminal::{Block, Color, Line, Paragraph, Rect, Screen, Span, Style, Stylize, rows};
use rowtone_report::{band_velocity, sentence, text::digits, velocity_mm_s_rms};

/// Columns of a peak's numbers, and of what is noted behind its trend.
const NUMBERS: usize = 37;
const NOTES: usize = 6;
/// Columns of its velocity, where there is a scale and room.
const VELOCITY: usize = 10;
/// Columns left of the waterfall, for times.
const TIMES: usize = 7;

pub(super) fn draw(screen: &mut Screen, view: &View<'_>) {
    let newest = view.history.reports.front();
    let peaks = newest.map_or(0, |report| report.peaks.len());
    let notes = newest.map_or(0, |report| report.warnings.iter().count());
    let area = screen.area();
    // The waterfall keeps four rows where there are as many.
    let left = area.height.saturating_sub(5);
    let head = u16::try_from(2 + notes).unwrap_or(u16::MAX);
    let head = head.min(area.height / 2).min(left);
    let middle = u16::try_from(peaks.max(4) + 3).unwrap_or(u16::MAX);
    let middle = middle.min(area.height / 2).min(left - head);
    let heights = [Some(head), Some(middle), None, Some(1)];
    let [head, middle, below, foot] = rows(area, heights);
    screen.render(&Paragraph::new(top(view)), head);
    screen.render(&table(&view.history, middle), middle);
    screen.render(&waterfall(&view.history, below), below);
    screen.render(&Paragraph::new(vec![bottom(view)]), foot);
}

fn top<'a>(view: &'a View<'_>) -> Vec<Line<'a>> {
    let age = view.age(Instant::now());
    let state = match (&view.gone, age) {
        (Some(why), _) => format!("away: {why}").red(),
        (None, Some(Age::Silent(age))) => format!("silent for {} s", age.as_secs()).red().bold(),
        (None, _) => "connected".green(),
    };
    let mut first = vec!["rowtone ".bold(), view.port.into(), "  ".into(), state];
    if let (Some(Age::Fresh(age)), Some(_)) = (age, view.heard) {
        first.push(format!("  last report {} s ago", age.as_secs()).into());
    }
    let Some(report) = view.history.reports.front() else {
        return vec![Line::from(first)];
    };
    first.push(format!("  session {} #{}", view.session, report.seq).into());
    let seconds = report.time_ms as f64 / 1000.0;
    let mut second = vec![Span::raw(format!(
        "{seconds:.1} s  window {} s  {:.3} fps  {} rows  noise {} px",
        report.window_s,
        report.fps,
        report.lines,
        digits(report.noise_px.into(), 2)
    ))];
    if let Some(velocity) = band_velocity(report) {
        second.push(format!("  {velocity:.3} mm/s RMS").bold());
    }
    let mut lines = vec![Line::from(first), Line::from(second)];
    let warnings = report.warnings.iter();
    lines.extend(warnings.map(|warning| Line::from(sentence(warning)).yellow()));
    lines
}

/// The peaks of the newest report.
fn table(history: &History, area: Rect) -> Paragraph<'static> {
    let report = history.reports.front();
    let columns = Columns::of(report, area);
    let mut lines = vec![columns.heading().dark_gray()];
    let largest = history.max_amplitude_px();
    match report {
        None => lines.push(Line::from("waiting for the first report").dark_gray()),
        Some(report) if report.peaks.is_empty() => {
            lines.push(Line::from("no vibration above the noise"));
        }
        Some(report) => {
            let peak = |peak| columns.peak(peak, largest, history);
            lines.extend(report.peaks.iter().map(peak));
        }
    }
    Paragraph::new(lines).block(Block::titled(" peaks "))
}

/// How the columns of the table are laid out.
struct Columns {
    /// µm a pixel.
    scale: Option<f32>,
    velocity: bool,
    bar: usize,
    trend: usize,
}

impl Columns {
    fn of(report: Option<&Report>, area: Rect) -> Self {
        let scale = report.and_then(|report| report.um_per_px);
        let width = usize::from(area.width).saturating_sub(2);
        let velocity = scale.is_some() && width >= 100;
        let numbers = NUMBERS + if velocity { VELOCITY } else { 0 };
        let free = width.saturating_sub(numbers + 2 + NOTES);
        let trend = (free / 2).min(TREND);
        Self {
            scale,
            velocity,
            bar: (free - trend).min(64),
            trend,
        }
    }

    fn heading(&self) -> Line<'static> {
        let unit = if self.scale.is_some() { "µm" } else { "px" };
        let mut text = format!("{:>10} {:>8} {unit:>9} ", "Hz", "±");
        if self.velocity {
            text += &format!("{:>9} ", "mm/s");
        }
        text += &format!("{:>5}  {:2$}", "dB", "", self.bar);
        Line::from(format!("{text}  trend"))
    }

    fn peak(&self, peak: &Peak, largest: f32, history: &History) -> Line<'static> {
        let amplitude = peak.amplitude_px * self.scale.unwrap_or(1.0);
        let mut notes = peak.harmonic.map_or(String::new(), |n| format!(" {n}x"));
        if peak.ambiguous {
            notes += " ?";
        }
        let mut spans = vec![
            format!("{:>10.4}", peak.hz).bold(),
            format!(" {:>8}", digits(peak.hz_sd.into(), 2)).dark_gray(),
            format!(" {:>9} ", digits(amplitude.into(), 4)).into(),
        ];
        if self.velocity {
            let velocity = velocity_mm_s_rms(peak.hz.into(), amplitude.into());
            spans.push(format!("{:>9} ", digits(velocity, 3)).into());
        }
        spans.extend([
            format!("{:>5.1}  ", peak.snr_db).into(),
            bar(peak.amplitude_px / largest.max(f32::MIN_POSITIVE), self.bar).cyan(),
            "  ".into(),
            format!("{:>1$}", history.trend(peak.track, self.trend), self.trend).green(),
            notes.yellow(),
        ]);
        Line::from(spans)
    }
}

/// A share of a bar so many cells long, to an eighth of a cell.
fn bar(share: f32, cells: usize) -> String {
    let eighths = (share.clamp(0.0, 1.0) * (8 * cells) as f32).round() as usize;
    // Something that is there is to be seen.
    let eighths = eighths.max(usize::from(share > 0.0 && cells > 0));
    let mut text = "█".repeat(eighths / 8);
    if !eighths.is_multiple_of(8) {
        text.push(['▏', '▎', '▍', '▌', '▋', '▊', '▉'][eighths % 8 - 1]);
    }
    let len = eighths.div_ceil(8);
    text + &" ".repeat(cells - len.min(cells))
}

/// One row a report, the newest on top; 0 Hz on the left.
fn waterfall(history: &History, area: Rect) -> Paragraph<'static> {
    let columns = usize::from(area.width).saturating_sub(2 + TIMES).max(1);
    let rows = usize::from(area.height.saturating_sub(3));
    let (max_hz, largest) = (history.max_hz(), history.max_amplitude_px());
    let newest_ms = history.reports.front().map_or(0, |report| report.time_ms);
    let mut lines = vec![];
    for (row, report) in history.reports.iter().take(rows).enumerate() {
        let ago_s = newest_ms.saturating_sub(report.time_ms) as f64 / 1000.0;
        let time = match row % 5 {
            _ if row == 0 => format!("{:>1$} ", "now", TIMES - 1),
            0 => format!("{:>1$.1} ", -ago_s, TIMES - 1),
            _ => " ".repeat(TIMES),
        };
        let mut spans = vec![time.dark_gray()];
        spans.extend(waterfall_row(report, columns, max_hz, largest));
        lines.push(Line::from(spans));
    }
    lines.resize(rows, Line::default());
    lines.push(Line::from(axis(columns, max_hz)).dark_gray());
    Paragraph::new(lines).block(Block::titled(" waterfall: s ago, newest on top "))
}

/// Frequencies below the waterfall, at five places.
fn axis(columns: usize, max_hz: f32) -> String {
    let mut text = format!("{:>1$} 0", "", TIMES - 1);
    for quarter in 1..=4_u8 {
        let unit = if quarter == 4 { " Hz" } else { "" };
        let label = format!("{}{unit}", max_hz * f32::from(quarter) / 4.0);
        // The last one ends at the edge, the others stand in the middle below their place.
        let place = TIMES + columns * usize::from(quarter) / 4;
        let back = if quarter == 4 {
            label.len()
        } else {
            label.len() / 2
        };
        let gap = place.saturating_sub(back + text.chars().count());
        if gap > 0 {
            text += &" ".repeat(gap);
            text += &label;
        }
    }
    text
}

fn waterfall_row(
    report: &Report,
    columns: usize,
    max_hz: f32,
    largest: f32,
) -> impl Iterator<Item = Span<'static>> {
    let mut levels = vec![0_u8; columns];
    for peak in &report.peaks {
        let column = (peak.hz / max_hz * columns as f32) as usize;
        // 10 dB a step below the largest.
        let below_db = -20.0 * (peak.amplitude_px / largest.max(f32::MIN_POSITIVE)).log10();
        let level = 5 - (below_db / 10.0).clamp(0.0, 4.0) as u8;
        if let Some(cell) = levels.get_mut(column) {
            *cell = (*cell).max(level);
        }
    }
    levels.into_iter().map(|level| match level {
        5 => "█".fg(Color::White),
        4 => "▓".fg(Color::Yellow),
        3 => "▒".fg(Color::Red),
        2 => "░".fg(Color::Magenta),
        1 => "·".fg(Color::Blue),
        _ => " ".into(),
    })
}

fn bottom<'a>(view: &'a View<'_>) -> Line<'a> {
    let counters = view.board.counters();
    let alarm = |count: u64| match count {
        0 => Style::default(),
        _ => Style::default().fg(Color::Red).bold(),
    };
    Line::from(vec![
        format!("reports {}  ", counters.reports).into(),
        Span::styled(format!("lost {}  ", counters.lost), alarm(counters.lost)),
        format!("recovered {}  ", counters.recovered).into(),
        Span::styled(
            format!("bad frames {}  ", counters.bad),
            alarm(counters.bad),
        ),
        format!("restarts {}  ", counters.restarts).into(),
        "q leaves  ".dark_gray(),
        Span::raw(&view.said).dark_gray(),
    ])
}
