//! Files that appear whole or not at all.
//!
//! A [`WholeFile`] is written beside its place, under a name that begins with a dot, and takes its place
//! by a rename when it is complete. Whatever stops the writing before (an error, a full disk, a signal
//! that the program survives to its end), what stood at the place stays as it was, and nothing is left
//! beside it. A power cut may still leave an empty file where the file system does not order renames.
//!
//! What is no ordinary file (`/dev/null`, a pipe, `/dev/stdout`) is written as it comes.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Bytes that are collected before they are written.
const BUFFER_BYTES: usize = 1 << 18;

/// A file in the making.
///
/// ```
/// use std::io::Write;
/// use rowtone_files::WholeFile;
/// # let folder = std::env::temp_dir().join(format!("rowtone-doc-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// let path = folder.join("motion.csv");
/// let mut file = WholeFile::create(&path)?;
/// writeln!(file, "t_s,row,d_px")?;
/// assert!(!path.exists());
/// file.finish()?;
/// assert_eq!(std::fs::read_to_string(&path)?, "t_s,row,d_px\n");
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct WholeFile {
    /// `None` once it is finished.
    to: Option<BufWriter<File>>,
    /// Where it is while it is written, and its place; `None` where it is written in place.
    paths: Option<(PathBuf, PathBuf)>,
}

impl WholeFile {
    /// Begins a file that is to stand at `path`, in place of what stands there.
    ///
    /// # Errors
    /// What the operating system says where no file can be written there: no such folder, no permission.
    pub fn create(path: &Path) -> io::Result<Self> {
        let place = match fs::metadata(path) {
            Ok(meta) if meta.is_dir() => return Err(io::Error::from(io::ErrorKind::IsADirectory)),
            Ok(meta) if meta.is_file() => {
                // Whether it may be changed, which a rename would not ask.
                OpenOptions::new().write(true).open(path)?;
                // A link stays, and what it leads to is replaced.
                fs::canonicalize(path)?
            }
            Ok(_) => return Ok(Self::in_place(OpenOptions::new().write(true).open(path)?)),
            // A link to nowhere.
            Err(_) if fs::symlink_metadata(path).is_ok() => {
                return Ok(Self::in_place(File::create(path)?));
            }
            Err(_) => path.to_owned(),
        };
        let (beside, file) = new_beside(&place)?;
        let whole = Self {
            to: Some(BufWriter::with_capacity(BUFFER_BYTES, file)),
            paths: Some((beside.clone(), place.clone())),
        };
        if let Ok(meta) = fs::metadata(&place) {
            fs::set_permissions(&beside, meta.permissions())?;
        }
        Ok(whole)
    }

    /// Whether a file can be written at `path`, without a change to what stands there.
    ///
    /// # Errors
    /// As [`WholeFile::create`].
    pub fn check(path: &Path) -> io::Result<()> {
        match fs::metadata(path) {
            // Opening a pipe may wait for its reader.
            Ok(meta) if !meta.is_file() && !meta.is_dir() => Ok(()),
            _ => Self::create(path).map(drop),
        }
    }

    /// Puts it in its place.
    ///
    /// # Errors
    /// What the operating system says; the place then is as it was.
    pub fn finish(mut self) -> io::Result<()> {
        if let Some(mut to) = self.to.take() {
            to.flush()?;
        }
        match &self.paths {
            Some((beside, place)) => fs::rename(beside, place)?,
            None => return Ok(()),
        }
        self.paths = None;
        Ok(())
    }

    fn in_place(file: File) -> Self {
        Self {
            to: Some(BufWriter::with_capacity(BUFFER_BYTES, file)),
            paths: None,
        }
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            Some(to) => to.write(bytes),
            None => Err(io::Error::from(io::ErrorKind::BrokenPipe)),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.as_mut().map_or(Ok(()), BufWriter::flush)
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some((beside, _)) = &self.paths {
            // What is still collected is not wanted any more.
            if let Some(to) = self.to.take() {
                let _ = to.into_parts();
            }
            let _ = fs::remove_file(beside);
        }
    }
}

/// Writes a file at once.
///
/// # Errors
/// As [`WholeFile::create`] and [`WholeFile::finish`].
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(bytes.as_ref())?;
    file.finish()
}

/// A new file in the folder of `place`.
fn new_beside(place: &Path) -> io::Result<(PathBuf, File)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    if place.file_name().is_none() {
        return Err(io::Error::from(io::ErrorKind::InvalidInput));
    }
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let beside = place.with_file_name(format!(".rowtone-{}-{count}.part", std::process::id()));
        match File::create_new(&beside) {
            Ok(file) => return Ok((beside, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An empty folder of one test.
    fn folder(name: &str) -> PathBuf {
        let folder =
            std::env::temp_dir().join(format!("rowtone-whole-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn what_is_not_finished_leaves_nothing() {
        let folder = folder("unfinished");
        let path = folder.join("o.csv");
        fs::write(&path, "old").unwrap();
        let mut file = WholeFile::create(&path).unwrap();
        file.write_all(&[7; 1 << 20]).unwrap();
        assert_eq!(names(&folder).len(), 2);
        drop(file);
        assert_eq!(names(&folder), ["o.csv"]);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        write(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(&folder), ["o.csv"]);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn where_nothing_can_be_written_it_is_said_at_once() {
        let folder = folder("nowhere");
        for wrong in [
            folder.join("no/such/file"),
            folder.clone(),
            PathBuf::from("/"),
            PathBuf::new(),
        ] {
            assert!(WholeFile::check(&wrong).is_err(), "{}", wrong.display());
            assert!(WholeFile::create(&wrong).is_err(), "{}", wrong.display());
        }
        WholeFile::check(&folder.join("new")).unwrap();
        assert!(names(&folder).is_empty());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_devices_and_permissions_stay_what_they_are() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = folder("links");
        let (target, link) = (folder.join("target"), folder.join("link"));
        fs::write(&target, "old").unwrap();
        fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
        symlink("target", &link).unwrap();
        write(&link, "new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert_eq!(
            fs::metadata(&target).unwrap().permissions().mode() & 0o777,
            0o640
        );
        let nowhere = folder.join("nowhere");
        symlink("later", &nowhere).unwrap();
        write(&nowhere, "there").unwrap();
        assert_eq!(fs::read_to_string(folder.join("later")).unwrap(), "there");
        let null = Path::new("/dev/null");
        WholeFile::check(null).unwrap();
        write(null, "gone").unwrap();
        assert!(!fs::metadata(null).unwrap().is_file());
        fs::remove_dir_all(&folder).unwrap();
    }
}
