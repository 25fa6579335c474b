//! The page of a board on a serial line: what it says, and its settings.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::{Args, open};
use crate::alarm_args::{added, judge};
use crate::failure::Failure;
use rowtone::link::settings::{Key, Limits, Settings};
use rowtone::wire::text;
use rowtone_page::control::{BOARD_KEYS, Control};
use rowtone_page::live::{About, Live, Phase};
use rowtone_report::json;
use rowtone_serial::line::{self, Event};
use rowtone_serial::port::PortName;
use rowtone_serial::receiver::{Heard, Receiver};

/// How long a board may take for an answer.
const PATIENCE: Duration = Duration::from_secs(3);
/// Its settings are asked for so often until they are known.
const ASKED_EVERY: Duration = Duration::from_secs(2);

/// The board as the page sees it.
struct Board {
    settings: Mutex<Settings>,
    known: AtomicBool,
    commands: Mutex<Sender<Vec<u8>>>,
    /// The answer to the command that was sent last.
    answer: Mutex<Option<(bool, String)>>,
    answered: Condvar,
}

impl Board {
    fn send(&self, command: &str) {
        let mut line = String::new();
        // Writing to a string cannot fail, and a line that has gone takes nothing.
        let _ = text::encode_command(command, &mut line);
        let commands = self.commands.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = commands.send(line.into_bytes());
    }

    /// Sends a command and waits for its answer.
    fn ask(&self, command: &str) -> Result<String, String> {
        let mut answer = self.answer.lock().unwrap_or_else(PoisonError::into_inner);
        *answer = None;
        self.send(command);
        let waited = self
            .answered
            .wait_timeout_while(answer, PATIENCE, |answer| answer.is_none());
        let mut answer = waited.unwrap_or_else(PoisonError::into_inner).0;
        match answer.take() {
            Some((true, text)) => Ok(text),
            Some((false, text)) => Err(text),
            None => Err("the board does not answer: is its line connected both ways?".to_owned()),
        }
    }

    fn heard(&self, ok: bool, text: &str) {
        self.learn(text);
        *self.answer.lock().unwrap_or_else(PoisonError::into_inner) = Some((ok, text.to_owned()));
        self.answered.notify_all();
    }

    /// Reads `window=1 hop=0.5 …`, the answer to `get`.
    fn learn(&self, text: &str) {
        let mut settings = self.settings();
        let mut all = true;
        for pair in text.split_ascii_whitespace() {
            let known = pair
                .split_once('=')
                .and_then(|(name, value)| Key::from_name(name)?.set(&mut settings, value).ok());
            all &= known.is_some();
        }
        if all && !text.is_empty() {
            *self.settings.lock().unwrap_or_else(PoisonError::into_inner) = settings;
            self.known.store(true, Ordering::Release);
        }
    }
}

impl Control for Board {
    fn settings(&self) -> Settings {
        *self.settings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The board checks what fits its picture and memory itself.
    fn limits(&self) -> Limits {
        Limits {
            width: u16::MAX,
            height: u16::MAX,
            min_width: 16,
            max_window_s: 60.0,
        }
    }

    fn keys(&self) -> &[Key] {
        if self.known.load(Ordering::Acquire) {
            &BOARD_KEYS
        } else {
            &[]
        }
    }

    fn is_live(&self) -> bool {
        true
    }

    fn change(&self, settings: Settings) -> Result<(), String> {
        let before = self.settings();
        let mut command = "set".to_owned();
        for key in BOARD_KEYS {
            let (mut old, mut new) = (String::new(), String::new());
            // Writing to a string cannot fail.
            let _ = key.write(&before, &mut old);
            let _ = key.write(&settings, &mut new);
            if old != new {
                command += " ";
                command += &new.replacen('=', " ", 1);
            }
        }
        if command == "set" {
            return Ok(());
        }
        self.ask(&command)?;
        // Over its next start too.
        self.ask("save")?;
        *self.settings.lock().unwrap_or_else(PoisonError::into_inner) = settings;
        Ok(())
    }
}

/// Follows the port until asked to end.
pub(super) fn run(args: &Args, port: &PortName) -> Result<(), Failure> {
    let stop = crate::stop::on_signals();
    let mut alarms = args.alarms.book()?;
    let live = Arc::new(Live::default());
    live.describe(About {
        name: port.path.clone(),
        ..About::default()
    });
    let (commands_to, commands) = channel();
    let board = Arc::new(Board {
        settings: Mutex::new(Settings::default()),
        known: AtomicBool::new(false),
        commands: Mutex::new(commands_to.clone()),
        answer: Mutex::new(None),
        answered: Condvar::new(),
    });
    let server = open(args, &live, Arc::clone(&board) as Arc<dyn Control>)?;
    let mut ear = Receiver::default();
    let mut asked: Option<Instant> = None;
    line::follow(port, true, &commands, |event| {
        match event {
            Event::Open => {
                ear.set_line(true);
                asked = None;
                live.set_phase(Phase::Measuring, "");
            }
            Event::Gone(why) => {
                ear.set_line(false);
                live.set_phase(
                    Phase::Failed,
                    &format!("the line went away ({why}): it is waited for"),
                );
            }
            Event::End => live.set_phase(Phase::Ended, ""),
            Event::Bytes(bytes) => ear.hear(&bytes, |heard| match heard {
                Heard::Report { report, .. } => {
                    let said = judge(&mut alarms, &report);
                    let object = json::zoned(&report, args.machine.as_ref());
                    live.report(&report, added(said.as_ref(), object));
                }
                Heard::Reply(reply) => board.heard(reply.ok, &reply.text),
                Heard::Status(_) => {}
            }),
        }
        live.lost
            .reports
            .store(ear.counters().lost, Ordering::Relaxed);
        if let Some(command) = ear.ask(Instant::now()) {
            let _ = commands_to.send(command);
        }
        if !board.known.load(Ordering::Acquire) && asked.is_none_or(|at| at.elapsed() > ASKED_EVERY)
        {
            board.send("get");
            asked = Some(Instant::now());
        }
        !stop.load(Ordering::Relaxed)
    })?;
    live.reports.close();
    drop(server);
    Ok(())
}
