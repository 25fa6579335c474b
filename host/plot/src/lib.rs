//! A recording as a picture: a frame with the part that is measured, the tones, spectra of both axes, displacement over
//! a few frames, spectrogram.
//!
//! A [`Picture`] is shown every sample and every report and drawn at the end. It keeps the samples of
//! one window and a bounded number of spectra, so it does not grow with the recording. A [`Plate`] shows the shapes of tones, an
//! [`Animation`] lets them swing.

mod animation;
mod canvas;
mod draw;
mod error;
mod file;
mod film;
mod glyphs;
mod photo;
mod plate;
mod residual;
mod spectrogram;
mod spectrum;
mod tones;

use std::collections::VecDeque;
use std::path::PathBuf;

use rowtone::report::{Peak, Report};
use rowtone::timeline::Sample;

pub use animation::Animation;
pub use error::{DrawError, PlotError};
pub use photo::Photo;
pub use plate::{Panel, Phasors, Plate};

pub use file::{Drawing, check_ending, png, svg, write};
pub use film::{gif, y4m};

use self::residual::Fit;
use self::spectrogram::Spectrogram;

/// Points of the noise floor.
const FLOOR_POINTS: usize = 600;
/// Rows of the spectrogram.
const SPECTROGRAM_ROWS: usize = 200;
/// A sinc below this is not divided by: near its zeros the exposure leaves nothing to see.
const LEAST_SINC: f64 = 0.2;

/// What a picture is to show.
#[derive(Clone, Debug)]
pub struct Settings {
    /// File to write, `.svg` or `.png`.
    pub path: PathBuf,
    /// What to write above.
    pub title: String,
    /// Frequencies to show, Hz.
    pub band_hz: (f64, f64),
    /// Exposure of a row, s.
    pub exposure_s: f64,
    /// All rows of a frame are one sample.
    pub one_a_frame: bool,
}

/// A picture in the making.
#[derive(Debug)]
pub struct Picture {
    settings: Settings,
    /// Start of the recording, ns.
    start_ns: Option<i64>,
    samples: VecDeque<Sample>,
    spectrogram: Spectrogram,
    last: Option<(Report, Fit)>,
    /// Of the same window along y, where that is measured.
    last_y: Option<Fit>,
    photo: Option<Photo>,
}

impl Picture {
    /// Starts a picture.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            start_ns: None,
            samples: VecDeque::new(),
            spectrogram: Spectrogram::default(),
            last: None,
            last_y: None,
            photo: None,
        }
    }

    /// Says when the recording started, ns: reports count from there.
    pub fn start(&mut self, start_ns: i64) {
        self.start_ns.get_or_insert(start_ns);
    }

    /// Gives it a frame to show.
    pub fn photo(&mut self, photo: Photo) {
        self.photo = Some(photo);
    }

    /// Shows it a sample.
    pub fn sample(&mut self, sample: &Sample) {
        self.samples.push_back(*sample);
    }

    /// Shows it the report of a window; the samples of that window must have been shown.
    pub fn report(&mut self, report: &Report) {
        let end_s = report.time_ms as f64 * 1e-3;
        let start_s = end_s - f64::from(report.window_s);
        let origin = self.start_ns.unwrap_or(0);
        let at = |s: f64| origin + (s * 1e9) as i64;
        while self
            .samples
            .front()
            .is_some_and(|s| s.time_ns < at(start_s))
        {
            self.samples.pop_front();
        }
        let window: Vec<Sample> = self
            .samples
            .iter()
            .take_while(|s| s.time_ns <= at(end_s + 1e-3))
            .copied()
            .collect();
        let bends = |p: &Peak| p.motion.as_ref().is_some_and(|m| !m.rigid);
        let tones = report.peaks.iter().map(|p| (p.hz.into(), bends(p)));
        let tones: Vec<(f64, bool)> = tones.collect();
        let fit = Fit::bending(&window, &tones);
        let mut column: Vec<f32> = self
            .floor(&fit, SPECTROGRAM_ROWS)
            .iter()
            .map(|point| point.1 as f32)
            .collect();
        let (low, high) = self.settings.band_hz;
        for peak in &report.peaks {
            let place = (f64::from(peak.hz) - low) / (high - low) * SPECTROGRAM_ROWS as f64;
            if let Some(row) = column.get_mut(place as usize) {
                *row = row.max(peak.amplitude_px);
            }
        }
        self.spectrogram.push(column);
        self.spectrogram.start_s.get_or_insert(start_s.max(0.0));
        self.spectrogram.end_s = end_s;
        let down: Vec<Sample> = window.iter().filter_map(downwards).collect();
        self.last_y = (!down.is_empty()).then(|| Fit::bending(&down, &tones));
        self.last = Some((report.clone(), fit));
    }

    /// The noise floor at the middles of `count` parts of the band.
    fn floor(&self, fit: &Fit, count: usize) -> Vec<(f64, f64)> {
        let (low, high) = self.settings.band_hz;
        (0..count)
            .map(|i| {
                let hz = low + (high - low) * (i as f64 + 0.5) / count as f64;
                let x = std::f64::consts::PI * hz * self.settings.exposure_s;
                let sinc = if x > 0.0 { (x.sin() / x).abs() } else { 1.0 };
                (hz, fit.rest_amplitude_px(hz) / sinc.max(LEAST_SINC))
            })
            .collect()
    }

    /// Draws the picture and writes it. Nothing is written when there was no report.
    ///
    /// # Errors
    /// [`PlotError`] when it cannot be drawn, or the file cannot be written.
    pub fn save(&self) -> Result<(), PlotError> {
        let Some((report, fit)) = &self.last else {
            return Ok(());
        };
        let floor_y = self
            .last_y
            .as_ref()
            .map(|fit| self.floor(fit, FLOOR_POINTS));
        let scene = draw::Scene {
            photo: self.photo.as_ref(),
            floor_y: floor_y.as_deref().unwrap_or_default(),
            title: &self.settings.title,
            report,
            fit,
            floor: &self.floor(fit, FLOOR_POINTS),
            spectrogram: &self.spectrogram,
            band_hz: self.settings.band_hz,
            one_a_frame: self.settings.one_a_frame,
        };
        write(&self.settings.path, &scene)
    }
}

/// What a sample knows of the motion down the columns, as a sample of its own.
fn downwards(sample: &Sample) -> Option<Sample> {
    let vertical = sample.vertical.as_ref()?;
    (vertical.information_per_px2 > 0.0).then_some(Sample {
        shift_px: vertical.shift_px,
        information_per_px2: vertical.information_per_px2,
        ..*sample
    })
}
