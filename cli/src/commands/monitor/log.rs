//! Reports into a file, one line each, so that a process that is killed loses at most the line
//! being written.
//!
//! Every line is one write at the file's end. Where the file's last line was cut short, it is
//! taken away before the first new one.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use rowtone::report::{MAX_PEAKS, Report};

use rowtone_failure::Failure;
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
    path: PathBuf,
    file: File,
    format: Format,
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
        let failed = |error| Failure::writing(&path.display().to_string(), &error);
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path)
            .map_err(failed)?;
        let whole = whole_lines(&mut file).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        if whole < length {
            file.set_len(whole).map_err(failed)?;
            eprintln!(
                "rowtone: {}: its last line was cut short and is left out",
                path.display()
            );
        }
        let mut log = Self {
            path: path.to_owned(),
            file,
            format,
        };
        if whole == 0 && format == Format::Csv {
            log.write(header())?;
        }
        Ok(log)
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
        self.write(line)
    }

    fn write(&mut self, mut line: String) -> Result<(), Failure> {
        line.push('\n');
        self.file
            .write_all(line.as_bytes())
            .map_err(|error| Failure::writing(&self.path.display().to_string(), &error))
    }
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
}
