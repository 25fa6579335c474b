//! The spectrum of a recording against frequency, as a table: tones, and the noise floor below them.
//!
//! A plain spectrum of samples with gaps shows images of every tone at multiples of the frame rate. So the steady tones
//! of a report are fitted and taken off the window's samples, and put back as lines without images; what is left is
//! transformed as it is. Both under Hann's window, whose side lobes fall fast enough to leave the floor alone. Windows are
//! averaged in power.

mod floor;
mod lines;
mod residual;
mod transform;

use std::collections::VecDeque;

use rowtone::report::Report;
use rowtone::timeline::{Group, Sample};
use rowtone::tracker::Axes;

use residual::{Residual, is_steady};
use transform::Grid;

/// What is left of an amplitude by exposure and averaged rows is not taken for less: near its zeros there is nothing to
/// see, and nothing but noise would be made large.
const LEAST_LEFT: f64 = 0.2;

/// A window shorter than this share of the first one resolves less, and does not join.
const AS_LONG: f32 = 0.9;

/// A spectrum in the making: shown every sample and every report, it keeps the samples of one window.
#[derive(Debug)]
pub struct Periodogram {
    group: Group,
    axes: usize,
    band_hz: (f64, f64),
    /// Start of the recording, ns.
    start_ns: Option<i64>,
    samples: VecDeque<Sample>,
    sums: Option<Sums>,
}

/// What windows add up to.
#[derive(Debug)]
struct Sums {
    window_s: f32,
    grid: Grid,
    axes: [AxisSums; 2],
}

/// Along one axis: mean squares at each place of the grid, px².
#[derive(Debug, Default)]
struct AxisSums {
    windows: u32,
    amplitude: Vec<f64>,
    floor: Vec<f64>,
}

/// Amplitudes along one axis, px, one for each frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisSpectrum {
    /// Zero-to-peak amplitude that a sinusoid of this frequency has, the exposure's averaging undone; the root of the mean
    /// square over all windows.
    pub amplitude_px: Vec<f64>,
    /// The same of the noise alone: the root of its mean square over the band around. Times √(window/3) it is the one-sided
    /// amplitude density, px/√Hz.
    pub floor_px: Vec<f64>,
}

/// The spectrum of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// Frequencies, Hz, evenly spaced: eight to a cell of 1/window, fewer for very long windows.
    pub hz: Vec<f64>,
    /// Along x and along y; `None` where nothing is known.
    pub axes: [Option<AxisSpectrum>; 2],
}

impl Periodogram {
    /// A spectrum of samples of these groups, over a band of frequencies, Hz.
    pub fn new(group: Group, axes: Axes, band_hz: (f64, f64)) -> Self {
        Self {
            group,
            axes: if axes == Axes::X { 1 } else { 2 },
            band_hz,
            start_ns: None,
            samples: VecDeque::new(),
            sums: None,
        }
    }

    /// Says when the recording started, ns: reports count from there.
    pub fn start(&mut self, start_ns: i64) {
        self.start_ns.get_or_insert(start_ns);
    }

    /// Shows it a sample.
    pub fn sample(&mut self, sample: &Sample) {
        self.samples.push_back(*sample);
    }

    /// Shows it the report of a window; the samples of that window must have been shown.
    pub fn report(&mut self, report: &Report) {
        let end_s = report.time_ms as f64 * 1e-3;
        let origin = self.start_ns.unwrap_or(0);
        let at = |s: f64| origin + (s * 1e9) as i64;
        let first = at(end_s - f64::from(report.window_s));
        while self.samples.front().is_some_and(|s| s.time_ns < first) {
            self.samples.pop_front();
        }
        let last = at(end_s + 1e-3);
        let known = self.samples.iter().take_while(|s| s.time_ns <= last);
        let window: Vec<Sample> = known.copied().collect();
        if window.is_empty() || report.window_s <= 0.0 {
            return;
        }
        let sums = self.sums.get_or_insert_with(|| Sums {
            window_s: report.window_s,
            grid: Grid::new(report.window_s.into(), self.band_hz),
            axes: Default::default(),
        });
        if report.window_s < AS_LONG * sums.window_s {
            return;
        }
        for (axis, sums_of) in sums.axes.iter_mut().enumerate().take(self.axes) {
            if let Some(residual) = Residual::new(&window, report, axis) {
                let left = |hz| left(&self.group, hz);
                sums_of.add(&sums.grid, &residual, report, (axis, left));
            }
        }
    }

    /// What was seen so far; `None` before the first report of measured samples.
    pub fn spectrum(&self) -> Option<Spectrum> {
        let sums = self.sums.as_ref()?;
        let hz = sums.grid.frequencies();
        let axes = sums.axes.each_ref().map(|axis| {
            let px = |squares: &[f64]| -> Vec<f64> {
                let each = squares.iter().zip(&hz);
                each.map(|(square, &hz)| {
                    (square / f64::from(axis.windows)).sqrt() / left(&self.group, hz)
                })
                .collect()
            };
            (axis.windows > 0).then(|| AxisSpectrum {
                amplitude_px: px(&axis.amplitude),
                floor_px: px(&axis.floor),
            })
        });
        axes.iter()
            .any(Option::is_some)
            .then_some(Spectrum { hz, axes })
    }
}

/// What exposure and averaged rows leave of an amplitude.
fn left(group: &Group, hz: f64) -> f64 {
    f64::from(group.attenuation(hz as f32)).max(LEAST_LEFT)
}

impl AxisSums {
    /// Adds a window: the squares of what is left of it, the noise among them, and its steady tones.
    fn add(
        &mut self,
        grid: &Grid,
        residual: &Residual,
        report: &Report,
        (axis, left): (usize, impl Fn(f64) -> f64),
    ) {
        let hz = grid.frequencies();
        let window_s = f64::from(report.window_s);
        let mut squares = grid.squares(residual);
        let fps = if residual.one_a_frame {
            0.0
        } else {
            report.fps.into()
        };
        let floor = floor::levels(&hz, &squares, window_s, fps);
        for peak in report.peaks.iter().filter(|peak| is_steady(peak)) {
            let px = lines::along_px(peak, axis);
            for (square, &hz) in squares.iter_mut().zip(&hz) {
                let away_hz = hz - f64::from(peak.hz);
                *square += (px * left(hz) * lines::hann(away_hz, window_s)).powi(2);
            }
        }
        self.windows += 1;
        for (sums, squares) in [(&mut self.amplitude, squares), (&mut self.floor, floor)] {
            sums.resize(hz.len(), 0.0);
            sums.iter_mut().zip(squares).for_each(|(sum, s)| *sum += s);
        }
    }
}

#[cfg(test)]
mod tests;
