//! Reports into a file, one line each, so that a process that is killed loses at most the line
//! being written.
//!
//! Every line is one write at the file's end. Where the file's last line was cut short, it is
//! taken away before the first new one. A file that is not of this program's making is never changed,
//! and one with other columns is left as it is: the log goes on beside it.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use rowtone::report::{MAX_PEAKS, Report};

use crate::failure::Failure;
use rowtone_report::{band_velocity, json};

/// The format, by the file's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Csv,
    JsonLines,
}

/// A log file, open at its end.
#[derive(Debug)]
pub(super) struct Log {
    /// As it was asked for.
    asked: PathBuf,
    /// As it is: with a number where that one has other columns.
    path: PathBuf,
    file: File,
    format: Format,
}

/// What stands in a file already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    /// Nothing, or a first line that was cut short.
    Nothing,
    /// Lines such as are written now.
    Ours,
    /// Lines of another version, with other columns.
    OtherColumns,
    /// Something else.
    Foreign,
}

impl Log {
    pub(super) fn open(path: &Path) -> Result<Self, Failure> {
        let format = match path.extension().and_then(|ending| ending.to_str()) {
            Some("csv") => Format::Csv,
            Some("jsonl") => Format::JsonLines,
            _ => {
                let path = path.display();
                return Err(Failure::usage(format!(
                    "--log {path}: end the name in .csv or .jsonl"
                )));
            }
        };
        Self::open_as(path, format)
    }

    fn open_as(asked: &Path, format: Format) -> Result<Self, Failure> {
        for number in 1..1000 {
            let path = numbered(asked, number);
            let failed = |error| Failure::writing(&path.display().to_string(), &error);
            let mut file = OpenOptions::new()
                .read(true)
                .append(true)
                .create(true)
                .open(&path)
                .map_err(failed)?;
            match content(&mut file, format).map_err(failed)? {
                Content::Foreign if number == 1 => {
                    return Err(Failure::input(format!(
                        "--log {}: not a log of this program; it is left as it is, name another",
                        path.display()
                    )));
                }
                Content::Foreign | Content::OtherColumns => continue,
                Content::Nothing | Content::Ours => {}
            }
            if number > 1 {
                let (asked, path) = (asked.display(), path.display());
                eprintln!("rowtone: {asked} has other columns; the log goes on in {path}");
            }
            let mut log = Self {
                asked: asked.to_owned(),
                path,
                file,
                format,
            };
            log.begin()?;
            return Ok(log);
        }
        let asked = asked.display();
        Err(Failure::input(format!(
            "--log {asked}: a thousand logs of other columns"
        )))
    }

    /// Takes away a last line that was cut short, and writes the first one where there is none.
    fn begin(&mut self) -> Result<(), Failure> {
        let path = self.path.display().to_string();
        let failed = |error| Failure::writing(&path, &error);
        let meta = self.file.metadata().map_err(failed)?;
        let whole = match meta.is_file() {
            true => whole_lines(&mut self.file).map_err(failed)?,
            // A device or a pipe has nothing to be mended.
            false => meta.len(),
        };
        if whole < meta.len() {
            self.file.set_len(whole).map_err(failed)?;
            eprintln!("rowtone: {path}: its last line was cut short and is left out");
        }
        if whole == 0 && self.format == Format::Csv {
            self.write(header())?;
        }
        Ok(())
    }

    /// Follows a log that was rotated: renamed or removed, and a new one is begun; cut to nothing, and it
    /// starts again with its header.
    fn follow(&mut self) -> Result<(), Failure> {
        let here = self.file.metadata().ok();
        let there = std::fs::metadata(&self.path).ok();
        match (here, there) {
            (Some(here), Some(there)) if is_same(&here, &there) => {
                if here.is_file() && here.len() == 0 {
                    self.begin()?;
                }
            }
            _ => *self = Self::open_as(&self.asked, self.format)?,
        }
        Ok(())
    }

    pub(super) fn append(&mut self, session: u32, report: &Report) -> Result<(), Failure> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let received_s = now.map_or(0.0, |since| since.as_secs_f64());
        let line = match self.format {
            Format::Csv => csv(received_s, session, report),
            Format::JsonLines => {
                // The same object as on standard output, with when and in which session it came.
                let object = json::report(report);
                let rest = object.strip_prefix('{').unwrap_or(&object);
                format!(r#"{{"received_unix_s":{received_s:.3},"session":{session},{rest}"#)
            }
        };
        self.follow()?;
        self.write(line)
    }

    fn write(&mut self, mut line: String) -> Result<(), Failure> {
        line.push('\n');
        let before = self.file.metadata().map(|meta| meta.len());
        self.file.write_all(line.as_bytes()).map_err(|error| {
            // A part of it may have found room.
            if let Ok(before) = before {
                let _ = self.file.set_len(before);
            }
            Failure::writing(&self.path.display().to_string(), &error)
        })
    }
}

/// `log.csv`, `log-2.csv`, `log-3.csv` …
fn numbered(path: &Path, number: u32) -> PathBuf {
    let (Some(stem), Some(ending), true) = (path.file_stem(), path.extension(), number > 1) else {
        return path.to_owned();
    };
    let (stem, ending) = (stem.to_string_lossy(), ending.to_string_lossy());
    path.with_file_name(format!("{stem}-{number}.{ending}"))
}

/// What a file holds, by its first line.
fn content(file: &mut File, format: Format) -> std::io::Result<Content> {
    let meta = file.metadata()?;
    if !meta.is_file() || meta.len() == 0 {
        return Ok(Content::Nothing);
    }
    let header = header();
    let mut start = vec![];
    file.seek(SeekFrom::Start(0))?;
    (&mut *file)
        .take(header.len() as u64 + 1)
        .read_to_end(&mut start)?;
    let (line, is_whole) = match start.iter().position(|&byte| byte == b'\n') {
        Some(end) => (&start[..end], true),
        None => (start.as_slice(), false),
    };
    // What every version begins its lines with.
    let sign: &[u8] = match format {
        Format::Csv => b"received_unix_s,session,seq,",
        Format::JsonLines => br#"{"received_unix_s":"#,
    };
    let is_ours = match format {
        Format::Csv => line == header.as_bytes(),
        Format::JsonLines => line.starts_with(sign),
    };
    let was_cut = match format {
        Format::Csv => header.as_bytes().starts_with(line),
        Format::JsonLines => sign.starts_with(line) || line.starts_with(sign),
    };
    Ok(match () {
        () if is_ours && is_whole => Content::Ours,
        // One line of JSON is longer than what was read of it.
        () if is_ours && meta.len() > start.len() as u64 => Content::Ours,
        () if !is_whole && was_cut && meta.len() <= start.len() as u64 => Content::Nothing,
        () if line.starts_with(sign) => Content::OtherColumns,
        () => Content::Foreign,
    })
}

/// Whether both are one and the same file.
#[cfg(unix)]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_same(_: &Metadata, _: &Metadata) -> bool {
    true
}

/// Length of the file up to its last line end.
fn whole_lines(file: &mut File) -> std::io::Result<u64> {
    let mut end = file.metadata()?.len();
    let mut block = [0; 4096];
    while end > 0 {
        let start = end.saturating_sub(block.len() as u64);
        let block = &mut block[..(end - start) as usize];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(block)?;
        if let Some(at) = block.iter().rposition(|&byte| byte == b'\n') {
            return Ok(start + at as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

fn header() -> String {
    let mut line = String::from(
        "received_unix_s,session,seq,t_s,window_s,fps,lines,lost_frames,noise_px,warnings,velocity_mm_s_rms",
    );
    for number in 1..=MAX_PEAKS {
        line += &format!(",hz_{number},amplitude_px_{number},snr_db_{number}");
    }
    line
}

fn csv(received_s: f64, session: u32, report: &Report) -> String {
    let velocity = band_velocity(report).map(|v| format!("{v:.4}"));
    let mut line = format!(
        "{received_s:.3},{session},{},{:.3},{},{},{},{},{},{:04X},{}",
        report.seq,
        report.time_ms as f64 / 1000.0,
        report.window_s,
        report.fps,
        report.lines,
        report.lost_frames,
        report.noise_px,
        report.warnings.bits(),
        velocity.unwrap_or_default(),
    );
    for number in 0..MAX_PEAKS {
        line += &match report.peaks.get(number) {
            Some(peak) => format!(",{},{},{}", peak.hz, peak.amplitude_px, peak.snr_db),
            None => ",,,".to_owned(),
        };
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone_report::example;

    #[test]
    fn a_line_cut_short_costs_nothing_else() {
        for ending in ["csv", "jsonl"] {
            let path =
                std::env::temp_dir().join(format!("rowtone-log-{}.{ending}", std::process::id()));
            let _ = std::fs::remove_file(&path);
            let mut log = Log::open(&path).unwrap();
            log.append(1, &example(Some(10.0))).unwrap();
            log.append(1, &example(None)).unwrap();
            let whole = std::fs::read_to_string(&path).unwrap();
            // Killed in the middle of a line.
            std::fs::write(&path, &whole[..whole.len() - 30]).unwrap();
            Log::open(&path).unwrap().append(1, &example(None)).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            std::fs::remove_file(&path).unwrap();
            let lines: Vec<&str> = text.lines().collect();
            let first: Vec<&str> = whole.lines().collect();
            assert_eq!(lines.len(), first.len());
            assert_eq!(lines[..lines.len() - 1], first[..first.len() - 1]);
            let commas = |line: &str| line.matches(',').count();
            assert!(
                lines
                    .iter()
                    .all(|line| ending == "jsonl" || commas(line) == commas(lines[0]))
            );
            if ending == "jsonl" {
                let object: serde_json::Value = serde_json::from_str(lines[1]).unwrap();
                assert_eq!(object["session"], 1);
            }
        }
    }

    #[test]
    fn other_endings_are_refused() {
        assert_eq!(Log::open(Path::new("log.txt")).unwrap_err().status(), 2);
    }

    /// A directory of this test's own.
    fn dir(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("rowtone-log-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        dir
    }

    #[test]
    fn a_file_of_somebody_else_is_never_changed() {
        let dir = dir("foreign");
        for (name, text) in [
            (
                "a.csv",
                "date,place,reading\n2026-01-01,hall,17\n2026-01-02,hall,18",
            ),
            ("b.csv", "no line feed at all"),
            ("c.csv", "\n"),
            ("d.jsonl", "{\"reading\":17}\n{\"reading\":"),
            ("e.jsonl", "no line feed"),
        ] {
            let path = dir.join(name);
            std::fs::write(&path, text).unwrap();
            assert_eq!(Log::open(&path).unwrap_err().status(), 1, "{name}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        // What a kill leaves of the very first line is nobody's.
        let path = dir.join("f.csv");
        std::fs::write(&path, &header()[..20]).unwrap();
        Log::open(&path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), header() + "\n");
        std::fs::remove_dir_all(dir).unwrap();
    }

    #[test]
    fn other_columns_start_a_new_file() {
        let dir = dir("columns");
        let old = "received_unix_s,session,seq,t_s\n1,1,0,0.5\n1,1,1";
        std::fs::write(dir.join("log.csv"), old).unwrap();
        std::fs::write(dir.join("log-2.csv"), "somebody else's").unwrap();
        for _ in 0..2 {
            let mut log = Log::open(&dir.join("log.csv")).unwrap();
            log.append(1, &example(None)).unwrap();
        }
        let read = |name| std::fs::read_to_string(dir.join(name)).unwrap();
        assert_eq!(read("log.csv"), old);
        assert_eq!(read("log-2.csv"), "somebody else's");
        let new = read("log-3.csv");
        assert!(
            new.starts_with(&header()) && new.lines().count() == 3,
            "{new}"
        );
        std::fs::remove_dir_all(dir).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn rotation_is_followed() {
        let dir = dir("rotated");
        let path = dir.join("log.csv");
        let mut log = Log::open(&path).unwrap();
        let lines = |name: &str| {
            let text = std::fs::read_to_string(dir.join(name)).unwrap();
            assert!(text.starts_with(&header()), "{text}");
            text.lines().count()
        };
        log.append(1, &example(None)).unwrap();
        std::fs::rename(&path, dir.join("log.csv.1")).unwrap();
        log.append(1, &example(None)).unwrap();
        log.append(1, &example(None)).unwrap();
        assert_eq!((lines("log.csv.1"), lines("log.csv")), (2, 3));
        // Cut to nothing while it is open, as `copytruncate` does.
        std::fs::write(&path, "").unwrap();
        log.append(1, &example(None)).unwrap();
        assert_eq!(lines("log.csv"), 2);
        std::fs::remove_file(&path).unwrap();
        log.append(1, &example(None)).unwrap();
        assert_eq!(lines("log.csv"), 2);
        std::fs::remove_dir_all(dir).unwrap();
    }
}
