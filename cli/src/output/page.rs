//! What a page shows of a recording, handed over as it is measured.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rowtone::camera::RawFormat;
use rowtone::link::settings::Settings;
use rowtone::report::Report;
use rowtone_clip::{Camera, Feed, Frame};
use rowtone_files::WholeFile;
use rowtone_measure::analysis::Event;
use rowtone_page::frames::Layout;
use rowtone_page::live::{About, Live, Phase};
use rowtone_page::motion::MotionWriter;
use rowtone_page::still;

use crate::failure::Failure;

/// A recording on its way to a page.
#[derive(Debug)]
pub(crate) struct Shown {
    live: Arc<Live>,
    motion: MotionWriter,
}

impl Shown {
    /// Describes the recording, and shows its frames as they are read.
    pub(crate) fn new(feed: &mut Feed, live: &Arc<Live>) -> Self {
        let camera = &feed.camera;
        let (width, height) = given_size(camera);
        let exposure_us = f64::from(camera.timing.exposure_ns()) * 1e-3;
        live.describe(About {
            name: feed.name.clone(),
            picture: Some([width, height]),
            part: None,
            line_time_us: Some(f64::from(camera.timing.line_time_ps()) * 1e-6),
            exposure_us: Some(exposure_us).filter(|&us| us > 0.0),
            fps: Some(camera.fps),
        });
        let show = pictures(live, width, height, camera.bits);
        feed.show_to(show);
        live.set_phase(Phase::Measuring, "");
        Self {
            live: Arc::clone(live),
            motion: MotionWriter::default(),
        }
    }

    /// Takes what an analysis says that is no report.
    pub(crate) fn hear(&mut self, event: &Event<'_>) {
        match event {
            Event::Part(part) => {
                let part = [part.x, part.y, part.width, part.height];
                self.live.set_part(part);
            }
            Event::Frame(_) => self.motion.hand_over(&self.live.motion),
            Event::Sample(sample) => self.motion.sample(sample),
            Event::Note(_) | Event::Report(..) => {}
        }
    }

    /// Takes a report, with its JSON.
    pub(crate) fn report(&mut self, report: &Report, json: String) {
        self.motion.hand_over(&self.live.motion);
        self.live.report(report, json);
    }
}

/// Columns and rows of the picture as it was given, before it is turned.
pub(crate) fn given_size(camera: &Camera) -> (usize, usize) {
    camera.turn.back().size(camera.size.0, camera.size.1)
}

/// Hands every frame to the page.
fn pictures(
    live: &Arc<Live>,
    width: usize,
    height: usize,
    bits: u8,
) -> impl FnMut(&Frame) + Send + use<> {
    let live = Arc::clone(live);
    let format = match bits {
        ..=8 => RawFormat::Raw8,
        10 => RawFormat::Raw10,
        12 => RawFormat::Raw12,
        _ => RawFormat::Raw16,
    };
    let layout = Layout {
        width: width as u16,
        height: height as u16,
        stride: format.bytes(width),
        format,
        bayer: false,
    };
    // Words of other depths are brought to the upper end of theirs.
    let shift = match format {
        RawFormat::Raw16 => 16 - bits.min(16),
        _ => 0,
    };
    let mut shifted = Vec::new();
    move |frame| {
        let mut bytes = frame.given();
        if shift > 0 {
            shifted.clear();
            let words = bytes.as_chunks::<2>().0.iter().take(width * height);
            let upper = words.flat_map(|&word| (u16::from_le_bytes(word) << shift).to_le_bytes());
            shifted.extend(upper);
            bytes = &shifted;
        }
        live.frames
            .keep(frame.number, frame.start_ns, layout, bytes);
    }
}

/// A page as one file to hand on: what was measured stands in it.
#[derive(Debug)]
pub(crate) struct StillPage {
    path: PathBuf,
    settings: Settings,
    live: Arc<Live>,
    shown: Shown,
}

impl StillPage {
    /// What can be said before anything is measured: the ending, and whether the file can be written.
    ///
    /// # Errors
    /// [`Failure::Usage`] for another ending than `.html`, [`Failure::Input`] where it cannot be written.
    pub(crate) fn check(path: &Path) -> Result<(), Failure> {
        let ending = path.extension().and_then(|ending| ending.to_str());
        if !ending.is_some_and(|e| e.eq_ignore_ascii_case("html")) {
            let path = path.display();
            return Err(Failure::usage(format!(
                "--report {path}: give a name that ends with .html"
            )));
        }
        Failure::unless_writable(path)
    }

    /// A page of what `feed` is about to deliver, with the settings it is measured with.
    pub(crate) fn new(path: PathBuf, feed: &mut Feed, settings: Settings) -> Self {
        // The last picture alone is shown.
        let live = Arc::new(Live::new(0));
        Self {
            path,
            settings,
            shown: Shown::new(feed, &live),
            live,
        }
    }

    /// Where what is measured goes.
    pub(crate) fn shown(&mut self) -> &mut Shown {
        &mut self.shown
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`Failure::Input`] where it cannot be written.
    pub(crate) fn save(self) -> Result<(), Failure> {
        use std::io::Write;
        self.live.set_phase(Phase::Ended, "");
        let page = still::page(&self.live, &self.settings);
        let written = WholeFile::create(&self.path).and_then(|mut file| {
            file.write_all(page.as_bytes())?;
            file.finish()
        });
        written.map_err(|e| Failure::writing(&self.path.display().to_string(), &e))
    }
}
