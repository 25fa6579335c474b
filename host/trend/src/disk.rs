//! What a trend asks of a disk.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Files that can be appended to.
pub trait Disk {
    /// Names of all files.
    ///
    /// # Errors
    /// As the disk's.
    fn list(&self) -> io::Result<Vec<String>>;
    /// All of a file.
    ///
    /// # Errors
    /// As the disk's.
    fn read(&self, name: &str) -> io::Result<Vec<u8>>;
    /// Appends to a file, which is made where it is not there.
    ///
    /// # Errors
    /// As the disk's; some of the bytes may be there then.
    fn append(&mut self, name: &str, bytes: &[u8]) -> io::Result<()>;
    /// Does not come back before what was appended to a file outlives a power cut.
    ///
    /// # Errors
    /// As the disk's.
    fn sync(&mut self, name: &str) -> io::Result<()>;
    /// Takes a file away.
    ///
    /// # Errors
    /// As the disk's.
    fn remove(&mut self, name: &str) -> io::Result<()>;
}

/// A folder.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// A folder, which is made where it is not there.
    pub(crate) fn open(dir: &Path) -> io::Result<Self> {
        fs::create_dir_all(dir)?;
        Ok(Self::existing(dir))
    }

    pub(crate) fn existing(dir: &Path) -> Self {
        Self(dir.to_owned())
    }
}

impl Disk for Folder {
    fn list(&self) -> io::Result<Vec<String>> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.0)? {
            files.extend(entry?.file_name().into_string());
        }
        Ok(files)
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        File::open(self.0.join(name))?.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let path = self.0.join(name);
        File::options()
            .create(true)
            .append(true)
            .open(path)?
            .write_all(bytes)
    }

    fn sync(&mut self, name: &str) -> io::Result<()> {
        File::open(self.0.join(name))?.sync_data()?;
        // And the file's name.
        File::open(&self.0)?.sync_all()
    }

    fn remove(&mut self, name: &str) -> io::Result<()> {
        fs::remove_file(self.0.join(name))
    }
}
