//! Both axes from every row.
//!
//! A row that moves by (x, y) answers its first inner product by x + κ·y and its second by y ([`Vertical`]). Where the rows
//! before lead along the columns is taken off the first one's answer before anything is made of it, so that a line is found,
//! checked and unsmeared as one that moves along its row alone; what was taken off is put back at the end. Rows are never
//! solved one by one: what leads downwards is the mean of the second products of the last rows, by their information, and
//! serves only for terms that are small.
//!
//! Terms of second order are each row's own, and so are those of third order along one axis. The others are small; a
//! texture of no preferred direction answers to both shifts as if it were weakened by 1 − (b_x·x² + b_y·y²), b = curvature/6, along either axis (an isotropic spectrum's fourth moments: ⟨k_x⁴⟩ = 3⟨k_x²·k_y²⟩).

use super::{
    Bins, Place, Rejected, Stage, Tracker,
    correlate::whole_sums,
    overlap::{Overlap, nearest_step},
    predict::Prediction,
    print,
    residual::Residual,
    row::{Row, Summed},
    schedule::FastRows,
    vetting::UNLIT,
};
use crate::{
    camera::Line,
    camera::pixel::Pixel,
    reference::{RowTable, VerticalTable, at_least_1},
    timeline::{Begin, Displacement, RowShift, Vertical},
};

/// Weight of what was known of the motion along the columns a row ago.
const KEEP: f32 = 0.75;
/// A row's place is no surer from the rows before it than this, 1/px²: 0.03 px, as the picture moves on.
const MOST_INFORMATION: f32 = 1e3;
/// Beyond this the rows' expansions say nothing, px.
const MOST_PX: f32 = 1.0;
/// A row that reads a place further than this, and so many standard deviations, from the row of the reference that it is read
/// against says nothing: it shows something else, and expansions make of that whatever they like.
const NONSENSE_PX: f32 = 2.0 * MOST_PX;
const NONSENSE_SD: f32 = 6.0;
/// A line further from its row of the reference than this, in steps from one row of its colour to the next, is read against
/// the next one.
const NEAR_STEPS: f32 = 0.6;
/// A picture that moves along the columns by no more than this is expected in a frame where the one before ended, px.
const SMALL_PX: f32 = 0.4;
/// Else it is looked for by the first rows of a frame, so many steps either way.
const SOUGHT_STEPS: usize = 4;
const SOUGHT: usize = 2 * SOUGHT_STEPS + 1;
const SEEKING_ROWS: u8 = 3;
/// In the second round of learning, what a row knows of its place that looks for it, 1/px²: a fifth of a pixel.
const SEEKING_INFORMATION: f32 = 25.0;
/// Columns that are compared then.
const SOUGHT_COLUMNS: usize = 48;

/// What measuring along both axes remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Planar {
    /// Where rows lead along the columns, px, and what is known of that, 1/px².
    down_px: f32,
    information: f32,
    /// Where the present line seems to be along the columns, px.
    near_px: f32,
    /// A sixth of the curvatures along x and y, 1/px².
    bend: [f32; 2],
    /// By how many whole rows the picture lies below its reference; `down_px` and `near_px` come on top.
    whole: i32,
    /// The row of the reference that the present line is read against.
    read_row: Option<usize>,
    /// Furthest that it was along the columns of late, and in this frame, px.
    range_px: [f32; 2],
    /// What the first rows of this frame leave over at each place that is tried, and how many did.
    sought: [f32; SOUGHT],
    seeking: u8,
    /// Rows that take the fast path.
    pub(super) fast: FastRows,
    /// What the last line that was measured came to.
    first: Place,
    vertical: Vertical,
}

/// Where a line seems to be along the columns.
#[derive(Clone, Copy, Debug)]
struct Near {
    px: f32,
    /// How much of that its first product takes for a shift to the right, px.
    lean_px: f32,
    /// What will be known then of where rows lead, 1/px².
    information: f32,
}

impl Planar {
    /// Where the present line is along the columns, px.
    pub(super) fn near_down_px(&self) -> f32 {
        self.near_px
    }

    /// The same with all whole rows, px.
    pub(super) fn total_down_px(&self) -> f32 {
        self.whole as f32 + self.down_px
    }

    /// The line is read against its own row.
    pub(super) fn is_here(&self) -> bool {
        self.whole == 0
    }

    /// The row of the reference that the present line is read against; `None` where it is not in the picture.
    pub(super) fn read_row(&self) -> Option<usize> {
        self.read_row
    }

    /// A frame begins; where the motion along the columns is large, its first rows look for the picture.
    pub(super) fn begin_frame(&mut self) {
        let [of_late, last] = self.range_px;
        let keep = 0.95 * of_late;
        self.range_px = [if last > keep { last } else { keep }, 0.0];
        self.sought = [0.0; SOUGHT];
        self.seeking = if self.range_px[0] > SMALL_PX {
            SEEKING_ROWS
        } else {
            0
        };
    }

    /// The rows have been built again: their `curvatures_per_px2` along x and y.
    pub(super) fn end_round(&mut self, curvatures_per_px2: [f32; 2]) {
        *self = Self {
            bend: curvatures_per_px2.map(|c| (c / 6.0).clamp(0.0, 1.0)),
            ..Self::default()
        };
    }

    /// A line of this row whose second product, at the reference's brightness, is `second`, while it is about `right_px` from
    /// the whole shift that it is read at: where it seems to be along the columns, and what is known of that.
    #[inline(always)]
    fn approach(&self, right_px: f32, second: f32, table: &VerticalTable) -> Near {
        let seen = table.shift_px(second, [right_px, self.down_px]);
        let own = table.information_per_px2();
        let before = self.information * KEEP;
        let before = if before < MOST_INFORMATION {
            before
        } else {
            MOST_INFORMATION
        };
        let information = before + own;
        // Of a row that knows nothing nothing comes.
        let px = self.down_px + (seen - self.down_px) * (own / at_least_1(information));
        Near {
            px,
            lean_px: table.lean_px([right_px, px]),
            information,
        }
    }

    /// Before anything is known of a line: it is where those before led.
    fn expect(&self, right_px: f32, table: &VerticalTable) -> Near {
        Near {
            px: self.down_px,
            lean_px: table.lean_px([right_px, self.down_px]),
            information: self.information,
        }
    }

    /// The line fits.
    #[inline(always)]
    fn accept(&mut self, near: Near) {
        (self.near_px, self.information) = (near.px, near.information);
        // What is no number is not near either.
        let near = self.near_px.abs() <= MOST_PX;
        self.down_px = if near { self.near_px } else { 0.0 };
        let far = self.total_down_px().abs();
        if far > self.range_px[1] {
            self.range_px[1] = far;
        }
    }

    /// The next line is read against the row that is nearest.
    fn step(&mut self, stride: u8) {
        let step = f32::from(stride);
        let steps = if self.down_px > NEAR_STEPS * step {
            1
        } else if self.down_px < -NEAR_STEPS * step {
            -1
        } else {
            return;
        };
        self.whole += steps * i32::from(stride);
        self.down_px -= steps as f32 * step;
    }

    /// What both products of a line say. `upright_px`: what the first one read as if the line had moved along its row alone,
    /// from the whole shift nearest to it on; `second`: the second product at the reference's brightness.
    #[inline(always)]
    fn settle(
        &self,
        upright_px: f32,
        near_px: f32,
        second: f32,
        table: &VerticalTable,
    ) -> (f32, Vertical) {
        let near = [upright_px, near_px];
        let [square_x, square_y] = near.map(|v| v * v);
        let coupling = table.coupling();
        let lean = coupling * near_px;
        let [bend_x, bend_y] = self.bend;
        let right = upright_px * (1.0 + bend_y * square_y) + 3.0 * bend_x * square_x * lean;
        let down = table.shift_px(second, near) + near_px * bend_x * square_x;
        let vertical = Vertical {
            shift_px: down,
            information_per_px2: table.information_per_px2(),
            coupling,
            ..Vertical::default()
        };
        (right + lean, vertical)
    }
}

impl Tracker<'_> {
    /// The row of the reference that a line is read against, after it was looked for where that is needed; `None` where it is
    /// not in the picture. Along the rows alone, it is the line's own.
    pub(super) fn reference_row<P: Pixel>(&mut self, row: usize, pixels: &[P]) -> Option<usize> {
        if self.planar.seeking > 0 && self.may_seek(row) {
            self.seek(row, pixels);
        }
        let planar = &mut self.planar;
        planar.near_px = planar.down_px;
        let row = row.checked_add_signed(-(planar.whole as isize));
        planar.read_row = row.filter(|&row| row < self.store.rows());
        planar.read_row
    }

    /// The picture may be looked for by this row. In the second round of learning it must know its place along the columns:
    /// what a row finds that fits anywhere would be learned, and all later frames be measured against it.
    fn may_seek(&self, row: usize) -> bool {
        let knows = |t: &VerticalTable| t.information_per_px2() > SEEKING_INFORMATION;
        self.stage != Stage::Refining || self.store.vertical_table(row).is_some_and(knows)
    }

    /// Looks for a picture that moves by whole rows.
    #[cold]
    #[inline(never)]
    fn seek<P: Pixel>(&mut self, row: usize, pixels: &[P]) {
        let stride = i32::from(self.config.stride);
        let shift_px = self.prediction.at(row);
        let to_reference = self.light.to_reference;
        let mut sought = self.planar.sought;
        for (steps, left) in (-(SOUGHT_STEPS as i32)..).zip(&mut sought) {
            let there = row.checked_add_signed(-(steps * stride) as isize);
            let residual = there.and_then(|there| {
                let (store, place_px) = (&self.store, [shift_px, 0.0]);
                Residual::of::<false, P>(
                    store,
                    there,
                    pixels,
                    place_px,
                    to_reference,
                    SOUGHT_COLUMNS,
                )
            });
            // A place that is not in the picture is none.
            *left += residual.map_or(f32::MAX, |r| r.power.min(1e6));
        }
        let planar = &mut self.planar;
        planar.sought = sought;
        planar.seeking -= 1;
        let middle = sought[SOUGHT_STEPS];
        let least = (-(SOUGHT_STEPS as i32)..)
            .zip(sought)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((steps, left)) = least {
            let here = left >= middle;
            planar.whole = if here { 0 } else { steps * stride };
            (planar.down_px, planar.near_px, planar.information) = (0.0, 0.0, 0.0);
        }
    }

    /// A line of a row begins, which is expected at `shift_px` along it.
    pub(super) fn begin_planar<P: Pixel>(&mut self, row: usize, pixels: &[P], shift_px: f32) {
        let Some(table) = self.store.vertical_table(row) else {
            return;
        };
        let whole = nearest_step(shift_px, i32::from(self.config.stride));
        let near = shift_px - whole as f32;
        // A picture that moves swiftly may be at another whole pixel, where the second product says nothing. At the
        // brightness of the line before.
        let second = match self.prediction.is_at_rest() {
            true => self.second_product(row, pixels, whole),
            false => None,
        };
        let near = match second {
            Some(second) => self.planar.approach(near, second, table),
            None => self.planar.expect(near, table),
        };
        self.planar.near_px = near.px;
        self.correlator.lean_px = near.lean_px;
    }

    /// The second half of a line that was found at `shift_px` along its row; where it is, what it leads to along the columns
    /// taken off.
    pub(super) fn measure_down<P: Pixel>(
        &mut self,
        row: usize,
        table: &RowTable,
        pixels: &[P],
        shift_px: f32,
        aside_px: f32,
    ) -> Result<f32, Rejected> {
        let whole = nearest_step(shift_px, i32::from(self.config.stride));
        let product = self.second_product(row, pixels, whole);
        let (Some(second), Some(vertical_table)) = (product, self.store.vertical_table(row)) else {
            return Err(Rejected::NoTexture);
        };
        let near = shift_px - whole as f32;
        let mut planar = self.planar;
        let there = planar.approach(near, second, vertical_table);
        let upright = near + self.correlator.lean_px - there.lean_px;
        let (first, vertical) = planar.settle(upright, there.px, second, vertical_table);
        let beyond_px = vertical.shift_px.abs() - NONSENSE_PX;
        let nonsense = beyond_px > 0.0
            && beyond_px * beyond_px * vertical.information_per_px2 > NONSENSE_SD * NONSENSE_SD;
        if nonsense || !(first + vertical.shift_px).is_finite() {
            return Err(Rejected::NoTexture);
        }
        planar.accept(there);
        let rows = planar.whole as f32;
        planar.first = Place {
            shift_px: whole as f32 - aside_px + first + vertical.coupling * rows,
            information_per_px2: table.information_per_px2(),
        };
        planar.vertical = Vertical {
            shift_px: vertical.shift_px + rows,
            ..vertical
        };
        planar.step(self.config.stride);
        self.planar = planar;
        Ok(whole as f32 + upright)
    }

    /// Σ h'·p of a line that is read `whole` pixels further right, at the reference's brightness.
    fn second_product<P: Pixel>(&self, row: usize, pixels: &[P], whole: i32) -> Option<f32> {
        let overlap = Overlap::new(pixels.len(), whole)?;
        let (product, _) = P::part_sums(
            self.config.kernel,
            pixels.get(overlap.line)?,
            self.store.vertical_coefficients(row)?,
            overlap.reference.start,
        );
        Some(product * self.light.to_reference)
    }

    /// Place of a line of a row whose edges all lie along it: it tells of the motion along the columns alone.
    /// `place`: the line's own row; `row`: that of the reference.
    #[cold]
    pub(super) fn locate_down<R: Row>(
        &mut self,
        [place, row]: [usize; 2],
        table: &RowTable,
        pixels: &mut R,
        aside_px: f32,
    ) -> Result<Place, Rejected> {
        let knows = |t: &VerticalTable| t.information_per_px2() > 0.0;
        if !self.store.vertical_table(row).is_some_and(knows) {
            return Err(Rejected::NoTexture);
        }
        if self.is_repeated(row, pixels, None) {
            return Err(Rejected::Repeated);
        }
        let Some((_, sum)) = whole_sums(&self.store, row, pixels) else {
            return Err(Rejected::NoTexture);
        };
        let before =
            core::mem::replace(&mut self.light.to_reference, table.factor_to_reference(sum));
        if self.light.to_reference > UNLIT {
            self.light.to_reference = before;
            return Err(Rejected::Unlit);
        }
        let shift_px = self.prediction.at(place) + aside_px;
        self.begin_planar(row, pixels.pixels(), shift_px);
        if place >= self.schedule.next_check || !self.light.may_have_been(before) {
            let fits = self.fits(row, pixels.pixels(), shift_px);
            self.note_fit(fits);
            self.after_check([place, row], pixels.pixels(), fits.then_some(shift_px));
            if !fits {
                return Err(Rejected::Occluded);
            }
        }
        self.measure_down(row, table, pixels.pixels(), shift_px, aside_px)?;
        self.light.add_since(before);
        let place = Place {
            shift_px: 0.0,
            information_per_px2: 0.0,
        };
        self.planar.first = place;
        Ok(place)
    }

    /// What most lines take where both axes are measured, as [`Tracker::take_fast`]; `None` where it is refused, and nothing
    /// has changed.
    #[inline(always)]
    pub(super) fn take_fast_planar<R: Summed>(
        &mut self,
        line: &Line<'_>,
        pixels: &R,
        times: bool,
    ) -> Option<Place> {
        let is_fast = self.planar.fast.has(line)
            && self.planar.is_here()
            && pixels.len() == usize::from(self.config.width);
        if !is_fast {
            return None;
        }
        let row = usize::from(line.row);
        if row >= self.schedule.next_check {
            return None;
        }
        let (table, vertical_table) = (self.store.table(row)?, self.store.vertical_table(row)?);
        if !table.has_texture() {
            return None;
        }
        let (first, second, sum) = pixels.both_sums(
            self.config.kernel,
            self.store.coefficients(row)?,
            self.store.vertical_coefficients(row)?,
        );
        let to_reference = table.factor_to_reference(sum);
        let planar = &self.planar;
        let second = second * to_reference;
        let near = planar.approach(self.prediction.predicted_px(), second, vertical_table);
        let upright_px = table.shift_of_leaning_px(first * to_reference, near.lean_px);
        let surprise_px = upright_px - self.prediction.predicted_px();
        let small =
            upright_px.abs() <= self.correlator.near_px && Prediction::is_small(surprise_px);
        let print = print::of_sums((first, sum));
        let repeated = self.store.print(row) == print;
        if !small || repeated || !self.light.may_become(to_reference) {
            return None;
        }
        let (shift_px, vertical) = planar.settle(upright_px, near.px, second, vertical_table);
        let information_per_px2 = table.information_per_px2();
        // Not true of what is no number either; what is further away is looked at closely.
        let known = vertical.shift_px.abs() < NONSENSE_PX;
        if !known {
            return None;
        }
        let planar = &mut self.planar;
        planar.accept(near);
        planar.step(self.config.stride);
        planar.vertical = vertical;
        planar.first = Place {
            shift_px,
            information_per_px2,
        };
        let place = planar.first;
        self.store.set_print(row, print);
        if times {
            self.light.add_settled(to_reference);
        }
        self.light.to_reference = to_reference;
        self.prediction
            .add_at_rest(surprise_px, information_per_px2);
        self.counts.measured = self.counts.measured.wrapping_add(1);
        Some(place)
    }

    /// What the line that was measured last is to others.
    #[inline]
    pub(super) fn planar_displacement(&self, line: &Line<'_>, time_ns: i64) -> Displacement {
        Displacement {
            frame: line.frame,
            row: line.row,
            time_ns,
            shift_px: self.planar.first.shift_px + self.store.anchor_px(),
            information_per_px2: self.planar.first.information_per_px2,
            vertical: Some(self.planar.vertical),
        }
    }

    /// Passes the line that was measured last on.
    #[inline(always)]
    pub(super) fn pass_on_planar(&self, line: &Line<'_>, (binner, done): Bins<'_>) -> bool {
        let Place {
            shift_px,
            information_per_px2,
        } = self.planar.first;
        let row = RowShift {
            frame: line.frame,
            row: line.row,
            shift_px,
            information_per_px2,
        };
        let begin = || Begin {
            middle_ns: self.middle_ns(line),
            curvature: self.curvature(),
            to_reference: self.light.to_reference,
            anchor_px: self.store.anchor_px(),
        };
        let complete = binner.push_row(row, begin, done);
        binner.note_vertical(row, &self.planar.vertical);
        complete
    }
}
