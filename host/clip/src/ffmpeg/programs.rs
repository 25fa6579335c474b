//! Starting ffprobe and ffmpeg.

use std::ffi::OsString;
use std::io;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use super::Error;
use super::showinfo::{Said, understand};

/// What ffprobe is asked for: the stream, and of each packet its time and whether it is a key frame.
const ENTRIES: &str = "stream=codec_name,width,height,pix_fmt,color_range,field_order,time_base,\
                       avg_frame_rate,r_frame_rate:stream_tags=rotate:stream_side_data=rotation:\
                       packet=pts,flags,size:format=format_name";

/// Options of ffmpeg that some versions in use lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    /// `-fps_mode` (5.1 and later) instead of `-vsync`.
    pub(super) fps_mode: bool,
    /// `-autoscale` (4.4 and later).
    pub(super) autoscale: bool,
}

impl Dialect {
    /// The present one.
    pub(super) const NEWEST: Self = Self {
        fps_mode: true,
        autoscale: true,
    };

    /// The dialect to try next where ffmpeg gave up with this reason; `None` where the reason is another.
    pub(super) fn older(self, reason: &str) -> Option<Self> {
        let unknown =
            |option: &str| reason.contains("Unrecognized option") && reason.contains(option);
        if self.fps_mode && unknown("fps_mode") {
            return Some(Self {
                fps_mode: false,
                ..self
            });
        }
        (self.autoscale && unknown("autoscale")).then_some(Self {
            autoscale: false,
            ..self
        })
    }
}

/// ffprobe's answer about a file, as JSON.
///
/// # Errors
/// [`Error::Missing`] without ffprobe, [`Error::Refused`] with its reason.
pub(super) fn ffprobe(path: &Path) -> Result<Vec<u8>, Error> {
    let output = command("ffprobe")
        .args([
            "-v",
            "level+error",
            "-protocol_whitelist",
            "file",
            "-select_streams",
            "V:0",
        ])
        .args(["-show_entries", ENTRIES, "-of", "json=c=1", "-i"])
        .arg(local(path))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .output()
        .map_err(|error| not_started("ffprobe", error))?;
    if output.status.success() {
        return Ok(output.stdout);
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let mut reasons = said.lines().filter_map(|line| match understand(line) {
        Said::Error(reason) => Some(reason),
        _ => None,
    });
    let reason = reasons
        .next()
        .unwrap_or_else(|| format!("ffprobe: {}", output.status));
    Err(Error::Refused(without_name(&reason, path)))
}

/// Starts ffmpeg, which writes the pictures that `filter` makes to standard output and what it says of
/// them to standard error.
///
/// # Errors
/// [`Error::Missing`] without ffmpeg.
pub(super) fn ffmpeg(path: &Path, filter: &str, dialect: Dialect) -> Result<Child, Error> {
    let mut ffmpeg = command("ffmpeg");
    ffmpeg
        .args([
            "-nostdin",
            "-nostats",
            "-hide_banner",
            "-loglevel",
            "level+info",
        ])
        .args([
            "-protocol_whitelist",
            "file",
            "-noautorotate",
            "-copyts",
            "-i",
        ])
        .arg(local(path))
        .args(["-map", "0:V:0", "-an", "-sn", "-dn"])
        .args([
            if dialect.fps_mode {
                "-fps_mode"
            } else {
                "-vsync"
            },
            "passthrough",
        ]);
    if dialect.autoscale {
        ffmpeg.args(["-autoscale", "0"]);
    }
    ffmpeg
        .arg("-vf")
        .arg(format!("showinfo=checksum=0,{filter}"))
        .args(["-f", "rawvideo", "-protocol_whitelist", "pipe", "pipe:1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| not_started("ffmpeg", error))
}

/// A program that is never asked anything, and that hears of a Ctrl-C only through us: it then ends when
/// what it has decoded has been measured.
fn command(program: &str) -> Command {
    let mut command = Command::new(program);
    command.stdin(Stdio::null());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
}

/// The file as ffmpeg takes it, whatever is in its name: neither an option nor another protocol.
fn local(path: &Path) -> OsString {
    let mut name = OsString::from("file:");
    name.push(path);
    name
}

fn not_started(program: &'static str, error: io::Error) -> Error {
    match error.kind() {
        io::ErrorKind::NotFound => Error::Missing(program),
        _ => Error::Program(program, error),
    }
}

/// A reason without the file's name in front, which the message has already.
pub(super) fn without_name(reason: &str, path: &Path) -> String {
    let name = format!("file:{}: ", path.display());
    reason.strip_prefix(&name).unwrap_or(reason).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_older_ffmpeg_is_asked_in_its_words() {
        let newest = Dialect::NEWEST;
        let without_mode = newest.older("Unrecognized option 'fps_mode'.").unwrap();
        assert!(!without_mode.fps_mode && without_mode.autoscale);
        let oldest = without_mode
            .older("Unrecognized option 'autoscale'.")
            .unwrap();
        assert!(!oldest.autoscale);
        assert_eq!(oldest.older("Unrecognized option 'autoscale'."), None);
        assert_eq!(newest.older("moov atom not found"), None);
    }

    #[test]
    fn a_reason_is_told_without_the_name() {
        let path = Path::new("a/clip.mp4");
        assert_eq!(
            without_name("file:a/clip.mp4: Invalid data", path),
            "Invalid data"
        );
        assert_eq!(
            without_name("moov atom not found", path),
            "moov atom not found"
        );
    }
}
