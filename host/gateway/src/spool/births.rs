//! How many births a Sparkplug node has had, over restarts: `bdSeq` counts on, so that a host can tell which death belongs
//! to which birth (Eclipse Sparkplug 3.0, 6.4.10 and 6.4.13).

use std::fs;
use std::path::{Path, PathBuf};

/// The count, kept in a file of the spool's folder.
#[derive(Debug)]
pub(crate) struct Births {
    path: PathBuf,
    /// The number of the last one.
    last: u64,
}

impl Births {
    /// Reads the count; without a file, or with one that was harmed, it begins anew.
    pub(crate) fn read(dir: &Path) -> Self {
        let path = dir.join("births");
        let text = fs::read_to_string(&path).unwrap_or_default();
        // Before 0 there is 255.
        let last = text.trim().parse().ok().filter(|&n: &u64| n < 256);
        let last = last.unwrap_or(255);
        Self { path, last }
    }

    /// The number of the next one, 0 to 255. On a disk that takes nothing it counts in memory.
    pub(crate) fn count_on(&mut self) -> u64 {
        self.last = (self.last + 1) % 256;
        // Whole or not at all; a number that is lost may come twice, which costs a host a rebirth.
        let beside = self.path.with_extension("new");
        let written = fs::write(&beside, format!("{}\n", self.last));
        let _ = written.and_then(|()| fs::rename(&beside, &self.path));
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_counts_on_over_restarts_and_wraps() {
        let dir = std::env::temp_dir().join(format!("rowtone-births-{}", std::process::id()));
        fs::create_dir_all(&dir).unwrap();
        let mut births = Births::read(&dir);
        assert_eq!((births.count_on(), births.count_on()), (0, 1));
        assert_eq!(Births::read(&dir).count_on(), 2);
        fs::write(dir.join("births"), "255\n").unwrap();
        assert_eq!(Births::read(&dir).count_on(), 0);
        fs::write(dir.join("births"), "2\u{0}5").unwrap();
        assert_eq!(Births::read(&dir).count_on(), 0);
        fs::remove_dir_all(&dir).unwrap();
        // No folder: it counts all the same.
        let mut births = Births::read(&dir);
        assert_eq!((births.count_on(), births.count_on()), (0, 1));
    }
}
