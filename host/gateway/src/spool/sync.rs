//! What was written, to the disk itself: on a thread, because a disk may take seconds.

use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};

/// What one pass is about: the files, and what may be written down once they are on the disk.
struct Pass<T> {
    files: BTreeSet<PathBuf>,
    then: T,
}

/// The thread.
#[derive(Debug)]
pub(super) struct Syncer<T> {
    passes: SyncSender<Pass<T>>,
    done: Receiver<(T, io::Result<()>)>,
    busy: bool,
}

impl<T: Send + 'static> Syncer<T> {
    /// Starts it; `dir` is synchronised after the files, so that their names are there too.
    pub(super) fn start(dir: &Path) -> io::Result<Self> {
        let dir = dir.to_owned();
        let (passes, to_do) = sync_channel::<Pass<T>>(1);
        let (done_to, done) = sync_channel(1);
        let work = move || {
            for Pass { files, then } in to_do {
                let mut outcome = Ok(());
                for path in files {
                    outcome = outcome.and(sync(&path));
                }
                outcome = outcome.and(sync_dir(&dir));
                if done_to.send((then, outcome)).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new()
            .name("spool-sync".to_owned())
            .stack_size(64 * 1024)
            .spawn(work)?;
        Ok(Self {
            passes,
            done,
            busy: false,
        })
    }

    /// Starts a pass, unless one is under way.
    pub(super) fn begin(&mut self, files: &mut BTreeSet<PathBuf>, then: T) {
        if self.busy {
            return;
        }
        let files = std::mem::take(files);
        self.busy = self.passes.try_send(Pass { files, then }).is_ok();
    }

    /// Whether a pass is under way.
    pub(super) fn is_busy(&self) -> bool {
        self.busy
    }

    /// The pass that has ended, if one has.
    pub(super) fn ended(&mut self) -> Option<(T, io::Result<()>)> {
        match self.done.try_recv() {
            Ok(ended) => {
                self.busy = false;
                Some(ended)
            }
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => None,
        }
    }

    /// Waits for the pass that is under way.
    pub(super) fn wait(&mut self) -> Option<(T, io::Result<()>)> {
        let ended = self.busy.then(|| self.done.recv().ok()).flatten();
        self.busy = false;
        ended
    }
}

fn sync(path: &Path) -> io::Result<()> {
    match File::open(path).and_then(|file| file.sync_data()) {
        // It is acknowledged and removed already.
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        done => done,
    }
}

/// Only Unix has directories that can be opened.
fn sync_dir(dir: &Path) -> io::Result<()> {
    if cfg!(unix) {
        File::open(dir)?.sync_all()?;
    }
    Ok(())
}
