//! The command `rowtone-rpi`; see the library for how it works.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::{Parser, Subcommand};
use rowtone_page::live::Live;
use rowtone_page::password::Hash;
use rowtone_rpi::alarms::Desk;
use rowtone_rpi::capture::simulated::{Scene, Simulated};
use rowtone_rpi::capture::{CameraError, Source};
use rowtone_rpi::config::Wish;
use rowtone_rpi::config::{Config, ConfigError, Replay, StreamWish};
use rowtone_rpi::doctor;
use rowtone_rpi::page;
use rowtone_rpi::run::{self, log};
use rowtone_rpi::shared::Shared;
use rowtone_rpi::trend::Keeper;
use rowtone_rpi::uart::TEXT;

/// Where the configuration is unless told otherwise; it may be missing.
const USUAL_CONFIG: &str = "/etc/rowtone/rowtone-rpi.toml";

/// Measures vibration with a Raspberry Pi camera and reports peaks over UART.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Examples:\n  rowtone-rpi doctor\n  rowtone-rpi --output - --simulate\n  \
    rowtone-rpi --config my.toml --mode auto"
)]
struct Cli {
    /// Configuration file [default: /etc/rowtone/rowtone-rpi.toml, where there is one]
    #[arg(long, value_name = "FILE", global = true)]
    config: Option<PathBuf>,
    /// Serial device, - for standard output, or text for people [default on a terminal: text]
    #[arg(long, value_name = "PORT", global = true)]
    output: Option<String>,
    /// Part of the camera's name
    #[arg(long, value_name = "NAME", global = true)]
    camera: Option<String>,
    /// Sensor mode: auto, or a size as 1332x990
    #[arg(long, value_name = "MODE", global = true)]
    mode: Option<String>,
    /// Kind of pictures: raw rows of the sensor, or luma of the image processor
    #[arg(long, value_name = "raw|luma", global = true)]
    stream: Option<String>,
    /// From one row to the next, us
    #[arg(long, value_name = "T", global = true)]
    line_time_us: Option<f64>,
    /// For tests: each picture is shown so many times and counts once
    #[arg(long, value_name = "N", global = true, requires = "frame_period_us")]
    take_every: Option<u32>,
    /// For tests: pictures are so far apart, whatever the camera's clock says
    #[arg(long, value_name = "T", global = true)]
    frame_period_us: Option<f64>,
    /// A simulated machine instead of a camera (97.3 Hz with 0.4 px, 211.7 Hz with 0.1 px); --mode gives its size
    #[arg(long, global = true)]
    simulate: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Subcommand)]
enum Command {
    /// Measures until stopped (the default)
    Run,
    /// Checks camera, serial port, permissions, light, focus and line time, and says what to do
    Doctor,
    /// Lists cameras and their modes, and which one would be chosen
    Cameras,
    /// Reads a password from standard input and prints what page.password is to be
    Password,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let config = match configure(&cli) {
        Ok(config) => config,
        Err(e) => {
            log(&e);
            return ExitCode::from(2);
        }
    };
    match cli.command.unwrap_or(Command::Run) {
        Command::Run => measure(&cli, &config),
        Command::Doctor => {
            let camera = opener(cli.simulate).and_then(|mut open| open(&config));
            let found = doctor::examine(&config, camera);
            print!("{}", found.text);
            ExitCode::from(u8::from(found.bad))
        }
        Command::Cameras => list(&config),
        Command::Password => hash_password(),
    }
}

/// The file, and what the command line says otherwise.
fn configure(cli: &Cli) -> Result<Config, String> {
    let text = |e: ConfigError| e.to_string();
    let mut config = match &cli.config {
        Some(path) => Config::load(path).map_err(text)?,
        None if Path::new(USUAL_CONFIG).exists() => {
            Config::load(Path::new(USUAL_CONFIG)).map_err(text)?
        }
        None => Config::defaults(),
    };
    if let Some(port) = &cli.output {
        config.output.port.clone_from(port);
    } else if cli.config.is_none() && std::io::stdout().is_terminal() {
        // Started by hand to see something.
        config.output.port = TEXT.to_owned();
    }
    if cli.simulate && cli.config.is_none() {
        // The service's own settings are not the simulation's.
        config.service.state = PathBuf::new();
    }
    if cli.camera.is_some() {
        config.camera.id.clone_from(&cli.camera);
    }
    if let Some(mode) = &cli.mode {
        config.camera.mode = mode.parse().map_err(|e| format!("--{e}"))?;
    }
    if let Some(stream) = &cli.stream {
        config.camera.stream = match stream.as_str() {
            "raw" => StreamWish::Raw,
            "luma" => StreamWish::Luma,
            other => return Err(format!("--stream {other:?}: give raw or luma")),
        };
    }
    let positive = |name: &str, us: f64| match us {
        us if us > 0.0 && us < 1e8 => Ok(us),
        us => Err(format!("--{name} {us}: give a time above 0")),
    };
    if let Some(us) = cli.line_time_us {
        config.camera.line_time_s = Some(positive("line-time-us", us)? * 1e-6);
    }
    // A camera may come later; a file that is not there is a mistake.
    if let Some(file) = &config.camera.calibration
        && let Err(e) = std::fs::metadata(file)
    {
        let file = file.display();
        return Err(format!(
            "camera.calibration {file}: {e}: make it with `rowtone calibrate -o FILE`"
        ));
    }
    if let Some(us) = cli.frame_period_us {
        config.camera.replay = Some(Replay {
            take_every: cli.take_every.unwrap_or(1).max(1),
            frame_period_ns: (positive("frame-period-us", us)? * 1000.0) as i64,
        });
    }
    Ok(config)
}

fn measure(cli: &Cli, config: &Config) -> ExitCode {
    let live = config
        .page
        .listen
        .map(|_| Arc::new(Live::new(config.page.clip_bytes)));
    let alarms = match Desk::open(&config.alarms) {
        Ok(alarms) => alarms,
        Err(e) => {
            log(&format!("alarms.rules: {e}"));
            return ExitCode::from(2);
        }
    };
    let trend = config.service.trend.as_deref().and_then(Keeper::start);
    let shared = Shared::new(config.settings)
        .with_alarms(alarms)
        .with_trend(trend);
    let shared = Arc::new(match &live {
        Some(live) => shared.with_page(Arc::clone(live)),
        None => shared,
    });
    // Measuring goes on without it.
    let server = page::serve(config, &shared).unwrap_or_else(|e| {
        let address = config
            .page
            .listen
            .map_or(String::new(), |listen| listen.to_string());
        log(&format!("the page at {address} cannot be served: {e}"));
        None
    });
    if let Some(server) = &server {
        log(&format!(
            "the page is at http://{}/",
            page::name(server.address())
        ));
    }
    let asked = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        // Asked a second time it ends at once, whatever it is doing.
        let at_once =
            signal_hook::flag::register_conditional_shutdown(signal, 1, Arc::clone(&asked));
        let caught = at_once.and_then(|_| signal_hook::flag::register(signal, asked.clone()));
        if let Err(e) = caught {
            log(&format!("signal {signal} cannot be caught: {e}"));
        }
    }
    let seen = Arc::new(AtomicBool::new(false));
    if let Err(e) = signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&seen)) {
        log(&format!("signal USR1 cannot be caught: {e}"));
    }
    // Starting libcamera takes a moment in which a signal may come.
    let mut open = match opener(cli.simulate) {
        Ok(open) => open,
        Err(e) => {
            log(&e.to_string());
            return ExitCode::FAILURE;
        }
    };
    let done = AtomicBool::new(false);
    let outcome = std::thread::scope(|scope| {
        let (shared, asked, seen, done) = (&*shared, &asked, &seen, &done);
        scope.spawn(move || watch(shared, [asked, seen], done));
        // Also where it panics: the scope would wait for ever.
        let _done = Done(done);
        run::run(config, shared, &mut open)
    });
    if let Some(live) = &live {
        live.reports.close();
    }
    drop(server);
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            log(&e.to_string());
            ExitCode::from(2)
        }
    }
}

/// What stands in the configuration for a password.
fn hash_password() -> ExitCode {
    let mut password = String::new();
    if std::io::stdin().is_terminal() {
        eprint!("Password: ");
    }
    let read = std::io::stdin().read_line(&mut password);
    let hash = read.map_err(|e| e.to_string());
    let hash = hash
        .and_then(|_| Hash::of(password.trim_end_matches(['\n', '\r'])).map_err(|e| e.to_string()));
    match hash {
        Ok(hash) => {
            println!("password = \"{hash}\"");
            ExitCode::SUCCESS
        }
        Err(e) => {
            log(&e);
            ExitCode::FAILURE
        }
    }
}

/// Set when this is dropped.
struct Done<'a>(&'a AtomicBool);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// How long an end in order may take: less than systemd waits (`TimeoutStopSec`).
const LAST_WORDS: Duration = Duration::from_secs(8);

/// The thread that waits for signals, to end and to acknowledge alarms, until `done`.
fn watch(shared: &Shared, [asked, seen]: [&AtomicBool; 2], done: &AtomicBool) {
    let mut stopping: Option<Instant> = None;
    while !done.load(Ordering::Relaxed) {
        shared.pulses.signals.beat(shared.started);
        if seen.swap(false, Ordering::Relaxed) {
            shared.acknowledge();
        }
        shared.hear_silence();
        if asked.load(Ordering::Relaxed) {
            shared.stop.store(true, Ordering::Relaxed);
        }
        if shared.is_stopping() {
            let since = *stopping.get_or_insert_with(Instant::now);
            if since.elapsed() >= LAST_WORDS {
                log("it does not end in order; it ends now");
                std::process::exit(1);
            }
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    shared.pulses.signals.rest();
}

type Opener = Box<dyn FnMut(&Config) -> Result<Box<dyn Source>, CameraError>>;

fn opener(simulate: bool) -> Result<Opener, CameraError> {
    if simulate {
        return Ok(Box::new(|config: &Config| {
            let mut scene = Scene::default();
            if let Wish::Size { width, height } = config.camera.mode {
                (scene.width, scene.height) = (width, height);
            }
            scene.exposure_s = f64::from(config.exposure_us()) * 1e-6;
            // No faster than its rows can be read.
            let readout_ns = f64::from(scene.height) * scene.line_time_s * 1e9;
            scene.frame_period_ns = scene.frame_period_ns.max(readout_ns.ceil() as i64);
            Ok(Box::new(Simulated::new(scene)) as Box<dyn Source>)
        }));
    }
    camera()
}

#[cfg(feature = "libcamera")]
fn camera() -> Result<Opener, CameraError> {
    let mut cameras = rowtone_rpi::capture::libcamera::Cameras::new()?;
    Ok(Box::new(move |config| cameras.open(config)))
}

#[cfg(not(feature = "libcamera"))]
fn camera() -> Result<Opener, CameraError> {
    Err(CameraError::Refused(
        "this program was built without libcamera (--features libcamera); --simulate works"
            .to_owned(),
    ))
}

#[cfg(feature = "libcamera")]
fn list(config: &Config) -> ExitCode {
    use rowtone_rpi::capture::libcamera::Cameras;
    use rowtone_rpi::mode::{Needs, choose};
    let modes = Cameras::new().and_then(|cameras| {
        for name in cameras.names() {
            println!("{name}");
        }
        cameras.offers(config)
    });
    let offers = match modes {
        Ok(offers) => offers,
        Err(e) => {
            log(&e.to_string());
            return ExitCode::FAILURE;
        }
    };
    match choose(&offers, config.camera.mode, &Needs::of(config)) {
        Ok(choice) => {
            print!("{}", choice.reasons);
            ExitCode::SUCCESS
        }
        Err(e) => {
            log(&e.to_string());
            ExitCode::FAILURE
        }
    }
}

#[cfg(not(feature = "libcamera"))]
fn list(_: &Config) -> ExitCode {
    log("this program was built without libcamera (--features libcamera)");
    ExitCode::FAILURE
}
