//! The live view: peaks with bars and trends, a waterfall, and what was lost.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use ratatui::Frame;
use ratatui::crossterm::event::{self, Event as Input, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};
use rowtone::report::{Peak, Report};
use rowtone::wire::Arrival;

use super::history::{History, TREND};
use super::log::Log;
use super::went_away;
use crate::failure::Failure;
use crate::line::Event;
use crate::output::{band_velocity, text::digits, warnings};
use crate::receiver::{Heard, Receiver as Board};

/// The screen is drawn this often at the most.
const FRAME: Duration = Duration::from_millis(100);

/// All that is shown.
struct View<'a> {
    port: &'a str,
    /// Why the line is not there, if it is not.
    gone: Option<String>,
    /// Whether to end when the line goes away.
    once: bool,
    /// What the board last said that is no report.
    said: String,
    session: u32,
    history: History,
    board: Board,
}

pub(super) fn run(
    port: &str,
    once: bool,
    events: &Receiver<Event>,
    commands: &Sender<Vec<u8>>,
    log: Option<Log>,
) -> Result<(), Failure> {
    let mut terminal = ratatui::try_init()
        .map_err(|error| Failure::input(format!("terminal: cannot be used: {error}")))?;
    let mut view = View {
        port,
        gone: None,
        once,
        said: String::new(),
        session: 0,
        history: History::default(),
        board: Board::default(),
    };
    let done = view.follow(&mut terminal, events, commands, log);
    ratatui::restore();
    done
}

impl View<'_> {
    fn follow(
        &mut self,
        terminal: &mut ratatui::DefaultTerminal,
        events: &Receiver<Event>,
        commands: &Sender<Vec<u8>>,
        mut log: Option<Log>,
    ) -> Result<(), Failure> {
        let failed = |error| Failure::writing("terminal", &error);
        loop {
            terminal.draw(|frame| self.draw(frame)).map_err(failed)?;
            let next = Instant::now() + FRAME;
            loop {
                let wait = next.saturating_duration_since(Instant::now());
                match events.recv_timeout(wait) {
                    Ok(event) => self.take(event, log.as_mut())?,
                    Err(RecvTimeoutError::Timeout) => break,
                    // The file has ended; its last picture stays until the user leaves.
                    Err(RecvTimeoutError::Disconnected) => {
                        std::thread::sleep(wait);
                        break;
                    }
                }
                if wait.is_zero() {
                    break;
                }
            }
            if let Some(command) = self.board.ask(Instant::now()) {
                let _ = commands.send(command);
            }
            while event::poll(Duration::ZERO).map_err(failed)? {
                if leaves(&event::read().map_err(failed)?) {
                    return Ok(());
                }
            }
        }
    }

    fn take(&mut self, event: Event, mut log: Option<&mut Log>) -> Result<(), Failure> {
        match event {
            Event::Open => self.gone = None,
            Event::Gone(why) if self.once => {
                return Err(went_away(self.port, self.board.counters().reports, &why));
            }
            Event::Gone(why) => self.gone = Some(why),
            Event::End => self.gone = Some("the input has ended".to_owned()),
            Event::Bytes(bytes) => {
                let mut heard = vec![];
                self.board.hear(&bytes, |one| heard.push(one));
                for one in heard {
                    match one {
                        Heard::Report {
                            session,
                            report,
                            arrival,
                        } => {
                            if let Some(log) = log.as_deref_mut() {
                                log.append(session, &report)?;
                            }
                            self.report(session, &report, arrival);
                        }
                        Heard::Status(status) => {
                            self.said = format!(
                                "up {} s, {} reports dropped",
                                status.uptime_ms / 1000,
                                status.dropped_reports
                            );
                        }
                        Heard::Reply(reply) => self.said = reply.text.to_string(),
                    }
                }
            }
        }
        Ok(())
    }

    fn report(&mut self, session: u32, report: &Report, arrival: Arrival) {
        match arrival {
            // One that came late goes into the log, but would upset the order here.
            Arrival::Again => return,
            Arrival::Restarted => self.history.clear(),
            _ => {}
        }
        self.session = session;
        self.history.push(report);
    }

    fn draw(&self, frame: &mut Frame<'_>) {
        let peaks = self.history.reports.front().map_or(0, |r| r.peaks.len());
        let table = u16::try_from(peaks.max(4) + 3).unwrap_or(u16::MAX);
        let [head, middle, below, foot] = Layout::vertical([
            Constraint::Length(2),
            Constraint::Length(table.min(frame.area().height / 2)),
            Constraint::Min(4),
            Constraint::Length(2),
        ])
        .areas(frame.area());
        frame.render_widget(Paragraph::new(self.head()), head);
        frame.render_widget(self.peaks(middle), middle);
        frame.render_widget(self.waterfall(below), below);
        frame.render_widget(Paragraph::new(self.foot()), foot);
    }

    fn head(&self) -> Vec<Line<'_>> {
        let state = match &self.gone {
            None => "connected".green(),
            Some(why) => Span::raw(why).red(),
        };
        let mut line = vec!["rowtone ".bold(), self.port.into(), "  ".into(), state];
        let mut notes = vec![];
        if let Some(report) = self.history.reports.front() {
            line.push(format!("  session {} #{}", self.session, report.seq).into());
            let seconds = report.time_ms as f64 / 1000.0;
            notes.push(Span::raw(format!(
                "{seconds:.1} s  window {} s  {:.3} fps  {} rows  noise {} px",
                report.window_s,
                report.fps,
                report.lines,
                digits(report.noise_px.into(), 2)
            )));
            if let Some(velocity) = band_velocity(report) {
                notes.push(format!("  {velocity:.3} mm/s RMS").bold());
            }
            for (name, _) in warnings(report.warnings) {
                notes.push(format!("  {name}").yellow());
            }
        }
        vec![Line::from(line), Line::from(notes)]
    }

    fn peaks(&self, area: Rect) -> Paragraph<'_> {
        let mut lines = vec![];
        let report = self.history.reports.front();
        let scale = report.and_then(|report| report.um_per_px);
        let unit = if scale.is_some() { "µm" } else { "px" };
        let bar = usize::from(area.width).saturating_sub(52 + TREND).min(60);
        lines.push(
            Line::from(format!(
                "{:>12} {:>9} {:>12} {:>7}  {:bar$}  trend",
                "Hz", "±", unit, "dB", ""
            ))
            .dark_gray(),
        );
        let largest = self.history.max_amplitude_px();
        for peak in report.into_iter().flat_map(|report| &report.peaks) {
            lines.push(self.peak(peak, scale, largest, bar));
        }
        if report.is_some_and(|report| report.peaks.is_empty()) {
            lines.push("no vibration above the noise".into());
        } else if report.is_none() {
            lines.push("waiting for the first report".dark_gray().into());
        }
        Paragraph::new(lines).block(Block::bordered().title(" peaks "))
    }

    fn peak(&self, peak: &Peak, scale: Option<f32>, largest: f32, bar: usize) -> Line<'_> {
        let amplitude = peak.amplitude_px * scale.unwrap_or(1.0);
        let share = (peak.amplitude_px / largest.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let full = (share * bar as f32).round() as usize;
        let mut notes = peak.harmonic.map_or(String::new(), |n| format!(" {n}x"));
        if peak.ambiguous {
            notes += " ?";
        }
        Line::from(vec![
            format!("{:>12.4}", peak.hz).bold(),
            format!(" {:>9}", digits(peak.hz_sd.into(), 2)).dark_gray(),
            format!(" {:>12}", digits(amplitude.into(), 4)).into(),
            format!(" {:>7.1}  ", peak.snr_db).into(),
            "█".repeat(full).cyan(),
            format!("{:1$}  ", "", bar - full.min(bar)).into(),
            format!("{:>TREND$}", self.history.trend(peak.track)).green(),
            notes.yellow(),
        ])
    }

    /// One row a report, the newest on top; 0 Hz on the left.
    fn waterfall(&self, area: Rect) -> Paragraph<'_> {
        let columns = usize::from(area.width.saturating_sub(2)).max(1);
        let rows = usize::from(area.height.saturating_sub(3));
        let (max_hz, largest) = (self.history.max_hz(), self.history.max_amplitude_px());
        let mut lines: Vec<Line<'_>> = self
            .history
            .reports
            .iter()
            .take(rows)
            .map(|report| waterfall_row(report, columns, max_hz, largest))
            .collect();
        lines.resize(rows, Line::default());
        let (left, right) = ("0 Hz", format!("{max_hz} Hz"));
        let gap = columns.saturating_sub(left.len() + right.len());
        lines.push(Line::from(format!("{left}{:gap$}{right}", "")).dark_gray());
        Paragraph::new(lines).block(Block::bordered().title(" waterfall, newest on top "))
    }

    fn foot(&self) -> Vec<Line<'_>> {
        let counters = self.board.counters();
        let alarm = |count: u64| match count {
            0 => Style::new(),
            _ => Style::new().fg(Color::Red).bold(),
        };
        vec![
            Line::from(vec![
                format!("reports {}  ", counters.reports).into(),
                Span::styled(format!("lost {}  ", counters.lost), alarm(counters.lost)),
                format!("asked again {}  ", counters.recovered).into(),
                Span::styled(
                    format!("bad frames {}  ", counters.bad),
                    alarm(counters.bad),
                ),
                format!("restarts {}  ", counters.restarts).into(),
                Span::raw(&self.said).dark_gray(),
            ]),
            Line::from("q leaves").dark_gray(),
        ]
    }
}

fn waterfall_row(report: &Report, columns: usize, max_hz: f32, largest: f32) -> Line<'static> {
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
    let cell = |level: &u8| match level {
        5 => "█".fg(Color::White),
        4 => "▓".fg(Color::Yellow),
        3 => "▒".fg(Color::Red),
        2 => "░".fg(Color::Magenta),
        1 => "·".fg(Color::Blue),
        _ => " ".into(),
    };
    Line::from(levels.iter().map(cell).collect::<Vec<_>>())
}

fn leaves(input: &Input) -> bool {
    let Input::Key(key) = input else { return false };
    let control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
    key.kind != KeyEventKind::Release
        && (control_c || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::{Terminal, backend::TestBackend};

    #[test]
    fn the_view_shows_peaks_and_losses() {
        let mut view = View {
            port: "/dev/ttyUSB0",
            gone: None,
            once: false,
            said: String::new(),
            session: 0,
            history: History::default(),
            board: Board::default(),
        };
        for seq in [3, 4, 6] {
            let mut report = crate::output::tests::example(Some(10.0));
            report.seq = seq;
            let message = rowtone::wire::Message::Report { session: 2, report };
            let mut line = [0; rowtone::wire::text::MAX_LINE];
            let line = rowtone::wire::text::encode_to_slice(&message, &mut line).unwrap();
            view.take(Event::Bytes(line.to_vec()), None).unwrap();
        }
        // From too small to be of use to very wide: no panic.
        for (width, height) in [(1, 1), (20, 5), (80, 24), (120, 40), (300, 100)] {
            let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
            terminal.draw(|frame| view.draw(frame)).unwrap();
            let screen = terminal.backend().to_string();
            if width >= 100 {
                for part in [
                    "49.2003",
                    "1500.0000",
                    "session 2 #6",
                    "lost 1",
                    "bad frames 0",
                    "3.998",
                    "lost_frames",
                    "2000 Hz",
                ] {
                    assert!(screen.contains(part), "{part} in\n{screen}");
                }
            }
        }
    }
}
