//! Spectrograms beside each other.

use plotters::coord::Shift;
use plotters::prelude::*;
use rowtone_plot::{DrawError, Drawing};

use crate::sound::stft::Spectrogram;

/// Shades from the darkest to the brightest.
const SHADES: i32 = 20;

/// The drawing: one panel a spectrogram, with one scale of shades for each, from its own largest value down.
#[derive(Clone, Debug)]
pub struct Panels {
    /// What to write above.
    pub title: String,
    /// What each panel shows.
    pub panels: Vec<(String, Spectrogram)>,
    /// Highest frequency shown, Hz.
    pub top_hz: f64,
    /// From the largest to the darkest, dB.
    pub range_db: f64,
}

impl Drawing for Panels {
    fn size(&self) -> (u32, u32) {
        (800, 40 + 250 * self.panels.len().div_ceil(2) as u32)
    }

    fn draw<B>(&self, root: &DrawingArea<B, Shift>) -> Result<(), DrawError>
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        root.fill(&WHITE)?;
        let root = root.titled(&self.title, ("sans-serif", 18))?;
        let areas = root.split_evenly((self.panels.len().div_ceil(2), 2));
        for (area, (name, spectrogram)) in areas.iter().zip(&self.panels) {
            self.panel(area, name, spectrogram)?;
        }
        Ok(())
    }
}

impl Panels {
    fn panel<B>(
        &self,
        area: &DrawingArea<B, Shift>,
        name: &str,
        spectrogram: &Spectrogram,
    ) -> Result<(), DrawError>
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let columns = &spectrogram.columns;
        let end_s = (spectrogram.hop_s * columns.len() as f64).max(1e-3);
        let mut chart = ChartBuilder::on(area)
            .caption(name, ("sans-serif", 15))
            .margin(6)
            .margin_right(16)
            .x_label_area_size(30)
            .y_label_area_size(52)
            .build_cartesian_2d(0.0..end_s, 0.0..self.top_hz)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .label_style(("sans-serif", 12))
            .x_labels(5)
            .y_labels(6)
            .x_desc("s")
            .y_desc("Hz")
            .draw()?;
        let largest = columns.iter().flatten().fold(1e-300, |m: f64, v| m.max(*v));
        let shade = |power: f64| {
            let db = 10.0 * (power.max(1e-300) / largest).log10();
            (f64::from(SHADES) * (1.0 + db / self.range_db)).round() as i32
        };
        for (i, column) in columns.iter().enumerate() {
            let (left, right) = (
                spectrogram.hop_s * i as f64,
                spectrogram.hop_s * (i + 1) as f64,
            );
            let shown = (self.top_hz / spectrogram.bin_hz) as usize;
            let shades: Vec<i32> = column
                .iter()
                .take(shown)
                .map(|&p| shade(p).max(0))
                .collect();
            let mut from = 0;
            for run in shades.chunk_by(|a, b| a == b) {
                let to = from + run.len();
                let up = |bin: usize| spectrogram.bin_hz * bin as f64;
                chart.draw_series([Rectangle::new(
                    [(left, up(from)), (right, up(to))],
                    grey(run[0]).filled(),
                )])?;
                from = to;
            }
        }
        Ok(())
    }
}

/// White where nothing is, dark blue where most is.
fn grey(shade: i32) -> RGBColor {
    let part = f64::from(shade.clamp(0, SHADES)) / f64::from(SHADES);
    let mix = |from: f64, to: f64| (from + (to - from) * part).round() as u8;
    RGBColor(mix(255.0, 8.0), mix(255.0, 29.0), mix(255.0, 88.0))
}
