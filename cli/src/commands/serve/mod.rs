//! `rowtone serve`: the page of a recording, a live pipe, or a board on a serial line.

mod board;
mod recording;

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::window::WindowArgs;
use crate::alarm_args::AlarmArgs;
use crate::camera_args::CameraArgs;
use crate::failure::Failure;
use rowtone_page::control::{Access, Control, Keeper};
use rowtone_page::guard::Names;
use rowtone_page::live::Live;
use rowtone_page::server::Server;
use rowtone_page::site::Site;
use rowtone_report::zone::ZoneLimits;
use rowtone_serial::port::PortName;

/// How often it is asked whether to end.
const ASKED_EVERY: Duration = Duration::from_millis(20);

/// Options of `rowtone serve`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "INPUT may also be a serial port to a board, PORT[:BAUD].\n\nExamples:\n  \
    rowtone serve clip.mp4 --line-time-us 18.9 --exposure-us 500\n  \
    rowtone serve /dev/ttyUSB0\n  \
    rpicam-vid -t 0 --codec yuv420 -o - | ffmpeg -f rawvideo ... -f yuv4mpegpipe - \\\n      \
    | rowtone serve - --line-time-us 18.9\n\n\
    A recording is measured as fast as it can be read; its reports stay until Ctrl-C. docs/page.md explains the page."
)]
pub struct Args {
    #[command(flatten)]
    camera: CameraArgs,
    #[command(flatten)]
    window: WindowArgs,
    /// Kind of machine whose zone after ISO 20816 is shown where there is a scale, as `iso20816-3:group2:flexible`
    #[arg(long, value_name = "NAME", value_parser = ZoneLimits::of_machine)]
    machine: Option<ZoneLimits>,
    #[command(flatten)]
    alarms: AlarmArgs,
    /// Address and port of the page; 0.0.0.0:7357 shows it to the whole network
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:7357")]
    listen: SocketAddr,
    /// A further name by which this machine is called in its network
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// Where the hash of the password for changes is kept [default: nowhere; on a loopback address no password is asked]
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
}

/// Measures, and serves the page until it is asked to end.
///
/// # Errors
/// [`Failure`] of the input where nothing could be measured, of the command line, or where nobody can listen at the address.
pub fn run(args: &Args) -> Result<(), Failure> {
    args.window.check()?;
    match port(&args.camera.input) {
        Some(port) => board::run(args, &port),
        None => recording::run(args),
    }
}

/// The port that an input names, where it is one and not a recording.
fn port(input: &str) -> Option<PortName> {
    let port: PortName = input.parse().ok()?;
    let name = port.path.as_str();
    let is_device = || {
        #[cfg(unix)]
        {
            use std::os::unix::fs::FileTypeExt;
            std::fs::metadata(name).is_ok_and(|meta| meta.file_type().is_char_device())
        }
        #[cfg(not(unix))]
        false
    };
    // A port that is not plugged in yet is one all the same.
    let is_named_like_one = !Path::new(name).exists()
        && (name.starts_with("/dev/tty") || name.starts_with("/dev/serial") || is_com(name));
    (input != "-" && (is_device() || is_named_like_one)).then_some(port)
}

fn is_com(name: &str) -> bool {
    let number = name.strip_prefix("COM").unwrap_or_default();
    !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
}

/// Starts the page and says where it is.
fn open(args: &Args, live: &Arc<Live>, control: Arc<dyn Control>) -> Result<Server, Failure> {
    let refuse = |why: String| Failure::input(why);
    // Whoever sits at this machine may change what it measures for him.
    let access = if args.listen.ip().is_loopback() && args.password_file.is_none() {
        Access::Open
    } else {
        let file = args.password_file.clone();
        let place = file
            .as_deref()
            .map_or(String::new(), |path| format!("{}: ", path.display()));
        Access::Password(Keeper::open(file).map_err(|e| refuse(format!("{place}{e}")))?)
    };
    let names = Names::of_this_machine(args.name.iter().cloned());
    let site = Arc::new(Site::new(Arc::clone(live), control, access, names));
    let server = Server::start(args.listen, site).map_err(|e| {
        refuse(format!(
            "--listen {}: {e}: give another address or port",
            args.listen
        ))
    })?;
    eprintln!(
        "rowtone: http://{}/ shows {}; Ctrl-C ends it",
        server.address(),
        args.camera.options().name()
    );
    Ok(server)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_told_from_a_recording() {
        for input in ["/dev/ttyUSB7", "/dev/ttyUSB7:921600", "COM3", "/dev/null"] {
            assert!(port(input).is_some(), "{input}");
        }
        for input in ["-", "clip.mp4", "/nowhere/clip.y4m", "COMEDY", "Cargo.toml"] {
            assert!(port(input).is_none(), "{input}");
        }
    }
}
