//! Has the operating system enter all pages of a window of a file in this thread: the lines then meet no page fault,
//! and a disk that cannot be read is an error instead of a signal.
//!
//! Linux does all of it when asked, page by page. But it enters a page's neighbours with it where they are in memory, so
//! asking for one page in sixteen costs half; what it made of that is seen in its table of pages (`pagemap` in the kernel's
//! documentation), and those that are missing are asked for. Kernels that know none of this enter each page when it is first met.

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
            if let Some(missing) = table.missing(window) {
                return missing
                    .into_iter()
                    .try_for_each(|some| understood(sparse::enter_all(window, some)));
            }
        }
        understood(window.advise(Advice::PopulateRead))
    }
}

/// Whether pages could be read; that the kernel does not know the question is no error.
fn understood(answer: io::Result<()>) -> io::Result<()> {
    match answer {
        Err(error) if error.raw_os_error() == Some(EFAULT) => {
            Err(io::Error::other("the disk does not deliver it"))
        }
        _ => Ok(()),
    }
}

/// The question that the table of pages is asked.
#[cfg(target_arch = "x86_64")]
#[allow(unreachable_pub, reason = "the macro makes it public")]
mod question {
    /// What is asked and answered: `struct pm_scan_arg` of the kernel's `linux/fs.h`.
    #[derive(Debug, Default)]
    #[repr(C)]
    pub struct Scan {
        pub(super) size: u64,
        pub(super) flags: u64,
        pub(super) start: u64,
        pub(super) end: u64,
        pub(super) walk_end: u64,
        pub(super) regions: u64,
        pub(super) regions_len: u64,
        pub(super) max_pages: u64,
        pub(super) inverted: u64,
        pub(super) all_of: u64,
        pub(super) any_of: u64,
        pub(super) told: u64,
    }

    nix::ioctl_readwrite! {
        /// Looks for pages of some kinds; how many regions of them were found.
        scan, b'f', 16, Scan
    }
}

/// Where pages have one size, on x86-64.
#[cfg(target_arch = "x86_64")]
mod sparse {
    use std::fs::File;
    use std::io;
    use std::ops::Range;
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::FileExt;

    use memmap2::{Advice, Mmap};

    use super::question::{Scan, scan};

    const PAGE: usize = 4096;
    /// Pages are entered with others of the same such span of addresses (`fault_around_bytes`, where it is as usual).
    const SPAN: usize = 16 * PAGE;
    /// So many missing ones are no longer asked for one by one.
    const FEW: usize = 64;

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

    /// Asks for all pages of these addresses, as far as they are of the window.
    pub(super) fn enter_all(window: &Mmap, addresses: Range<usize>) -> io::Result<()> {
        let start = window.as_ptr().addr();
        let from = addresses.start.saturating_sub(start);
        let to = addresses.end.saturating_sub(start).min(window.len());
        window.advise_range(Advice::PopulateRead, from, to.saturating_sub(from))
    }

    /// The kernel's table of this process's pages.
    #[derive(Debug)]
    pub(super) struct PageTable {
        file: File,
        /// The kernel looks through it when asked (Linux 6.7), in an eighth of the time that reading it takes.
        scans: bool,
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
                scans: true,
                entries: Vec::new(),
            })
        }

        /// As an older kernel has it.
        #[cfg(test)]
        pub(super) fn without_scans(self) -> Self {
            Self {
                scans: false,
                ..self
            }
        }

        /// The addresses of a window's pages that are not entered; `None` where they are many, or not known.
        pub(super) fn missing(&mut self, window: &Mmap) -> Option<Vec<Range<usize>>> {
            let start = window.as_ptr().addr();
            let first = start / PAGE;
            let pages = first..(start + window.len()).div_ceil(PAGE);
            if self.scans {
                match self.scan(&pages) {
                    Ok(missing) => return missing,
                    Err(_) => self.scans = false,
                }
            }
            self.entries.resize(pages.len() * Self::ENTRY, 0);
            let at = (first * Self::ENTRY) as u64;
            self.file.read_exact_at(&mut self.entries, at).ok()?;
            let entries = pages.zip(self.entries.chunks_exact(Self::ENTRY));
            let missing: Vec<Range<usize>> = entries
                .filter(|(_, entry)| entry[Self::ENTRY - 1] & Self::PRESENT == 0)
                .map(|(page, _)| page * PAGE..(page + 1) * PAGE)
                .take(FEW)
                .collect();
            (missing.len() < FEW).then_some(missing)
        }

        /// The same, by the kernel.
        fn scan(&self, pages: &Range<usize>) -> nix::Result<Option<Vec<Range<usize>>>> {
            const PRESENT: u64 = 1 << 3;
            let mut regions = [[0u64; 3]; FEW];
            let mut question = Scan {
                size: size_of::<Scan>() as u64,
                start: (pages.start * PAGE) as u64,
                end: (pages.end * PAGE) as u64,
                regions: regions.as_mut_ptr().expose_provenance() as u64,
                regions_len: FEW as u64,
                inverted: PRESENT,
                all_of: PRESENT,
                told: PRESENT,
                ..Scan::default()
            };
            // SAFETY: the kernel writes to the question, and to no more than so many regions at the address that it holds;
            // both live until then.
            let found = unsafe { scan(self.file.as_raw_fd(), &raw mut question)? } as usize;
            let missing = regions.iter().take(found);
            let missing = missing.map(|&[start, end, _]| start as usize..end as usize);
            Ok((found < FEW).then(|| missing.collect()))
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
    fn the_table_of_pages_tells_what_is_missing() {
        use std::ops::Range;
        let (window, _file) = mapped("entered");
        let table = || sparse::PageTable::open().unwrap();
        let (mut scanned, mut read) = (table(), table().without_scans());
        let bytes = |missing: &[Range<usize>]| missing.iter().map(|some| some.len()).sum::<usize>();
        // A scan tells regions, and this is one; a table that is read tells pages.
        assert_eq!(read.missing(&window), None);
        let Some(missing) = scanned.missing(&window) else {
            return; // a kernel that is not asked
        };
        assert_eq!(bytes(&missing), BYTES as usize);
        window.advise_range(Advice::PopulateRead, 0, 1).unwrap();
        let missing = scanned.missing(&window).unwrap();
        assert!((1..BYTES as usize).contains(&bytes(&missing)));
        for some in missing {
            sparse::enter_all(&window, some).unwrap();
        }
        assert_eq!(scanned.missing(&window), Some(vec![]));
        assert_eq!(read.missing(&window), Some(vec![]));
    }
}
