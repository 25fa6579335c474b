//! Has the operating system enter all pages of a window of a file in this thread: the lines then meet no page fault,
//! and a disk that cannot be read is an error instead of a signal.
//!
//! Linux does all of it when asked, page by page. But it enters a page's neighbours with it where they are in memory, so
//! asking for one page in sixteen costs half; what it made of that is seen in its table of pages, and where one is
//! missing, the whole window is asked for. Kernels that know none of this enter each page when it is first met.

use std::io;

use memmap2::{Advice, Mmap};

/// "Bad address": a page that cannot be read.
const EFAULT: i32 = 14;

/// Where the table of pages is looked at.
#[derive(Debug, Default)]
pub(super) struct Populate {
    #[cfg(target_arch = "x86_64")]
    table: Option<sparse::PageTable>,
}

impl Populate {
    pub(super) fn new() -> Self {
        Self {
            #[cfg(target_arch = "x86_64")]
            table: sparse::PageTable::open().ok(),
        }
    }

    /// Enters all pages of a window.
    ///
    /// # Errors
    /// When one of them cannot be read.
    pub(super) fn all(&mut self, window: &Mmap) -> io::Result<()> {
        // It only helps.
        let _ = window.advise(Advice::Sequential);
        #[cfg(target_arch = "x86_64")]
        if let Some(table) = &mut self.table {
            sparse::enter(window);
            if table.has_all(window) {
                return Ok(());
            }
        }
        match window.advise(Advice::PopulateRead) {
            Err(error) if error.raw_os_error() == Some(EFAULT) => {
                Err(io::Error::other("the disk does not deliver it"))
            }
            _ => Ok(()),
        }
    }
}

/// Where pages have one size, on x86-64.
#[cfg(target_arch = "x86_64")]
mod sparse {
    use std::fs::File;
    use std::io;
    use std::os::unix::fs::FileExt;

    use memmap2::{Advice, Mmap};

    const PAGE: usize = 4096;
    /// Pages are entered with others of the same such span of addresses (`fault_around_bytes`, where it is as usual).
    const SPAN: usize = 16 * PAGE;

    /// Asks for a page of each span; what fails is seen afterwards.
    pub(super) fn enter(window: &Mmap) {
        let start = window.as_ptr().addr();
        let mut at = 0;
        while at < window.len() {
            if window.advise_range(Advice::PopulateRead, at, 1).is_err() {
                return;
            }
            at = (start + at + 1).next_multiple_of(SPAN) - start;
        }
    }

    /// The kernel's table of this process's pages.
    #[derive(Debug)]
    pub(super) struct PageTable {
        file: File,
        entries: Vec<u8>,
    }

    impl PageTable {
        /// Bytes of a page's entry; the top bit of the last one is set where the page is there (`pagemap` in the kernel's
        /// documentation).
        const ENTRY: usize = 8;
        const PRESENT: u8 = 0x80;

        pub(super) fn open() -> io::Result<Self> {
            Ok(Self {
                file: File::open("/proc/self/pagemap")?,
                entries: Vec::new(),
            })
        }

        /// Every page of a window is entered.
        pub(super) fn has_all(&mut self, window: &Mmap) -> bool {
            let start = window.as_ptr().addr();
            let first = start / PAGE;
            let pages = (start + window.len()).div_ceil(PAGE) - first;
            self.entries.resize(pages * Self::ENTRY, 0);
            let at = (first * Self::ENTRY) as u64;
            self.file.read_exact_at(&mut self.entries, at).is_ok()
                && self
                    .entries
                    .chunks_exact(Self::ENTRY)
                    .all(|entry| entry[Self::ENTRY - 1] & Self::PRESENT != 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use memmap2::MmapOptions;
    use std::fs::File;

    const BYTES: u64 = 1 << 20;

    /// A file of that many bytes, mapped from byte 77 on, and the file.
    fn mapped(name: &str) -> (Mmap, File) {
        let path = std::env::temp_dir().join(format!("rowtone-{}-{name}", std::process::id()));
        std::fs::write(&path, vec![7; BYTES as usize]).unwrap();
        let file = File::options().read(true).write(true).open(&path);
        std::fs::remove_file(&path).unwrap();
        let file = file.unwrap();
        // SAFETY: what is mapped is not read here.
        let window = unsafe { MmapOptions::new().offset(77).map(&file).unwrap() };
        (window, file)
    }

    #[test]
    fn a_window_of_a_file_that_was_cut_short_is_an_error() {
        for mut populate in [Populate::new(), Populate::default()] {
            let (window, file) = mapped("cut");
            populate.all(&window).unwrap();
            file.set_len(BYTES / 3).unwrap();
            assert!(populate.all(&window).is_err());
        }
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn the_table_of_pages_tells_whether_all_are_entered() {
        let (window, _file) = mapped("entered");
        let mut table = sparse::PageTable::open().unwrap();
        assert!(!table.has_all(&window));
        window.advise_range(Advice::PopulateRead, 0, 1).unwrap();
        assert!(!table.has_all(&window), "only the first span is");
        window.advise(Advice::PopulateRead).unwrap();
        assert!(table.has_all(&window));
    }
}
