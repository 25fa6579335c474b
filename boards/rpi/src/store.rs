//! Settings kept in a file, by the core's own two-slot store: no cut of the power harms both slots.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rowtone::link::settings::store::SLOT_LEN;

/// A file that behaves as flash does: two slots of [`SLOT_LEN`].
#[derive(Debug)]
pub struct FileFlash {
    file: File,
}

impl FileFlash {
    /// Opens the file, or makes it.
    ///
    /// # Errors
    /// The file cannot be made or written.
    pub fn open(path: &Path) -> io::Result<Self> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let mut options = OpenOptions::new();
        let file = options
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        let mut flash = Self { file };
        let has = flash.file.metadata()?.len() as usize;
        if has < flash.capacity() {
            flash.fill(has, flash.capacity())?;
        }
        Ok(flash)
    }

    /// Opens a file of which nothing can be written, for what was saved in it before.
    ///
    /// # Errors
    /// It is not there or shorter than it should be.
    pub fn open_read_only(path: &Path) -> io::Result<Self> {
        let flash = Self {
            file: File::open(path)?,
        };
        let meta = flash.file.metadata()?;
        if !meta.is_file() || (meta.len() as usize) < flash.capacity() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(flash)
    }

    fn fill(&mut self, from: usize, to: usize) -> io::Result<()> {
        self.file
            .write_all_at(&vec![0xff; to.saturating_sub(from)], from as u64)?;
        self.file.sync_data()
    }
}

/// The file's own error.
#[derive(Debug)]
pub struct FileError(io::Error);

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl NorFlashError for FileError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for FileFlash {
    type Error = FileError;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FileError> {
        self.file
            .read_exact_at(bytes, offset.into())
            .map_err(FileError)
    }

    fn capacity(&self) -> usize {
        2 * SLOT_LEN
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SLOT_LEN;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FileError> {
        self.fill(from as usize, to as usize).map_err(FileError)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        let written = self.file.write_all_at(bytes, offset.into());
        written
            .and_then(|()| self.file.sync_data())
            .map_err(FileError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::link::settings::Settings;
    use rowtone::link::settings::store::{Keep, Store};
    use rowtone::wire::SettingsOrigin;

    #[test]
    fn what_is_saved_is_there_after_the_next_start() {
        let path = std::env::temp_dir().join(format!("rowtone-store-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let open = || Store::new(FileFlash::open(&path).unwrap(), 0).unwrap();
        let mut store = open();
        let started = store.start();
        assert_eq!(
            (started.session, started.origin),
            (1, SettingsOrigin::Defaults)
        );
        let changed = Settings {
            window_s: 0.5,
            ..Settings::default()
        };
        store.save(started.session, &changed).unwrap();
        let started = open().start();
        assert_eq!((started.session, started.settings), (2, Some(changed)));
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn what_was_saved_is_read_from_a_disk_that_takes_nothing() {
        let path = std::env::temp_dir().join(format!("rowtone-store-ro-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        assert!(FileFlash::open_read_only(&path).is_err());
        assert!(FileFlash::open_read_only(&std::env::temp_dir()).is_err());
        let mut store = Store::new(FileFlash::open(&path).unwrap(), 0).unwrap();
        let session = store.start().session;
        let changed = Settings {
            window_s: 0.5,
            ..Settings::default()
        };
        store.save(session, &changed).unwrap();
        let flash = FileFlash::open_read_only(&path).unwrap();
        let mut store = Store::new(flash, 0).unwrap();
        let started = store.start();
        assert_eq!(started.settings, Some(changed));
        assert!(store.save(started.session, &Settings::default()).is_err());
        std::fs::remove_file(&path).unwrap();
    }
}
