//! The picture itself: the frame and the list of tones above, the spectrum, displacement and spectrogram below.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use rowtone::report::Report;

use super::error::DrawError;
use super::file::Drawing;
use super::photo::Photo;
use super::residual::Fit;
use super::spectrogram::Spectrogram;
use super::{spectrum, tones};

/// Size of the picture, px.
pub(super) const SIZE: (u32, u32) = (1200, 1240);

pub(super) const INK: RGBColor = RGBColor(38, 44, 52);
pub(super) const GRID: RGBColor = RGBColor(226, 230, 234);
pub(super) const MUTED: RGBColor = RGBColor(112, 122, 134);
pub(super) const TONE: RGBColor = RGBColor(202, 60, 40);
/// Of what is along the rows, and down the columns.
pub(super) const X_AXIS: RGBColor = RGBColor(24, 92, 160);
pub(super) const Y_AXIS: RGBColor = RGBColor(30, 140, 90);
/// Letters of the title.
const TITLE: usize = 110;
/// Shades of the spectrogram.
const SHADES: i32 = 24;
/// From dark to bright, perceptually even: the anchors of "viridis" (van der Walt & Smith 2015).
const MAP: [(u8, u8, u8); 6] = [
    (68, 1, 84),
    (65, 68, 135),
    (42, 120, 142),
    (34, 168, 132),
    (122, 209, 81),
    (253, 231, 37),
];

/// All that is drawn.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a> {
    /// What to write above.
    pub title: &'a str,
    /// The last window's report.
    pub report: &'a Report,
    /// The last window's samples.
    pub fit: &'a Fit,
    /// A frame of the recording.
    pub photo: Option<&'a Photo>,
    /// Noise floor of the last window along x: frequencies, Hz, and amplitudes, px.
    pub floor: &'a [(f64, f64)],
    /// The same along y; nothing where that is not measured.
    pub floor_y: &'a [(f64, f64)],
    /// Amplitudes over time.
    pub spectrogram: &'a Spectrogram,
    /// Frequencies of the spectrogram's rows, Hz.
    pub band_hz: (f64, f64),
    /// All rows of a frame are one sample.
    pub one_a_frame: bool,
}

pub(super) type Area<B> = DrawingArea<B, Shift>;
pub(super) type Drawn = Result<(), DrawError>;

impl Drawing for Scene<'_> {
    fn size(&self) -> (u32, u32) {
        SIZE
    }

    fn draw<B>(&self, root: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        root.fill(&WHITE)?;
        let root = root.titled(&short_title(self.title), font(20))?;
        let (above, below) = root.split_vertically(380);
        let (photo, list) = above.split_horizontally(if self.photo.is_some() { 480 } else { 70 });
        if let Some(frame) = self.photo {
            frame.draw(&photo, if self.floor_y.is_empty() { 1 } else { 2 })?;
        }
        tones::list(&list, self.report)?;
        let (above, below) = below.split_vertically(430);
        let (left, right) = below.split_horizontally(600);
        spectrum::spectrum(&above, self)?;
        displacement(&left, self)?;
        spectrogram(&right, self)
    }
}

pub(super) fn font(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

/// The end of a title that is too long for the picture: where a file's own name is.
fn short_title(title: &str) -> String {
    let letters = title.chars().count();
    if letters <= TITLE {
        return title.to_owned();
    }
    format!(
        "…{}",
        title.chars().skip(letters - TITLE).collect::<String>()
    )
}

/// Decades of px that hold the floor and the tones.
pub(super) fn amplitude_range(scene: &Scene<'_>) -> std::ops::Range<f64> {
    let mut floor: Vec<f64> = scene
        .floor
        .iter()
        .chain(scene.floor_y)
        .map(|point| point.1)
        .collect();
    floor.sort_by(f64::total_cmp);
    let low = floor
        .get(floor.len() / 4)
        .copied()
        .unwrap_or(1e-4)
        .max(1e-7);
    let peaks = scene.report.peaks.iter().map(|p| f64::from(p.amplitude_px));
    let high = peaks
        .chain(floor.last().copied())
        .fold(low * 30.0, f64::max);
    let low = 10_f64.powf((low / 2.0).log10().floor());
    low..high * 3.0
}

fn displacement<B>(area: &Area<B>, scene: &Scene<'_>) -> Drawn
where
    B: DrawingBackend,
    B::ErrorType: 'static,
{
    let frames = if scene.one_a_frame { 150 } else { 4 };
    let fit = scene.fit;
    let first = fit.frames.first().copied().unwrap_or(0);
    let shown: Vec<usize> = (0..fit.frames.len())
        .take_while(|&i| fit.frames[i].wrapping_sub(first) < frames)
        .collect();
    let end = shown.last().map_or(1e-3, |&i| fit.times_s[i].max(1e-6));
    let tall = shown
        .iter()
        .map(|&i| fit.shifts_px[i].abs())
        .fold(1e-4, f64::max)
        * 1.15;
    let mut chart = ChartBuilder::on(area)
        .caption("Displacement along the rows, a few frames", font(16))
        .margin(12)
        .margin_right(28)
        .x_label_area_size(42)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..end * 1e3, -tall..tall)?;
    mesh(&mut chart, "time, ms", "displacement, px", tall)?;
    let points = |indices: &[usize]| -> Vec<(f64, f64)> {
        indices
            .iter()
            .map(|&i| (fit.times_s[i] * 1e3, fit.shifts_px[i]))
            .collect()
    };
    if !fit.tones.is_empty() {
        let steps = 1200;
        let model = (0..=steps).map(|i| {
            let t = end * f64::from(i) / f64::from(steps);
            (t * 1e3, fit.model_px(t).clamp(-tall, tall))
        });
        chart.draw_series(LineSeries::new(model, TONE.mix(0.6).stroke_width(1)))?;
    }
    if scene.one_a_frame {
        let dots = points(&shown);
        chart.draw_series(dots.into_iter().map(|p| Circle::new(p, 2, X_AXIS.filled())))?;
    } else {
        // Nothing is drawn over the blank time between frames.
        for frame in shown.chunk_by(|&a, &b| fit.frames[a] == fit.frames[b]) {
            chart.draw_series(LineSeries::new(points(frame), X_AXIS.stroke_width(1)))?;
        }
    }
    Ok(())
}

fn mesh<B>(
    chart: &mut ChartContext<'_, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>,
    x: &str,
    y: &str,
    tall: f64,
) -> Drawn
where
    B: DrawingBackend,
    B::ErrorType: 'static,
{
    let decimals = (1.0 - tall.log10()).ceil().clamp(0.0, 6.0) as usize;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(GRID)
        .axis_style(INK)
        .label_style(font(14))
        .axis_desc_style(font(15))
        .x_labels(6)
        .y_labels(7)
        .x_desc(x)
        .y_desc(y)
        .y_label_formatter(&|value| format!("{value:.decimals$}"))
        .draw()?;
    Ok(())
}

fn spectrogram<B>(area: &Area<B>, scene: &Scene<'_>) -> Drawn
where
    B: DrawingBackend,
    B::ErrorType: 'static,
{
    let range = amplitude_range(scene);
    let (low, high) = (range.start.log10(), range.end.log10());
    let columns = scene.spectrogram.columns();
    let start = scene.spectrogram.start_s.unwrap_or(0.0);
    let end = scene.spectrogram.end_s.max(start + 1e-3);
    let band = scene.band_hz;
    let mut chart = ChartBuilder::on(area)
        .caption("Amplitude over time and frequency (dark: small)", font(16))
        .margin(12)
        .margin_right(28)
        .x_label_area_size(42)
        .y_label_area_size(70)
        .build_cartesian_2d(start..end, band.0..band.1)?;
    mesh(&mut chart, "time, s", "frequency, Hz", band.1)?;
    let width = (end - start) / columns.len().max(1) as f64;
    for (i, column) in columns.iter().enumerate() {
        let shade = |px: f32| {
            let share = (f64::from(px).max(1e-12).log10() - low) / (high - low);
            (share.clamp(0.0, 1.0) * f64::from(SHADES)).round() as i32
        };
        let x = start + width * i as f64;
        let height = (band.1 - band.0) / column.len().max(1) as f64;
        let shades: Vec<i32> = column.iter().map(|&px| shade(px)).collect();
        let mut from = 0;
        // One rectangle for each run of one shade, a little larger than it is: what comes next covers
        // the rest, and no seam shows between them.
        let seam = (width * 0.1, height);
        for run in shades.chunk_by(|a, b| a == b) {
            let to = from + run.len();
            let y = |row: usize| band.0 + height * row as f64;
            chart.draw_series([Rectangle::new(
                [
                    (x, y(from)),
                    ((x + width + seam.0).min(end), (y(to) + seam.1).min(band.1)),
                ],
                colour(run[0]).filled(),
            )])?;
            from = to;
        }
    }
    Ok(())
}

/// A shade as a colour.
fn colour(number: i32) -> RGBColor {
    shade(f64::from(number) / f64::from(SHADES))
}

/// A share from 0, dark, to 1, bright, as a colour.
pub(super) fn shade(share: f64) -> RGBColor {
    let place = share.clamp(0.0, 1.0) * (MAP.len() - 1) as f64;
    let below = (place as usize).min(MAP.len() - 2);
    let part = place - below as f64;
    let mix = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
    let (a, b) = (MAP[below], MAP[below + 1]);
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}
