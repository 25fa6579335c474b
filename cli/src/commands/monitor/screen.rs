//! The live view's loop.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use crossterm::event::{self, Event as Input, KeyCode, KeyEventKind, KeyModifiers};

use super::draw::draw;
use super::history::History;
use super::log::Log;
use super::signals::Signals;
use super::view::View;
use crate::failure::Failure;
use crate::terminal::Terminal;
use rowtone_serial::line::Event;
use rowtone_serial::receiver::Receiver as Board;

/// The screen is drawn this often at the most.
const FRAME: Duration = Duration::from_millis(100);

pub(super) fn run(
    port: &str,
    once: bool,
    events: &Receiver<Event>,
    commands: &Sender<Vec<u8>>,
    log: Option<Log>,
) -> Result<(), Failure> {
    let mut terminal = Terminal::take()
        .map_err(|error| Failure::input(format!("terminal: cannot be used: {error}")))?;
    let mut view = View {
        port,
        gone: None,
        once,
        said: String::new(),
        session: 0,
        history: History::default(),
        board: Board::default(),
        heard: None,
        open: None,
    };
    let signals = Signals::catch();
    let done = follow(&mut view, &mut terminal, events, commands, log, &signals);
    // It is as it was before the signal ends the program.
    drop(terminal);
    signals.pass_on();
    done
}

fn follow(
    view: &mut View<'_>,
    terminal: &mut Terminal,
    events: &Receiver<Event>,
    commands: &Sender<Vec<u8>>,
    mut log: Option<Log>,
    signals: &Signals,
) -> Result<(), Failure> {
    let failed = |error| Failure::writing("terminal", &error);
    loop {
        if signals.is_to_end() {
            return Ok(());
        }
        if signals.is_to_pause() {
            terminal.without(|| signals.pause()).map_err(failed)?;
        }
        terminal.draw(|screen| draw(screen, view)).map_err(failed)?;
        let next = Instant::now() + FRAME;
        loop {
            let wait = next.saturating_duration_since(Instant::now());
            match events.recv_timeout(wait) {
                Ok(event) => view.take(event, log.as_mut())?,
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
        if let Some(command) = view.board.ask(Instant::now()) {
            let _ = commands.send(command);
        }
        while event::poll(Duration::ZERO).map_err(failed)? {
            if leaves(&event::read().map_err(failed)?) {
                return Ok(());
            }
        }
    }
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
    use rowtone::report::Report;

    use super::super::view::Age;
    use crate::terminal::Screen;

    fn view() -> View<'static> {
        View {
            port: "/dev/ttyUSB0",
            gone: None,
            once: false,
            said: String::new(),
            session: 0,
            history: History::default(),
            board: Board::default(),
            heard: None,
            open: None,
        }
    }

    fn screen(view: &View<'_>, width: u16, height: u16) -> String {
        let mut screen = Screen::new(width, height);
        draw(&mut screen, view);
        screen.to_string()
    }

    fn hear(view: &mut View<'_>, report: Report) {
        let message = rowtone::wire::Message::Report { session: 2, report };
        let mut line = [0; rowtone::wire::text::MAX_LINE];
        let line = rowtone::wire::text::encode_to_slice(&message, &mut line).unwrap();
        view.take(Event::Bytes(line.to_vec()), None).unwrap();
    }

    #[test]
    fn the_view_shows_peaks_and_losses() {
        let mut view = view();
        assert!(screen(&view, 80, 24).contains("waiting for the first report"));
        for seq in [3, 4, 6] {
            let mut report = rowtone_report::example(Some(10.0));
            report.seq = seq;
            hear(&mut view, report);
        }
        // From too small to be of use to very wide: no panic.
        for (width, height) in [(1, 1), (20, 5), (80, 24), (120, 40), (160, 50), (300, 100)] {
            let screen = screen(&view, width, height);
            if width < 80 {
                continue;
            }
            for part in [
                "49.2003",
                "1500.0000",
                "session 2 #6",
                "lost 1",
                "bad frames 0",
                "3.998",
                "frames were lost",
                "2000 Hz",
                "1000",
            ] {
                assert!(screen.contains(part), "{part} in\n{screen}");
            }
        }
        view.gone = Some("Input/output error".to_owned());
        assert!(screen(&view, 80, 24).contains("away: Input/output error"));
    }

    /// A bar is as long as the amplitude, to an eighth of a cell.
    #[test]
    fn bars_are_in_proportion() {
        let mut view = view();
        let mut report = rowtone_report::example(None);
        report.peaks[0].amplitude_px = 0.8;
        report.peaks[1].amplitude_px = 0.2;
        hear(&mut view, report);
        let screen = screen(&view, 80, 24);
        let eighths = |hz: &str| -> usize {
            let line = screen.lines().find(|line| line.contains(hz)).unwrap();
            let bar = line.chars().skip_while(|c| !"█▉▊▋▌▍▎▏".contains(*c));
            let bar = bar.take_while(|c| "█▉▊▋▌▍▎▏".contains(*c));
            bar.map(|c| 0x2590 - c as usize).sum()
        };
        let (long, short) = (eighths("49.2003"), eighths("1500.0000"));
        assert_eq!(long % 8, 0, "the largest fills its bar");
        assert!(
            long >= 8 * 12 && short == long / 4,
            "{long} {short}\n{screen}"
        );
    }

    #[test]
    fn a_board_that_falls_silent_is_said_to_be() {
        let mut view = view();
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        assert_eq!(view.age(at(99)), None);
        view.open = Some(start);
        assert!(matches!(view.age(at(4)), Some(Age::Fresh(_))));
        assert!(
            matches!(view.age(at(6)), Some(Age::Silent(_))),
            "never heard"
        );
        for seq in 0..2_u32 {
            let mut report = rowtone_report::example(None);
            (report.seq, report.time_ms) = (seq, 4000 * u64::from(seq));
            hear(&mut view, report);
        }
        view.heard = Some(start);
        // Reports are 4 s apart.
        assert!(matches!(view.age(at(11)), Some(Age::Fresh(_))));
        assert_eq!(view.age(at(13)), Some(Age::Silent(Duration::from_secs(13))));
        let shown = screen(&view, 100, 24);
        assert!(shown.contains("last report 0 s ago"), "{shown}");
        view.heard = Instant::now().checked_sub(Duration::from_secs(20));
        let shown = screen(&view, 100, 24);
        assert!(shown.contains("silent for 20 s"), "{shown}");
        assert!(!shown.contains("connected"), "{shown}");
    }
}
