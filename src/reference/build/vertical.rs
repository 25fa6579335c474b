//! From a row of the reference and the rows next to it to the coefficients of its second inner product.
//!
//! The first product's coefficients h are made of ∂r/∂x, these of ∂r/∂y: weighted by the inverse variance, freed of the
//! reference's noise, and made orthogonal to r and to light that changes smoothly along the row ([`SmoothLight`]), and then to
//! the row's answer to a shift along x,
//!
//! ```text
//! h' ← h' − γ·h,      γ = Σ h'·∂r/∂x / Σ h·∂r/∂x,
//! ```
//!
//! so that the second product tells of y alone, with noise that is not the first one's: the Cholesky factor of the 2x2
//! information ([`Vertical`](crate::timeline::Vertical)). Eight bits then hold what is left of ∂r/∂y where the edges lean.
//!
//! What both products answer to a shift is not taken from the filters but measured, by correlation at whole shifts as in
//! [`Build`]: along y with the rows next to it, and so are the terms of second and third order that a shift of half a pixel
//! needs. ∂r/∂y is made of other rows than the row itself, so only one of the four
//! answers, h' to y, has the reference's noise in it; h' to x has that of what γ brought in.

use super::super::static_pixels::LEFT_OUT;
use super::smooth_light::SmoothLight;
use super::{Build, LAGS, Step, WORST_SD_PX, correlation, inverse};
use crate::reference::{
    Recipe, RowTable, Two, VerticalTable,
    band::{DERIVATIVE, HALFWAY, SLOPE},
};
use core::ops::Range;

/// A row with fewer rows of its colour above or below it knows nothing of y.
const LEAST_ROWS: usize = 2;

/// A column of a correlation, of two products here, is so many times less work than one of another step, and one whose slope is
/// asked for so many times more.
const CORRELATED: usize = 2;
const SLOPED: usize = 4;

/// The central differences of fourth to eighth order, and the values half-way between whole shifts (Fornberg 1988, tables 1
/// and 2): for rows near the picture's edge, which have so few rows beside them.
const DERIVATIVES: [&[f32]; 4] = [
    &[2.0 / 3.0, -1.0 / 12.0],
    &[3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0],
    &[4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0],
    &DERIVATIVE,
];
const HALFWAYS: [&[f32]; 4] = [
    &[9.0 / 16.0, -1.0 / 16.0],
    &[150.0 / 256.0, -25.0 / 256.0, 3.0 / 256.0],
    &[
        1225.0 / 2048.0,
        -245.0 / 2048.0,
        49.0 / 2048.0,
        -5.0 / 2048.0,
    ],
    &[
        39690.0 / 65536.0,
        -8820.0 / 65536.0,
        2268.0 / 65536.0,
        -405.0 / 65536.0,
        35.0 / 65536.0,
    ],
];

/// The buffers of one row's second product.
#[derive(Debug)]
pub struct VerticalParts<'a> {
    /// The whole reference picture, row by row, in counts.
    pub picture: &'a [u16],
    /// Which of its rows.
    pub row: usize,
    /// Weight of each column, 0 = unused.
    pub mask: &'a [u8],
    /// The first product's coefficients, as they are.
    pub first: &'a [i8],
    /// Scratch of two rows, kept from one call of [`VerticalBuild::advance`] to the next.
    pub scratch: &'a mut [f32],
    /// What is built.
    pub coefficients: &'a mut [i8],
}

impl<'a> VerticalParts<'a> {
    fn width(&self) -> usize {
        self.mask.len()
    }

    fn row(&self, row: usize) -> &'a [u16] {
        let first = row * self.width();
        let row = self.picture.get(first..first + self.width());
        row.unwrap_or_default()
    }

    /// The row so many steps below; above where negative.
    fn beside(&self, steps: isize, stride: usize) -> &'a [u16] {
        let row = self.row.checked_add_signed(steps * stride as isize);
        row.map_or(&[], |row| self.row(row))
    }
}

/// Which step comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum VerticalStep {
    /// As of [`Build`], up to its quantisation.
    Prepare(Step),
    /// Σ h'·∂r/∂x.
    Lean,
    /// h' ← h' − γ·h.
    Straighten,
    Quantise,
    Settle,
    /// Σ h'·r and Σ h·r of the rows beside, so many steps below the first of them.
    Correlate(usize),
    /// Both with the rows next to it, a step to either side.
    Mixed(usize),
    /// Σ h'·r of the row itself, so many steps from −LAGS on.
    Across(usize),
    /// What rounding left of the answer to x.
    Leak,
}

/// The work on one row's second product, begun and not yet ended.
#[derive(Clone, Copy, Debug)]
pub struct VerticalBuild {
    build: Build,
    light: SmoothLight,
    table: RowTable,
    step: VerticalStep,
    column: usize,
    /// Rows of its colour on either side that are used.
    reach: usize,
    /// Σ h'·∂r/∂x, and what γ came to, in units of the first product's coefficients.
    lean: f32,
    gamma: f32,
    /// Σ h·r(y − k) for k = −LAGS ..= LAGS steps.
    first_q: [f32; 2 * LAGS + 1],
    /// Σ h'·r(x − k) for k = −LAGS ..= LAGS steps.
    across_q: [f32; 2 * LAGS + 1],
    /// What both answer to a step along both axes, of the first and of the second product.
    mixed: [f32; 2],
    /// What the second product answers to x all the same, in its own units.
    leak: f32,
}

impl VerticalBuild {
    /// So many rows of its colour on either side are enough.
    pub(crate) const fn is_enough(reach: usize) -> bool {
        reach >= LEAST_ROWS
    }

    /// More rows of its colour on either side are not used.
    pub(crate) const MOST_REACH: usize = LAGS;

    /// The same, without these pixels and what the band's filter mixes with them.
    pub(in crate::reference) fn without(mut self, left_out: [u16; LEFT_OUT]) -> Self {
        self.build = self.build.without(left_out);
        self
    }

    /// Begins a row whose first product has this table. `frames`: of how many frames a mean has as much
    /// noise as the reference; `reach`: rows of its colour on either side that are known.
    pub fn new(recipe: &Recipe, frames: f32, table: RowTable, reach: usize) -> Self {
        Self {
            build: Build::new(recipe, frames),
            light: SmoothLight::default(),
            table,
            step: VerticalStep::Prepare(Step::Weigh),
            column: 0,
            reach: reach.min(LAGS),
            lean: 0.0,
            gamma: 0.0,
            first_q: [0.0; 2 * LAGS + 1],
            across_q: [0.0; 2 * LAGS + 1],
            mixed: [0.0; 2],
            leak: 0.0,
        }
    }

    /// Builds a row's second product in one go.
    pub fn all(mut self, parts: &mut VerticalParts<'_>) -> VerticalTable {
        loop {
            if let Some(table) = self.advance(usize::MAX, parts) {
                return table;
            }
        }
    }

    /// Does the next `columns` columns of the present step, as [`Build::advance`]. Buffers of the wrong size, and rows next
    /// to the picture's edge, make a table that knows nothing of y.
    pub fn advance(
        &mut self,
        columns: usize,
        parts: &mut VerticalParts<'_>,
    ) -> Option<VerticalTable> {
        let width = parts.width();
        let mean = parts.row(parts.row);
        let fits = mean.len() == width
            && parts.first.len() == width
            && parts.scratch.len() == 2 * width
            && parts.coefficients.len() == width;
        if !fits || !Self::is_enough(self.reach) {
            parts.coefficients.fill(0);
            return Some(VerticalTable::EMPTY);
        }
        // A column of some steps takes as long as several of the others, of some half as long.
        let columns = match self.step {
            VerticalStep::Lean | VerticalStep::Leak => columns.div_ceil(SLOPED),
            VerticalStep::Correlate(_) | VerticalStep::Mixed(_) | VerticalStep::Across(_) => {
                columns.saturating_mul(CORRELATED)
            }
            _ => columns,
        };
        let span = self.column..self.column.saturating_add(columns.max(1)).min(width);
        self.column = span.end;
        let ended = span.end == width;
        let next = match self.step {
            VerticalStep::Prepare(step) => self.prepare(step, span, ended, parts),
            VerticalStep::Lean => {
                self.lean += self.add_slopes(span, parts, |h, _| h);
                if ended {
                    let per_product = self.table.px_per_product;
                    self.gamma = self.lean * per_product;
                    self.build.largest = 0.0;
                }
                VerticalStep::Straighten
            }
            VerticalStep::Straighten => {
                self.straighten(span, parts);
                VerticalStep::Quantise
            }
            VerticalStep::Quantise => {
                let (w, h) = parts.scratch.split_at(width);
                self.build.quantise(span, mean, w, h, parts.coefficients);
                VerticalStep::Settle
            }
            VerticalStep::Settle => {
                if !self.build.settle(parts.coefficients) {
                    parts.coefficients.fill(0);
                }
                self.go_on_with(VerticalStep::Correlate(0));
                return None;
            }
            VerticalStep::Correlate(lag) => {
                self.correlate(lag, &span, parts);
                match lag < 2 * self.reach {
                    true => VerticalStep::Correlate(lag + 1),
                    false => VerticalStep::Mixed(0),
                }
            }
            VerticalStep::Mixed(corner) => {
                self.correlate_mixed(corner, &span, parts);
                match corner < 3 {
                    true => VerticalStep::Mixed(corner + 1),
                    false => VerticalStep::Across(0),
                }
            }
            VerticalStep::Across(lag) => {
                let steps = lag as isize - LAGS as isize;
                let q =
                    correlation_within(&self.build.recipe, mean, parts.coefficients, steps, span);
                if let Some(slot) = self.across_q.get_mut(lag) {
                    *slot += q;
                }
                match lag < 2 * LAGS {
                    true => VerticalStep::Across(lag + 1),
                    false => VerticalStep::Leak,
                }
            }
            VerticalStep::Leak => {
                let scale = self.build.scale();
                self.leak += self.add_slopes(span, parts, |h, kept| f32::from(kept) - scale * h);
                if ended {
                    return Some(self.expand());
                }
                VerticalStep::Leak
            }
        };
        if ended {
            self.go_on_with(next);
        }
        None
    }

    fn go_on_with(&mut self, step: VerticalStep) {
        (self.step, self.column) = (step, 0);
    }

    /// The steps that are those of the first product.
    fn prepare(
        &mut self,
        step: Step,
        span: Range<usize>,
        ended: bool,
        parts: &mut VerticalParts<'_>,
    ) -> VerticalStep {
        let mean = parts.row(parts.row);
        let width = mean.len();
        if step == Step::Derive {
            self.derive(span, parts);
            return VerticalStep::Prepare(Step::DropNoise);
        }
        let half = self.derivative();
        let (w, h) = parts.scratch.split_at_mut(width);
        let build = &mut self.build;
        match step {
            Step::Weigh => {
                build.weigh(span, mean, parts.mask, w);
                VerticalStep::Prepare(Step::Derive)
            }
            Step::DropNoise => {
                build.drop_noise(half, span, mean, w, h);
                VerticalStep::Prepare(Step::Balance)
            }
            Step::Balance => {
                self.balance(span, mean, w, h);
                if ended {
                    self.light.solve(width);
                }
                VerticalStep::Prepare(Step::Orthogonalise)
            }
            _ => {
                self.orthogonalise(span, mean, w, h);
                VerticalStep::Lean
            }
        }
    }

    fn balance(&mut self, span: Range<usize>, mean: &[u16], w: &[f32], h: &[f32]) {
        let (width, centre) = (mean.len(), self.build.centre(mean.len()));
        for x in span {
            let (Some(&count), Some(&w), Some(&h)) = (mean.get(x), w.get(x), h.get(x)) else {
                return;
            };
            if h != 0.0 {
                let r = self.build.value(count) - centre;
                self.light.add(x, width, [w, r, h]);
            }
        }
    }

    /// h' ← h' − w·(smooth light + β·r).
    fn orthogonalise(&mut self, span: Range<usize>, mean: &[u16], w: &[f32], h: &mut [f32]) {
        let (width, centre) = (mean.len(), self.build.centre(mean.len()));
        for x in span {
            let (Some(&count), Some(&w), Some(h)) = (mean.get(x), w.get(x), h.get_mut(x)) else {
                return;
            };
            if *h != 0.0 {
                *h -= w * self.light.at(x, width, self.build.value(count) - centre);
            }
        }
    }

    /// The derivative's right half: the band's own where there are rows enough for it.
    fn derivative(&self) -> &'static [f32] {
        let own = self.build.recipe.level.half_filter();
        match DERIVATIVES.get(self.reach.saturating_sub(LEAST_ROWS)) {
            Some(fewer) if self.reach < own.len() => fewer,
            _ => own,
        }
    }

    /// h' ← −w · ∂r/∂y.
    fn derive(&self, span: Range<usize>, parts: &mut VerticalParts<'_>) {
        let recipe = &self.build.recipe;
        let width = parts.width();
        for (k, &f) in (1..).zip(self.derivative()) {
            let f = -f / recipe.counts_per_value;
            let (above, below) = (
                parts.beside(-k, recipe.stride),
                parts.beside(k, recipe.stride),
            );
            let (w, h) = parts.scratch.split_at_mut(width);
            let (Some(w), Some(h), Some(above), Some(below)) = (
                w.get(span.clone()),
                h.get_mut(span.clone()),
                above.get(span.clone()),
                below.get(span.clone()),
            ) else {
                return;
            };
            if k == 1 {
                h.fill(0.0);
            }
            for (((h, &w), &above), &below) in h.iter_mut().zip(w).zip(above).zip(below) {
                *h += w * f * (f32::from(below) - f32::from(above));
            }
        }
    }

    /// Σ of what `of` makes of h' and what is kept of it, times −∂r/∂x, with the slope that the first product is measured by.
    fn add_slopes(
        &self,
        span: Range<usize>,
        parts: &VerticalParts<'_>,
        of: impl Fn(f32, i8) -> f32,
    ) -> f32 {
        let mean = parts.row(parts.row);
        let stride = self.build.recipe.stride;
        let h = parts.scratch.get(parts.width()..).unwrap_or_default();
        let mut sum = 0.0;
        for x in span {
            let (Some(&h), Some(&kept)) = (h.get(x), parts.coefficients.get(x)) else {
                break;
            };
            if h == 0.0 {
                continue;
            }
            let mut slope = 0.0;
            for (k, f) in (1..).zip(SLOPE) {
                let by = k * stride;
                let left = x.checked_sub(by).and_then(|x| mean.get(x));
                if let (Some(&right), Some(&left)) = (mean.get(x + by), left) {
                    slope += f * (f32::from(right) - f32::from(left));
                }
            }
            // The picture moved to the right is r − d·∂r/∂x.
            sum -= of(h, kept) * slope;
        }
        sum * self.build.per_count / stride as f32
    }

    fn straighten(&mut self, span: Range<usize>, parts: &mut VerticalParts<'_>) {
        let width = parts.width();
        let (Some(h), Some(first)) = (
            parts
                .scratch
                .get_mut(width..)
                .and_then(|h| h.get_mut(span.clone())),
            parts.first.get(span),
        ) else {
            return;
        };
        let mut largest = self.build.largest.to_bits();
        for (h, &first) in h.iter_mut().zip(first) {
            *h -= self.gamma * f32::from(first);
            largest = largest.max(h.abs().to_bits());
        }
        self.build.largest = f32::from_bits(largest);
    }

    fn correlate(&mut self, lag: usize, span: &Range<usize>, parts: &VerticalParts<'_>) {
        let recipe = &self.build.recipe;
        let steps = lag as isize - self.reach as isize;
        // The picture moved down by so many steps.
        let row = parts.beside(-steps, recipe.stride);
        let place = (LAGS + lag).wrapping_sub(self.reach);
        if let (Some(own), Some(first)) = (self.build.q.get_mut(place), self.first_q.get_mut(place))
        {
            *own += correlation(recipe, row, parts.coefficients, 0, span);
            *first += correlation(recipe, row, parts.first, 0, span);
        }
    }

    /// The picture moved by a step along both axes, to the right and down or to the left and up: they count, and the two
    /// other ways they are taken off.
    fn correlate_mixed(&mut self, corner: usize, span: &Range<usize>, parts: &VerticalParts<'_>) {
        let recipe = &self.build.recipe;
        let (right, down) = (2 * (corner & 1) as isize - 1, (corner & 2) as isize - 1);
        let row = parts.beside(-down, recipe.stride);
        let sign = if right == down { 1.0 } else { -1.0 };
        for (sum, h) in self
            .mixed
            .iter_mut()
            .zip([parts.first, &*parts.coefficients])
        {
            *sum += sign * correlation_within(recipe, row, h, right, span.clone());
        }
    }

    /// Takes the reference's own noise off what the second product answers to x, where γ brought it in: how much it is, the
    /// slope tells.
    fn drop_own_noise(&mut self) {
        let (q, mut slope, mut of_noise) = (&mut self.across_q, 0.0, 0.0);
        let half = self.build.recipe.level.half_filter();
        for (k, f) in (1..).zip(SLOPE) {
            slope += f * (q[LAGS + k] - q[LAGS - k]);
            of_noise += 2.0 * f * half.get(k - 1).unwrap_or(&0.0);
        }
        let noise = (slope - self.leak * self.build.recipe.stride as f32) / of_noise;
        for (k, f) in (1..).zip(half) {
            q[LAGS + k] -= f * noise;
            q[LAGS - k] += f * noise;
        }
    }

    /// The table, from all answers.
    fn expand(&mut self) -> VerticalTable {
        let recipe = &self.build.recipe;
        let stride = recipe.stride as f32;
        let frames = self.build.frames;
        // As in `Build::expand`; of the rows beside.
        for (k, &f) in (1..).zip(self.derivative()) {
            let noise = f * self.build.weight_power / frames;
            if k <= self.reach {
                self.build.q[LAGS + k] -= noise;
                self.build.q[LAGS - k] += noise;
            }
        }
        let slopes = match DERIVATIVES.get(self.reach - LEAST_ROWS) {
            Some(fewer) => *fewer,
            None => &SLOPE[..],
        };
        let slope_of = |q: &[f32; 2 * LAGS + 1]| {
            let pairs = (1..).zip(slopes);
            pairs
                .map(|(k, f)| f * (q[LAGS + k] - q[LAGS - k]))
                .sum::<f32>()
                / stride
        };
        self.drop_own_noise();
        let q = &self.build.q;
        let (slope, first_slope) = (slope_of(q), slope_of(&self.first_q));
        let halfway = match HALFWAYS.get(self.reach - LEAST_ROWS) {
            Some(fewer) => *fewer,
            None => &HALFWAY[..],
        };
        let per_first = match self.table.has_texture() {
            true => self.table.px_per_product,
            false => 0.0,
        };
        let coupling = first_slope * per_first;
        let [right, left] = at_halves(&self.first_q, halfway).map(|v| v * per_first);
        let mut table = VerticalTable {
            coupling_and_leak: Two::new(coupling, 0.0),
            first_of_down: bends(right, left, coupling, stride),
            mixed: Two::new(0.25 * self.mixed[0] * per_first / (stride * stride), 0.0),
            ..VerticalTable::EMPTY
        };
        let noise_power = self.build.noise_power;
        let information = slope * slope / noise_power;
        let chance = crate::kernel::sqrtf(noise_power / frames) * 3.0;
        // What lies across the edges of a row that all lean alike is the first product's alone; what filters that are not quite
        // derivatives, and terms of second order, leave of it here would pass for a motion along them.
        let across = self.table.information_per_px2() * (1.0 + coupling * coupling);
        let sure = slope > chance
            && information > LEAST_SHARE * across
            && information * WORST_SD_PX * WORST_SD_PX >= LEAST_INFORMATION;
        if !sure || !information.is_finite() {
            return table;
        }
        let [right, left] = at_halves(q, halfway).map(|v| v / slope);
        let (quadratic, cubic) = inverse(right, left, stride);
        let [right, left] = at_halves(&self.across_q, &HALFWAY).map(|v| v / slope);
        let answer = self.leak / slope;
        table.px_per_product = 1.0 / slope;
        table.information_and_offset = Two::new(information, q[LAGS] / slope);
        table.coupling_and_leak = Two::new(coupling, self.leak / slope);
        table.quadratic_and_cubic = Two::new(quadratic, cubic);
        table.second_of_right = bends(right, left, answer, stride);
        let [first, second] = self.mixed.map(|v| 0.25 * v / (stride * stride));
        table.mixed = Two::new(first * per_first, second / slope);
        table
    }
}

/// What a correlation function at whole steps comes to half a step to either side, less what it is at rest.
fn at_halves(q: &[f32; 2 * LAGS + 1], halfway: &[f32]) -> [f32; 2] {
    [LAGS, LAGS - 1].map(|left| {
        let pairs = (0..).zip(halfway);
        let value: f32 = pairs
            .map(|(k, f)| f * (q[left - k] + q[left + 1 + k]))
            .sum();
        value - q[LAGS]
    })
}

/// The coefficients of d² and d³ of an answer of this slope that comes to this half a step to either side.
fn bends(right: f32, left: f32, slope: f32, stride: f32) -> Two {
    let half = 0.5 * stride;
    let quadratic = 0.5 * (right + left) / (half * half);
    let cubic = (0.5 * (right - left) - slope * half) / (half * half * half);
    Two::new(quadratic.clamp(-4.0, 4.0), cubic.clamp(-4.0, 4.0))
}

/// [`correlation`] over the columns of `span` that the row and the shifted row share.
fn correlation_within(
    recipe: &Recipe,
    mean: &[u16],
    h: &[i8],
    steps: isize,
    span: Range<usize>,
) -> f32 {
    let shared = mean
        .len()
        .saturating_sub(steps.unsigned_abs() * recipe.stride);
    correlation(
        recipe,
        mean,
        h,
        steps,
        &(span.start.min(shared)..span.end.min(shared)),
    )
}

/// Least information along the edges, as a share of that across them.
const LEAST_SHARE: f32 = 1e-2;

/// A row may know of y that much less than of x and still be of use, in units of what [`WORST_SD_PX`] asks for.
const LEAST_INFORMATION: f32 = 0.25;

#[cfg(test)]
mod tests;
