//! Shifts of strips of columns in groups of rows, frame by frame.

use std::ops::Range;

use rowtone::camera::{Pixels, Timing};
use rowtone::kernel::{Kernel, MAX_COEFFICIENT};

use super::{Picture, Rect, cut};

/// Strips along a line, and the least width of one, px.
const STRIPS: usize = 32;
const LEAST_PX: usize = 16;
/// Rows that are taken together: those that are read in this time, which is short against the period of what is
/// looked for, ns; but so many.
const GROUP_NS: f64 = 200e3;
const GROUP_ROWS: (f64, f64) = (4.0, 32.0);
/// A strip whose edges all lean one way cannot tell the axes apart: there a motion along the columns is taken for one along
/// the rows, unless this share of what is known is left without it.
const LEAST_UPRIGHT: f32 = 0.1;
/// As many pixels of 8 bits as 16 bits can sum.
const EIGHT_BIT_FRAMES: usize = 257;

/// See the [module](self). What is kept is not the shift but its numerator and denominator: they can be added.
#[derive(Debug)]
pub(super) struct Shifts {
    /// Columns of each strip, rows of each group, in the part.
    pub(super) columns: Vec<Range<usize>>,
    pub(super) groups: Vec<Range<usize>>,
    pub(super) frames: usize,
    /// Start of each frame, and when each group is read after that, s.
    pub(super) starts_s: Vec<f64>,
    pub(super) within_s: Vec<f64>,
    /// Time from one group to the next, s.
    pub(super) step_s: f64,
    /// Σ h·(r − p/g) of each group and frame, strip by strip: h is the slope of the mean r along the row, orthogonal to r, to
    /// 1 and to its slope along the columns, and g the line's brightness.
    pub(super) pulls: Vec<Vec<f32>>,
    /// Σ h·r' of each group, strip by strip: a pull of so much is a shift of 1 px.
    pub(super) grips: Vec<Vec<f32>>,
    /// Variance of a pixel, strip by strip; that of a pull is as many times its grip.
    pub(super) noise: Vec<f64>,
}

impl Shifts {
    /// Of all rows of `part` in these frames, of which there is at least one.
    pub(super) fn measure<P: Picture>(frames: &[P], part: &Rect, timing: &Timing) -> Self {
        let columns = cut(part.width, LEAST_PX, STRIPS);
        let line_ns = f64::from(timing.line_time_ps()) * 1e-3;
        let rows = (GROUP_NS / line_ns).clamp(GROUP_ROWS.0, GROUP_ROWS.1);
        let groups = cut(part.height, rows as usize, usize::MAX);
        let first_ns = frames[0].start_ns();
        let span_ns = frames[frames.len() - 1].start_ns() - first_ns;
        let step_ns = if timing.is_global_shutter() {
            span_ns as f64 / (frames.len() - 1).max(1) as f64
        } else {
            line_ns * part.height as f64 / groups.len() as f64
        };
        let start_s = |f: &P| (f.start_ns() - first_ns) as f64 * 1e-9;
        let within_s = |rows: &Range<usize>| line_ns * (rows.start + rows.end) as f64 * 0.5e-9;
        let samples = groups.len() * frames.len();
        let mut shifts = Self {
            starts_s: frames.iter().map(start_s).collect(),
            within_s: groups.iter().map(within_s).collect(),
            step_s: step_ns * 1e-9,
            frames: frames.len(),
            pulls: vec![vec![0.0; samples]; columns.len()],
            grips: vec![vec![0.0; groups.len()]; columns.len()],
            noise: vec![0.0; columns.len()],
            columns,
            groups,
        };
        let mut row = Row::new(part.width);
        for group in 0..shifts.groups.len() {
            for y in shifts.groups[group].clone() {
                row.learn(frames, part, y);
                shifts.add(frames, part, group, y, &mut row);
            }
        }
        shifts
    }

    /// Time from the first group of the first frame to the last of the last, s.
    pub(super) fn span_s(&self) -> f64 {
        let last = |times: &[f64]| times.last().copied().unwrap_or(0.0);
        last(&self.starts_s) + last(&self.within_s)
    }

    fn add<P: Picture>(
        &mut self,
        frames: &[P],
        part: &Rect,
        group: usize,
        y: usize,
        row: &mut Row,
    ) {
        let models: Vec<Option<Model>> = self.columns.iter().map(|c| row.model(c)).collect();
        for (grips, model) in self.grips.iter_mut().zip(&models) {
            grips[group] += model.map_or(0.0, |m| m.grip);
        }
        for (n, frame) in frames.iter().enumerate() {
            let line = frame.row(part, y);
            let strips = self.columns.iter().zip(&models).zip(&mut self.pulls);
            for ((columns, model), pulls) in strips {
                let Some(model) = model else { continue };
                let (product, sum) = row.sums(line, columns);
                if sum > 0.0 {
                    pulls[group * frames.len() + n] += model.pull(product, sum);
                }
            }
        }
    }
}

/// What is known of a row while its group is taken.
struct Row {
    kernel: Kernel,
    /// Σ of up to [`EIGHT_BIT_FRAMES`] lines, and of all.
    eight_bit: Vec<u16>,
    sums: Vec<u32>,
    /// Means of the row above, of the row itself and of that below.
    means: [Vec<f32>; 3],
    /// Which row it is.
    at: Option<usize>,
    slope: Vec<f32>,
    coefficients: Vec<i8>,
}

/// How a strip's inner product becomes a pull.
#[derive(Clone, Copy, Debug)]
struct Model {
    /// One coefficient in grey values a pixel.
    unit: f32,
    /// Inner product and sum of the mean.
    product: f32,
    sum: f32,
    grip: f32,
}

impl Model {
    fn pull(&self, product: f32, sum: f32) -> f32 {
        (self.product - product * self.sum / sum) * self.unit
    }
}

impl Row {
    fn new(width: usize) -> Self {
        Self {
            kernel: Kernel::detect(),
            eight_bit: vec![0; width],
            sums: vec![0; width],
            means: std::array::from_fn(|_| vec![0.0; width]),
            at: None,
            slope: vec![0.0; width],
            coefficients: vec![0; width],
        }
    }

    /// Takes the mean of row `y` over the frames and its slopes; at the picture's edge that along the row is not known.
    fn learn<P: Picture>(&mut self, frames: &[P], part: &Rect, y: usize) {
        let below = (y + 1).min(part.height - 1);
        if y > 0 && self.at == Some(y - 1) {
            self.means.rotate_left(1);
        } else {
            self.average(frames, part, y.saturating_sub(1), 0);
            self.average(frames, part, y, 1);
        }
        self.average(frames, part, below, 2);
        self.at = Some(y);
        for (s, around) in self.slope.iter_mut().skip(1).zip(self.means[1].windows(3)) {
            *s = (around[2] - around[0]) * 0.5;
        }
    }

    /// The mean of row `y` over the frames, as that of the row above, the row itself or the one below.
    fn average<P: Picture>(&mut self, frames: &[P], part: &Rect, y: usize, which: usize) {
        self.sums.fill(0);
        for frames in frames.chunks(EIGHT_BIT_FRAMES) {
            self.eight_bit.fill(0);
            for frame in frames {
                match frame.row(part, y) {
                    Pixels::U8(p) => {
                        let sums = self.eight_bit.iter_mut().zip(p);
                        sums.for_each(|(s, &p)| *s += u16::from(p));
                    }
                    deep => {
                        let sums = self.sums.iter_mut().zip(deep.values());
                        sums.for_each(|(s, p)| *s += u32::from(p));
                    }
                }
            }
            let sums = self.sums.iter_mut().zip(&self.eight_bit);
            sums.for_each(|(s, &few)| *s += u32::from(few));
        }
        let share = 1.0 / frames.len() as f32;
        for (m, &s) in self.means[which].iter_mut().zip(&self.sums) {
            *m = s as f32 * share;
        }
    }

    /// Coefficients of a strip; `None` where it is evenly lit.
    fn model(&mut self, columns: &Range<usize>) -> Option<Model> {
        let [above, mean, below] = self.means.each_ref().map(|m| &m[columns.clone()]);
        let slope = &self.slope[columns.clone()];
        let n = columns.len() as f32;
        let centre = mean.iter().sum::<f32>() / n;
        let power: f32 = mean.iter().map(|r| (r - centre) * (r - centre)).sum();
        let down: Vec<f32> = (above.iter().zip(below))
            .map(|(a, b)| 0.5 * (b - a))
            .collect();
        let [level, lean] = level_and_lean(slope, mean, centre, power);
        let [down_level, down_lean] = level_and_lean(&down, mean, centre, power);
        let across = |x: usize| slope[x] - level - lean * (mean[x] - centre);
        let along = |x: usize| down[x] - down_level - down_lean * (mean[x] - centre);
        let [mut own, mut both, mut other] = [0.0_f32; 3];
        for x in 0..columns.len() {
            let (h, d) = (across(x), along(x));
            own += h * h;
            both += h * d;
            other += d * d;
        }
        let turn = if other > 0.0 && own - both * both / other > LEAST_UPRIGHT * own {
            both / other
        } else {
            0.0
        };
        let pairs = || (0..columns.len()).map(|x| (across(x) - turn * along(x), mean[x], slope[x]));
        let largest = pairs().map(|(h, ..)| h.abs()).fold(0.0, f32::max);
        let scale = f32::from(MAX_COEFFICIENT) / largest;
        if !scale.is_finite() {
            return None;
        }
        let (mut product, mut grip) = (0.0, 0.0);
        for (c, (h, r, s)) in self.coefficients[columns.clone()].iter_mut().zip(pairs()) {
            *c = (h * scale).round() as i8;
            product += f32::from(*c) * r;
            grip += f32::from(*c) * s;
        }
        Some(Model {
            unit: 1.0 / scale,
            product,
            sum: centre * n,
            grip: grip / scale,
        })
    }

    /// Inner product and sum of a line's strip.
    fn sums(&self, line: Pixels<'_>, columns: &Range<usize>) -> (f32, f32) {
        let coefficients = &self.coefficients[columns.clone()];
        let sums = match line {
            Pixels::U8(p) => self.kernel.sums_u8(&p[columns.clone()], coefficients),
            Pixels::U16(p) => self.kernel.sums_u16(&p[columns.clone()], coefficients),
            Pixels::Upper(p) => {
                let line: Vec<u8> = p.iter().skip(columns.start).take(columns.len()).collect();
                self.kernel.sums_u8(&line, coefficients)
            }
        };
        (sums.product as f32, sums.pixels as f32)
    }
}

/// The mean of a row's slope, and how much of the row itself there is in it.
fn level_and_lean(slope: &[f32], mean: &[f32], centre: f32, power: f32) -> [f32; 2] {
    let level = slope.iter().sum::<f32>() / slope.len().max(1) as f32;
    let pairs = slope.iter().zip(mean);
    let along: f32 = pairs.map(|(s, r)| (r - centre) * s).sum();
    [level, if power > 0.0 { along / power } else { 0.0 }]
}
