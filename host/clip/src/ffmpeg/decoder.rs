//! A running ffmpeg: its pictures, what it says of them, and its end.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use super::Error;
use super::programs::{self, Dialect};
use super::showinfo::{Said, understand};

/// Longest line of standard error that is kept, bytes; the rest of a longer one is passed over.
const LONGEST_LINE: u64 = 1 << 16;

/// ffmpeg at work. It ends when this is dropped.
#[derive(Debug)]
pub(super) struct Decoder {
    child: Child,
    pictures: ChildStdout,
    said: Receiver<Said>,
}

impl Decoder {
    /// Starts ffmpeg on a file.
    ///
    /// # Errors
    /// [`Error::Missing`] without ffmpeg, [`Error::Program`] when it cannot be started.
    pub(super) fn start(path: &Path, filter: &str, dialect: Dialect) -> Result<Self, Error> {
        let mut child = programs::ffmpeg(path, filter, dialect)?;
        let (Some(pictures), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            unreachable!("both are piped");
        };
        let (to, said) = channel();
        let listening = thread::Builder::new().name("ffmpeg's messages".to_owned());
        if let Err(error) = listening.spawn(move || listen(errors, |said| to.send(said).is_ok())) {
            let _ = child.kill();
            let _ = child.wait();
            return Err(Error::Program("ffmpeg", error));
        }
        larger_pipe(&pictures);
        Ok(Self {
            child,
            pictures,
            said,
        })
    }

    /// What it says next; waits for it. `None` when it has said everything.
    pub(super) fn hear(&self) -> Option<Said> {
        self.said.recv().ok()
    }

    /// Fills `buffer` with what it writes, as far as that goes: fewer bytes only at its end.
    pub(super) fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let mut have = 0;
        while have < buffer.len() {
            match self.pictures.read(&mut buffer[have..]) {
                Ok(0) => break,
                Ok(count) => have += count,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(have)
    }

    /// Whether it ended by itself, and well. Waits for its end, so only to be asked when it has said
    /// everything.
    pub(super) fn ended_well(&mut self) -> bool {
        self.child.wait().is_ok_and(|status| status.success())
    }
}

impl Drop for Decoder {
    fn drop(&mut self) {
        // Either fails only where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Hands on what ffmpeg says until it has said everything, or nobody listens.
fn listen(errors: ChildStderr, mut to: impl FnMut(Said) -> bool) {
    let mut errors = BufReader::new(errors);
    let mut line = Vec::new();
    loop {
        line.clear();
        match errors
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut line)
        {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        let said = understand(String::from_utf8_lossy(&line).trim_end());
        // ffmpeg would wait for ever with nobody to read what it says: this goes on to the end.
        if said != Said::Nothing {
            let _ = to(said);
        }
    }
}

/// Lets the pipe hold as much as an ordinary user's may, so that both ends sleep and wake less often.
fn larger_pipe(pictures: &ChildStdout) {
    #[cfg(target_os = "linux")]
    {
        use std::os::fd::AsRawFd;
        const BYTES: i32 = 1 << 20;
        // It only helps.
        let _ = nix::fcntl::fcntl(
            pictures.as_raw_fd(),
            nix::fcntl::FcntlArg::F_SETPIPE_SZ(BYTES),
        );
    }
    #[cfg(not(target_os = "linux"))]
    let _ = pictures;
}
