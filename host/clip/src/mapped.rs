//! Y4M files on disk, mapped into memory window by window: their pixels are never copied.
//!
//! The copy is what reading costs, and where one thread reads and another measures, the bytes go to where
//! the other thread's core still holds those of an earlier frame: measured, that made reading five times
//! as slow. So the reading thread only maps the file's pages, ahead of the lines, and unmaps them when
//! their frames are done with. Memory stays what it is however long the recording.

use std::fs::File;
use std::io;
use std::sync::Arc;

use memmap2::MmapOptions;

use super::bytes::Bytes;
use super::frame_read::Next;
#[cfg(target_os = "linux")]
use super::populate::Populate;
use super::source::FrameSource;
use super::window::Window;
use super::y4m::{Layout, Reader};
use super::{ClipError, Header};

/// Bytes that are mapped at once; more where a frame is larger.
const WINDOW_BYTES: usize = 4 << 20;

/// The frames of a Y4M file.
#[derive(Debug)]
pub(super) struct MappedReader {
    windows: Windows,
    layout: Layout,
}

impl MappedReader {
    /// Goes on behind the header that `reader` has read.
    ///
    /// # Errors
    /// When the operating system cannot map this file; `reader` can still read it.
    pub(super) fn new(reader: &Reader<File>) -> io::Result<Self> {
        let (file, layout) = reader.parts();
        let mut windows = Windows {
            file: file.try_clone()?,
            length: 0,
            at: reader.header_bytes() as u64,
            start: 0,
            window: None,
            #[cfg(target_os = "linux")]
            populate: Populate::new(),
        };
        windows.map(0)?;
        Ok(Self {
            windows,
            layout: layout.clone(),
        })
    }
}

impl FrameSource for MappedReader {
    fn header(&self) -> &Header {
        self.layout.header()
    }

    fn next_frame(&mut self, bytes: &mut Bytes) -> Result<Next, ClipError> {
        // Nobody needs the window of the frame before any more.
        *bytes = Bytes::default();
        let mut need = self.layout.stride();
        loop {
            let seen = match self.windows.look(need) {
                Ok(seen) => seen,
                Err(error) => return Err(self.layout.unreadable(error)),
            };
            let have = seen.len();
            if have == 0 {
                return Ok(Next::End);
            }
            let marker = self.layout.check_marker(seen)?;
            // A marker longer than a whole (tiny) frame: its end is yet to come.
            let whole = marker.map_or(need + 1, |marker| marker + self.layout.frame_bytes());
            match marker {
                Some(luma) if have >= whole => {
                    *bytes = self.windows.take(whole);
                    self.layout.count();
                    return Ok(Next::Frame { luma });
                }
                Some(_) if have < need => return Ok(Next::Truncated { have, need: whole }),
                None if have < need => return Ok(Next::Truncated { have, need }),
                _ => need = whole,
            }
        }
    }
}

/// A file, seen through one window after the other.
#[derive(Debug)]
struct Windows {
    file: File,
    /// Bytes of the file when it was last asked.
    length: u64,
    /// Position in the file of the next byte, and of the window's first.
    at: u64,
    start: u64,
    window: Option<Arc<Window>>,
    #[cfg(target_os = "linux")]
    populate: Populate,
}

impl Windows {
    /// Up to `count` bytes from the present position on; fewer only at the end of the file.
    fn look(&mut self, count: usize) -> io::Result<&[u8]> {
        if self.rest().len() < count {
            self.map(count)?;
        }
        let rest = self.rest();
        Ok(&rest[..count.min(rest.len())])
    }

    /// The next `count` bytes, which [`Windows::look`] has shown.
    fn take(&mut self, count: usize) -> Bytes {
        let from = (self.at - self.start) as usize;
        self.at += count as u64;
        match &self.window {
            Some(window) => Bytes::Mapped(window.clone(), from..from + count),
            None => Bytes::default(),
        }
    }

    /// What the window shows from the present position on.
    fn rest(&self) -> &[u8] {
        let from = (self.at - self.start) as usize;
        let window = self.window.as_ref();
        window
            .and_then(|window| window.get(from..))
            .unwrap_or_default()
    }

    /// Opens a window of at least `count` bytes at the present position; fewer at the end of the file.
    fn map(&mut self, count: usize) -> io::Result<()> {
        // Asked anew for each window: a recording may still be growing.
        let length = self.file.metadata()?.len();
        if length < self.length {
            return Err(io::Error::other("another program has cut the file short"));
        }
        self.length = length;
        let left = length.saturating_sub(self.at);
        let left = usize::try_from(left).unwrap_or(usize::MAX);
        let length = left.min(count.max(WINDOW_BYTES));
        self.start = self.at;
        self.window = None;
        if length == 0 {
            return Ok(());
        }
        // SAFETY: the window is only read, as bytes of which any value will do. Where another program
        // changes the file meanwhile, pixels change and nothing else. Where it cuts the file short, a
        // page that is not there any more is found by `Populate`, as an error; one that goes later reads
        // as zeros, and `Window` knows.
        let window = unsafe {
            MmapOptions::new()
                .offset(self.at)
                .len(length)
                .map(&self.file)?
        };
        let window = Window::new(window)?;
        #[cfg(target_os = "linux")]
        self.populate.all(&window)?;
        self.window = Some(Arc::new(window));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Outcome = Result<(Next, Vec<u8>), String>;

    /// Everything that a source says, with the planes of each frame.
    fn all(source: &mut dyn FrameSource) -> Vec<Outcome> {
        let planes = source.header().frame_bytes().unwrap();
        let mut outcomes = Vec::new();
        loop {
            let mut bytes = Bytes::default();
            let next = source.next_frame(&mut bytes);
            let seen = match next {
                Ok(Next::Frame { luma }) => bytes[luma..luma + planes].to_vec(),
                _ => Vec::new(),
            };
            let ended = !matches!(next, Ok(Next::Frame { .. }));
            let outcome = next.map(|next| (next, seen));
            outcomes.push(outcome.map_err(|error| error.to_string()));
            if ended {
                return outcomes;
            }
        }
    }

    /// A file read, and the same file mapped.
    fn both(bytes: &[u8], name: &str) -> [Vec<Outcome>; 2] {
        let path = std::env::temp_dir().join(format!("rowtone-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        let open = || Reader::open(File::open(&path).unwrap(), "clip").unwrap();
        let outcomes = [
            all(&mut open()),
            all(&mut MappedReader::new(&open()).unwrap()),
        ];
        std::fs::remove_file(&path).unwrap();
        outcomes
    }

    #[test]
    fn mapped_and_read_frames_are_the_same() {
        let header = "YUV4MPEG2 W2 H2 Cmono\n";
        for (n, tail) in [
            "",
            "FRAME\nabcd",
            "FRAME\nabcdFRAME Ip Xa-note-longer-than-the-frame\nefghFRAME\nijkl",
            "FRAME\nabcdF",
            "FRAME\nabcdFRAME",
            "FRAME\nabcdFRAME\n",
            "FRAME\nabcdFRAME\nef",
            "FRAME\nabcdFRAME Ip\nef",
            "FRAME\nabcdFRAME Ip",
            "FRAME\nabcdnonsense",
        ]
        .iter()
        .enumerate()
        {
            let bytes = format!("{header}{tail}");
            let [read, mapped] = both(bytes.as_bytes(), &format!("mapped-{n}"));
            assert_eq!(read, mapped, "{tail:?}");
        }
    }

    #[test]
    fn a_file_that_is_cut_short_is_an_error() {
        let path = std::env::temp_dir().join(format!("rowtone-{}-shorter", std::process::id()));
        let mut bytes = b"YUV4MPEG2 W2500 H1500 Cmono\n".to_vec();
        for k in 0..5u8 {
            bytes.extend(b"FRAME\n");
            bytes.extend(std::iter::repeat_n(k, 2500 * 1500));
        }
        std::fs::write(&path, &bytes).unwrap();
        let file = File::options().read(true).write(true).open(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let reader = Reader::open(file.try_clone().unwrap(), "clip").unwrap();
        let mut mapped = MappedReader::new(&reader).unwrap();
        let mut frame = Bytes::default();
        assert!(matches!(
            mapped.next_frame(&mut frame),
            Ok(Next::Frame { .. })
        ));
        file.set_len(1 << 16).unwrap();
        assert!(!frame.are_cut());
        assert_eq!(frame.last(), Some(&0));
        assert!(frame.are_cut() || cfg!(not(target_os = "linux")));
        let error = mapped.next_frame(&mut Bytes::default()).unwrap_err();
        assert!(error.to_string().contains("cut the file short"), "{error}");
    }

    #[test]
    fn frames_across_the_ends_of_windows_are_whole() {
        // Frames of 3.75 MB: one fits into a window, the next begins in it.
        let mut bytes = b"YUV4MPEG2 W2500 H1500 Cmono\n".to_vec();
        for k in 0..5u8 {
            bytes.extend(b"FRAME\n");
            bytes.extend(std::iter::repeat_n(k, 2500 * 1500));
        }
        let [read, mapped] = both(&bytes, "windows");
        assert_eq!(mapped.len(), 6);
        assert!(read == mapped);
    }
}
