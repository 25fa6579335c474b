//! The program as a service: measures for ever, opens the camera anew when it fails, ends cleanly.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;

use rowtone::link::Link;
use rowtone::link::outbox::Outbox;
use rowtone::link::settings::store::{Keep, Nowhere, SaveError, Started, Store};
use rowtone::link::settings::{Board, Console, Limits, Settings, SettingsError};
use rowtone::report::Report;
use rowtone::wire::SettingsOrigin;

use rowtone_page::live::Phase;

use crate::alive::Alive;
use crate::backoff::Backoff;
use crate::capture::{CameraError, Source};
use crate::config::Config;
pub use crate::journal::log;
use crate::notify::Notifier;
use crate::session::{self, Ended};
use crate::setup::Setup;
use crate::shared::Shared;
use crate::store::FileFlash;
use crate::system;
use crate::uart::Uart;

/// Reports on their way to the line.
const QUEUE: usize = 8;
/// Reports kept for a host that missed some.
const KEPT: usize = 256;

/// Opens the camera; called again after every failure.
pub type Open<'a> = dyn FnMut(&Config) -> Result<Box<dyn Source>, CameraError> + 'a;

/// Where settings are kept, where they can be.
pub enum Keeper {
    /// In a file.
    File(Store<FileFlash>),
    /// Nowhere.
    Nowhere,
}

impl Keep for Keeper {
    fn save(&mut self, session: u32, settings: &Settings) -> Result<(), SaveError> {
        match self {
            Self::File(store) => store.save(session, settings),
            Self::Nowhere => Nowhere.save(session, settings),
        }
    }
}

impl Keeper {
    /// Opens the file and counts this start; measuring goes on without it.
    fn open(config: &Config) -> (Self, Started) {
        let path = &config.service.state;
        if path.as_os_str().is_empty() {
            let started = Started {
                session: session_by_time(),
                settings: None,
                origin: SettingsOrigin::Defaults,
            };
            return (Self::Nowhere, started);
        }
        let store = FileFlash::open(path)
            .map(|flash| (flash, None))
            .or_else(|e| FileFlash::open_read_only(path).map(|flash| (flash, Some(e))))
            .map_err(|e| e.to_string())
            .and_then(|(flash, read_only)| {
                let store = Store::new(flash, 0).map_err(|e| e.to_string())?;
                Ok((store, read_only))
            });
        match store {
            Ok((mut store, read_only)) => {
                let mut started = store.start();
                if let Some(e) = read_only {
                    log(&format!(
                        "{}: settings are read and cannot be kept: {e}",
                        path.display()
                    ));
                    // The start could not be counted.
                    started.session = session_by_time();
                }
                (Self::File(store), started)
            }
            Err(e) => {
                log(&format!("{}: settings cannot be kept: {e}", path.display()));
                let started = Started {
                    session: session_by_time(),
                    settings: None,
                    origin: SettingsOrigin::Defaults,
                };
                (Self::Nowhere, started)
            }
        }
    }
}

/// A number that differs from run to run.
fn session_by_time() -> u32 {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    now.map_or(1, |t| t.as_secs() as u32)
}

/// Measures until `shared.stop`; returns when the last report is on the line.
///
/// # Errors
/// [`SettingsError`] when the configuration's settings cannot be.
pub fn run(config: &Config, shared: &Shared, open: &mut Open<'_>) -> Result<(), SettingsError> {
    let (keeper, mut started) = Keeper::open(config);
    if let Some(saved) = started.settings {
        let (settings, said) = config.with_saved(saved);
        started.settings = Some(settings);
        said.iter().for_each(|line| log(line));
    }
    let board = Board {
        version: version(),
        // What the core can take; the line learns the picture's size when the camera is open.
        limits: Limits {
            width: 8192,
            height: u16::MAX,
            min_width: 16,
            max_window_s: 60.0,
        },
        defaults: config.settings,
    };
    let console = Console::new(board, started)?;
    if let Ok(mut settings) = shared.settings.lock() {
        *settings = *console.settings();
    }
    let mut slots = vec![None; KEPT];
    let uart = Uart {
        config: config.output.clone(),
        link: Link::new(console, Outbox::new(&mut slots), config.output.baud),
        store: keeper,
    };
    let (reports, to_send) = sync_channel(QUEUE);
    std::thread::scope(|scope| {
        scope.spawn(move || uart.run(&to_send, shared));
        // The queue ends with this call, and with it the output thread.
        measure(config, shared, open, reports);
    });
    Ok(())
}

fn version() -> [u16; 3] {
    let mut parts = env!("CARGO_PKG_VERSION")
        .split('.')
        .map(|part| part.parse().unwrap_or(0));
    std::array::from_fn(|_| parts.next().unwrap_or(0))
}

/// The line thread.
fn measure(config: &Config, shared: &Shared, open: &mut Open<'_>, reports: SyncSender<Report>) {
    let notifier = Notifier::from_environment();
    if let Err(e) = system::lock_memory() {
        log(&format!("memory may be swapped out: {e}"));
    }
    let mut backoff = Backoff::new(Duration::from_millis(500), Duration::from_secs(30));
    let mut ready = false;
    let mut alive = Alive::new(&notifier, &shared.pulses, shared.started);
    while !shared.is_stopping() {
        let outcome = open(config).map(|mut source| {
            if !ready {
                notifier.say("READY=1");
                ready = true;
                raise_priority(config);
            }
            sessions(source.as_mut(), config, shared, &reports, &notifier)
        });
        let why = match outcome {
            Ok(Ok(measured)) if shared.is_stopping() => {
                log(&format!("ended after {measured} frames"));
                break;
            }
            Ok(Ok(_)) => {
                backoff.reset();
                "the camera is opened anew".to_owned()
            }
            Ok(Err(why)) => why,
            Err(e) => e.to_string(),
        };
        if let Some(live) = &shared.live {
            live.set_phase(Phase::Failed, &why);
        }
        let wait = backoff.failed();
        log(&format!("{why}; next try in {:.1} s", wait.as_secs_f64()));
        notifier.say(&format!(
            "STATUS={}",
            why.lines().next().unwrap_or_default()
        ));
        while !backoff.is_due() && !shared.is_stopping() {
            std::thread::sleep(Duration::from_millis(50));
            match ready {
                true => alive.tell(),
                false => alive.still_starting(),
            }
        }
    }
    notifier.say("STOPPING=1");
}

fn raise_priority(config: &Config) {
    if let Some(priority) = config.service.realtime_priority
        && let Err(e) = system::set_realtime_priority(priority)
    {
        log(&format!(
            "lines are taken at usual priority: real time is not allowed ({e})"
        ));
    }
}

/// Sessions on one opening of the camera, until it fails. How many frames were measured, or why none
/// could be.
fn sessions(
    source: &mut dyn Source,
    config: &Config,
    shared: &Shared,
    reports: &SyncSender<Report>,
    notifier: &Notifier,
) -> Result<u64, String> {
    let mut measured = 0;
    let shape = source.facts().shape;
    shared.set_picture(shape.width, shape.height);
    loop {
        let settings = shared.settings();
        let whole = Settings {
            roi: None,
            ..settings
        };
        // A region that was saved or configured for another camera: better measure all than nothing.
        let setup = Setup::new(source.facts(), config, &settings).or_else(|e| {
            log(&format!("{e}; the whole picture is used"));
            Setup::new(source.facts(), config, &whole)
        });
        let setup = setup.map_err(|e| e.to_string())?;
        log(&describe(source, &setup));
        notifier.say("STATUS=measuring");
        let (ended, frames) = session::run(source, &setup, config, shared, reports, notifier)
            .map_err(|e| e.to_string())?;
        measured += frames.good;
        log(&format!(
            "{} frames measured, {} lost, {} late, {} corrupt; {} windows or reports dropped",
            frames.good,
            frames.lost,
            frames.late,
            frames.corrupt,
            shared.dropped.load(Ordering::Relaxed)
        ));
        match ended {
            Ended::Changed => {}
            Ended::Asked => return Ok(measured),
            Ended::Camera(e) if measured == 0 => return Err(e.to_string()),
            Ended::Camera(e) => {
                log(&e.to_string());
                return Ok(measured);
            }
        }
    }
}

fn describe(source: &dyn Source, setup: &Setup) -> String {
    let facts = source.facts();
    // Which modes there are, and why this one.
    let mut text = facts.reasons.clone();
    text += &format!(
        "{}: {}x{}, {} of {} bits, part {}x{} at {},{}, {} rows a sample",
        facts.id,
        facts.shape.width,
        facts.shape.height,
        setup.tracker.bits,
        facts.shape.format.bits(),
        setup.part.width,
        setup.part.height,
        setup.part.x,
        setup.part.y,
        setup.group.rows_per_sample()
    );
    for remark in &setup.remarks {
        text += &format!("\n{remark}");
    }
    text
}
