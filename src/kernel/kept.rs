//! Coefficients that are kept, as a kernel likes them best, and what their sums are.
//!
//! A row's coefficients are made once and read with every line. A Cortex-M keeps them as differences, two by two ([`pairs`]),
//! whatever the kernel, so that its firmware has one form of everything; every other processor as they are.
//!
//! Σ p tells of the light. Where a line's time is short it is that of every second column ([`Kernel::with_half_the_light`]): a
//! Cortex-M has it for nothing. Half the columns of a picture without texture of two pixels a period tell the same, whatever
//! the shift, with √2 times the noise.

#[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
use super::cortex_m;
use super::{Columns, Kernel, MAX_COEFFICIENT, Sums, pairs, spread::Spread};
use core::ops::Range;

/// Σ h·p and Σ p of a line of 8-bit pixels, at most 8192: 64·255·8192 < 2³¹.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineSums {
    /// Σ h·p.
    pub product: i32,
    /// Σ p, of all columns or of the even ones.
    pub pixels: u32,
}

impl LineSums {
    #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
    pub(super) fn add(&mut self, other: Self) {
        self.product = self.product.wrapping_add(other.product);
        self.pixels = self.pixels.wrapping_add(other.pixels);
    }

    #[inline(always)]
    fn of(sums: Sums) -> Self {
        Self {
            product: sums.product as i32,
            pixels: sums.pixels as u32,
        }
    }
}

/// Σ of every second, the first one included where `from` is even.
#[inline(always)]
fn of_even(from: usize, values: impl Iterator<Item = u16>) -> u32 {
    let even = values.skip(from & 1).step_by(2);
    even.map(u32::from).sum()
}

impl Kernel {
    /// The same kernel, whose sums over rows that are kept have Σ p of the even columns of the row only.
    #[must_use]
    pub const fn with_half_the_light(self) -> Self {
        Self(self.0, Columns::Even)
    }

    /// Σ of those columns of a row that Σ p is of; the first of `values` is column `from`.
    #[inline(always)]
    pub(crate) fn light(self, from: usize, values: &[u16]) -> u32 {
        if self.1 == Columns::All {
            return values.iter().map(|&value| u32::from(value)).sum();
        }
        let (mut sum, mut x) = (0, from & 1);
        while let Some(&value) = values.get(x) {
            sum += u32::from(value);
            x += 2;
        }
        sum
    }

    /// How many columns of a row of this width Σ p is of.
    #[inline(always)]
    pub(crate) fn light_columns(self, width: u16) -> u16 {
        match self.1 {
            Columns::All => width,
            Columns::Even => width.div_ceil(2),
        }
    }

    /// Coefficients are kept as differences.
    #[inline(always)]
    pub(crate) const fn keeps_pairs(self) -> bool {
        cfg!(all(
            target_arch = "arm",
            any(target_feature = "dsp", rowtone_dsp)
        ))
    }

    /// Largest magnitude of a coefficient that can be kept.
    #[inline(always)]
    pub(crate) fn most_kept(self) -> i8 {
        match self.keeps_pairs() {
            true => pairs::MOST,
            false => MAX_COEFFICIENT,
        }
    }

    /// Makes of a row of coefficients what the sums below read. Nothing is done, and it is false, where they cannot be kept: a
    /// Cortex-M wants |h| < 64, zeros in four columns at either end, and 0 as the sum of the odd columns. Rows of the
    /// reference are so ([`Build`](crate::reference::Build)).
    #[inline]
    pub fn keep(self, row: &mut [i8]) -> bool {
        let can = !self.keeps_pairs() || pairs::can_keep(row);
        if can {
            self.keep_some(row, 0..row.len());
        }
        can
    }

    /// [`Kernel::keep`] of a row that can be kept, these columns of it, of which the first is even; from left to right.
    #[inline]
    pub(crate) fn keep_some(self, row: &mut [i8], span: Range<usize>) {
        if self.keeps_pairs() {
            pairs::keep(row, span);
        }
    }

    /// Lays what is kept in these columns of a row, of which the first is even and which are an even number, as it is into `to`,
    /// `by` columns to the right. `lanes` is what this has left there of the columns before, 0 at first.
    #[inline]
    pub(crate) fn lay_kept(
        self,
        row: &[i8],
        span: Range<usize>,
        lanes: &mut u32,
        to: &mut [i8],
        by: i32,
    ) {
        let (mut state, mut at) = (*lanes, span.start.wrapping_add(by as usize));
        let row = row.get(span).unwrap_or_default();
        for both in row.chunks(2) {
            let plain = match (self.keeps_pairs(), both) {
                (true, &[a, b]) => pairs::next_two([a, b], &mut state),
                (_, &[a, b]) => [a, b],
                // The last of an odd number is 0.
                _ => [0; 2],
            };
            if let Some(to) = to.get_mut(at) {
                *to = plain[0];
            }
            if let Some(to) = to.get_mut(at.wrapping_add(1)) {
                *to = plain[1];
            }
            at = at.wrapping_add(2);
        }
        *lanes = state;
    }

    /// Sums over a line and its whole row, as it is kept. The shorter length of the two counts.
    #[inline(always)]
    pub fn kept_u8(self, pixels: &[u8], row: &[i8]) -> LineSums {
        #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
        return match self.1 {
            Columns::Even => cortex_m::kept_u8(pixels, row),
            Columns::All => self.kept_all_u8(pixels, row),
        };
        #[cfg(not(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp))))]
        self.kept_part_u8(pixels, row, 0)
    }

    /// [`Kernel::kept_u8`] with Σ p of all columns; apart, or lines with half of it would jump over it.
    #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
    #[cold]
    #[inline(never)]
    fn kept_all_u8(self, pixels: &[u8], row: &[i8]) -> LineSums {
        self.kept_part_u8(pixels, row, 0)
    }

    /// [`Kernel::kept_u8`], and Σ h'·p with a second row that is kept.
    #[inline(always)]
    pub fn kept_both_u8(self, pixels: &[u8], row: &[i8], second: &[i8]) -> (LineSums, i32) {
        #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
        return match self.1 {
            Columns::Even => cortex_m::kept_both_u8(pixels, row, second),
            Columns::All => (
                self.kept_u8(pixels, row),
                self.kept_u8(pixels, second).product,
            ),
        };
        #[cfg(not(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp))))]
        {
            let (sums, second) = self.both_u8(pixels, row, second);
            let mut sums = LineSums::of(sums);
            if self.1 == Columns::Even {
                sums.pixels = of_even(0, pixels.iter().zip(row).map(|(&p, _)| p.into()));
            }
            (sums, second as i32)
        }
    }

    /// Sums over pixels and as many columns of a row that is kept, the first of them `from`.
    #[inline(always)]
    pub fn kept_part_u8(self, pixels: &[u8], row: &[i8], from: usize) -> LineSums {
        let columns = row.get(from..).unwrap_or_default();
        let values = || pixels.iter().zip(columns).map(|(&p, _)| u16::from(p));
        #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
        return {
            let mut sums = cortex_m::kept_part_u8(pixels, row, from);
            if self.1 == Columns::All {
                sums.pixels += of_even(from + 1, values());
            }
            sums
        };
        #[cfg(not(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp))))]
        {
            let sums = LineSums::of(self.sums_u8(pixels, columns));
            match self.1 {
                Columns::All => sums,
                Columns::Even => LineSums {
                    pixels: of_even(from, values()),
                    ..sums
                },
            }
        }
    }

    /// [`Kernel::kept_part_u8`] over 16-bit pixels.
    #[inline]
    pub(crate) fn kept_part_u16(self, pixels: &[u16], row: &[i8], from: usize) -> Sums {
        if self.keeps_pairs() {
            return self.one_by_one(from, pixels.iter().copied(), pairs::plain(row, from));
        }
        let row = row.get(from..).unwrap_or_default();
        let sums = self.sums_u16(pixels, row);
        match self.1 {
            Columns::All => sums,
            Columns::Even => Sums {
                pixels: of_even(from, pixels.iter().zip(row).map(|(&p, _)| p)).into(),
                ..sums
            },
        }
    }

    /// [`Kernel::kept_u8`] over pixels where they lie.
    #[inline(always)]
    pub(crate) fn kept_spread(self, spread: Spread, bytes: &[u8], row: &[i8]) -> LineSums {
        let pixels = || spread.pixels(bytes, 0).map(u16::from);
        if self.keeps_pairs() {
            return LineSums::of(self.one_by_one(0, pixels(), pairs::plain(row, 0)));
        }
        let sums = LineSums::of(self.sums_spread(spread, bytes, row));
        match self.1 {
            Columns::All => sums,
            Columns::Even => LineSums {
                pixels: of_even(0, pixels().take(row.len())),
                ..sums
            },
        }
    }

    /// Deeper pixels come from larger boards: plain Rust serves.
    fn one_by_one(
        self,
        from: usize,
        pixels: impl Iterator<Item = u16>,
        row: impl Iterator<Item = i8>,
    ) -> Sums {
        let pairs = (from..).zip(pixels.zip(row));
        pairs.fold(Sums::default(), |sums, (x, (p, h))| {
            let counts = self.1 == Columns::All || x % 2 == 0;
            Sums {
                product: sums.product + i64::from(i32::from(p) * i32::from(h)),
                pixels: sums.pixels + if counts { u64::from(p) } else { 0 },
            }
        })
    }
}
