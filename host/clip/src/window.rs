//! Windows of a file that another program may cut short while they are read.
//!
//! Reading a mapped page that is no longer in its file raises the signal SIGBUS, which ends a program.
//! Whoever maps files and cannot trust their owners answers it: here with a page of zeros in its place
//! and a mark on the window, so that the reader goes on for a moment, sees the mark, and says what has
//! happened. (Wayland compositors do the same with the memory that their clients share with them.)

use std::io;
use std::ops::Deref;

use memmap2::Mmap;

/// Part of a file, mapped.
#[derive(Debug)]
pub(super) struct Window {
    map: Mmap,
    #[cfg(target_os = "linux")]
    slot: guard::Slot,
}

impl Window {
    /// Looks after a mapping.
    ///
    /// # Errors
    /// When the signal cannot be answered, or there are too many windows.
    pub(super) fn new(map: Mmap) -> io::Result<Self> {
        Ok(Self {
            #[cfg(target_os = "linux")]
            slot: guard::Slot::of(&map)?,
            map,
        })
    }

    /// Pages of it were gone when they were read, and zeros were read instead.
    pub(super) fn is_cut(&self) -> bool {
        #[cfg(target_os = "linux")]
        return self.slot.is_cut();
        #[cfg(not(target_os = "linux"))]
        false
    }
}

impl Deref for Window {
    type Target = Mmap;

    fn deref(&self) -> &Mmap {
        &self.map
    }
}

#[cfg(target_os = "linux")]
mod guard {
    use std::io;
    use std::mem::{MaybeUninit, zeroed};
    use std::ptr::null_mut;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering};

    use memmap2::Mmap;
    use nix::libc;

    /// Most windows at a time.
    const SLOTS: usize = 1024;
    /// A slot's start while it is being filled.
    const TAKEN: usize = 1;

    /// A window's addresses, where the signal handler finds them.
    struct Entry {
        /// First address; 0 for none.
        start: AtomicUsize,
        /// First address behind it.
        end: AtomicUsize,
        cut: AtomicBool,
    }

    static ENTRIES: [Entry; SLOTS] = [const {
        Entry {
            start: AtomicUsize::new(0),
            end: AtomicUsize::new(0),
            cut: AtomicBool::new(false),
        }
    }; SLOTS];

    /// What was done about the signal before; never freed.
    static BEFORE: AtomicPtr<libc::sigaction> = AtomicPtr::new(null_mut());
    static PAGE: AtomicUsize = AtomicUsize::new(0);

    /// A window's place among the entries.
    #[derive(Debug)]
    pub(super) struct Slot(usize);

    impl Slot {
        pub(super) fn of(map: &Mmap) -> io::Result<Self> {
            static INSTALLED: OnceLock<bool> = OnceLock::new();
            if !INSTALLED.get_or_init(install) {
                return Err(io::Error::other("SIGBUS cannot be answered"));
            }
            let start = map.as_ptr().expose_provenance();
            let free = ENTRIES.iter().position(|entry| {
                let taken =
                    entry
                        .start
                        .compare_exchange(0, TAKEN, Ordering::AcqRel, Ordering::Relaxed);
                taken.is_ok()
            });
            let slot =
                free.ok_or_else(|| io::Error::other("too many windows of a file at once"))?;
            let entry = &ENTRIES[slot];
            entry.end.store(start + map.len(), Ordering::Relaxed);
            entry.cut.store(false, Ordering::Relaxed);
            entry.start.store(start, Ordering::Release);
            Ok(Self(slot))
        }

        pub(super) fn is_cut(&self) -> bool {
            ENTRIES[self.0].cut.load(Ordering::Relaxed)
        }
    }

    impl Drop for Slot {
        fn drop(&mut self) {
            ENTRIES[self.0].start.store(0, Ordering::Release);
        }
    }

    /// Answers the signal from now on. Whether that can be done.
    fn install() -> bool {
        let mut before = Box::new(MaybeUninit::<libc::sigaction>::uninit());
        // SAFETY: `action` is zeros, as the C type allows, but for the fields set here; the handler has the
        // signature that SA_SIGINFO asks for and runs on the alternate stack that the standard library has
        // set up; `before` is written by a call that says whether it was.
        let done = unsafe {
            let page = libc::sysconf(libc::_SC_PAGESIZE);
            PAGE.store(usize::try_from(page).unwrap_or(0), Ordering::Relaxed);
            let mut action: libc::sigaction = zeroed();
            action.sa_sigaction = answer as *const () as usize;
            action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
            page > 0 && libc::sigaction(libc::SIGBUS, &raw const action, before.as_mut_ptr()) == 0
        };
        if done {
            BEFORE.store(Box::into_raw(before).cast(), Ordering::Release);
        }
        done
    }

    /// Puts a page of zeros where one of a window is gone. What else raised the signal gets what it would
    /// have got without us. Calls only what a signal handler may: atomics, mmap and sigaction.
    extern "C" fn answer(_: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
        // SAFETY: the kernel passes a valid `info`; SIGBUS has an address in it.
        let address = unsafe { (*info).si_addr() }.addr();
        let page = PAGE.load(Ordering::Relaxed);
        for entry in &ENTRIES {
            let start = entry.start.load(Ordering::Acquire);
            if start <= TAKEN || !(start..entry.end.load(Ordering::Relaxed)).contains(&address) {
                continue;
            }
            let at = address / page * page;
            // SAFETY: the page belongs to a live mapping of ours, which its owner unmaps as a whole, and
            // nobody has a reference through which it could be written.
            let put = unsafe {
                libc::mmap(
                    std::ptr::with_exposed_provenance_mut(at),
                    page,
                    libc::PROT_READ,
                    libc::MAP_FIXED | libc::MAP_PRIVATE | libc::MAP_ANONYMOUS,
                    -1,
                    0,
                )
            };
            if put != libc::MAP_FAILED {
                entry.cut.store(true, Ordering::Relaxed);
                return;
            }
        }
        let before = BEFORE.load(Ordering::Acquire);
        // SAFETY: `before` is null or what sigaction wrote once; zeros are the default action. The read is
        // tried again after this, and now meets that action.
        unsafe {
            let default: libc::sigaction = zeroed();
            let action = if before.is_null() {
                &raw const default
            } else {
                before.cast_const()
            };
            libc::sigaction(libc::SIGBUS, action, null_mut());
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::fs::File;

    use memmap2::MmapOptions;

    use super::*;

    #[test]
    fn a_page_that_is_gone_reads_as_zeros_and_is_marked() {
        let path = std::env::temp_dir().join(format!("rowtone-{}-window", std::process::id()));
        std::fs::write(&path, vec![7; 1 << 16]).unwrap();
        let file = File::options().read(true).write(true).open(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        // SAFETY: whatever is read is only compared.
        let map = || unsafe { MmapOptions::new().map(&file).unwrap() };
        let (window, whole) = (Window::new(map()).unwrap(), Window::new(map()).unwrap());
        assert!(window.iter().all(|&byte| byte == 7) && !window.is_cut());
        file.set_len(4096).unwrap();
        assert_eq!(window[100], 7);
        assert!(!window.is_cut());
        assert!(window[4096..].iter().all(|&byte| byte == 0));
        assert!(window.is_cut() && !whole.is_cut());
        drop(window);
        // Another window in the same place starts unmarked.
        let again = Window::new(map()).unwrap();
        assert!(!again.is_cut());
    }
}
