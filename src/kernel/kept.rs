//! Coefficients that are kept, as a kernel likes them best.
//!
//! A row's coefficients are made once and read with every line. A Cortex-M keeps them two by two ([`pairs`]), every other
//! kernel as they are: then all of this is what it is made of.

use super::{Kernel, Sums, pairs, spread::Spread};
#[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
use super::{Kind, cortex_m};

/// Σ h·p and Σ p of a line of 8-bit pixels, at most 8192: 64·255·8192 < 2³¹.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineSums {
    /// Σ h·p.
    pub product: i32,
    /// Σ p.
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

impl Kernel {
    /// Coefficients are kept two by two.
    #[inline(always)]
    pub(crate) fn keeps_pairs(self) -> bool {
        #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
        return self.0 == Kind::CortexM;
        #[cfg(not(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp))))]
        false
    }

    /// Makes of a row of coefficients what the sums below read. False where it cannot be kept: it must not be measured.
    #[inline]
    pub fn keep(self, row: &mut [i8]) -> bool {
        let can = self.can_keep(row);
        self.keep_some(row);
        can
    }

    /// The first half of [`Kernel::keep`]: a few coefficients are changed where they must be, Σ h is not.
    #[inline]
    pub(crate) fn can_keep(self, row: &mut [i8]) -> bool {
        !self.keeps_pairs() || pairs::even_out(row)
    }

    /// The second half, which may be done span by span: each begins at an even column.
    #[inline]
    pub(crate) fn keep_some(self, span: &mut [i8]) {
        if self.keeps_pairs() {
            pairs::keep(span);
        }
    }

    /// What is kept in a row, from column `from` on.
    pub fn kept_coefficients(self, row: &[i8], from: usize) -> impl Iterator<Item = i8> {
        let (plain, pairs) = match self.keeps_pairs() {
            true => (None, Some(pairs::plain(row, from))),
            false => (row.get(from..), None),
        };
        let plain = plain.unwrap_or_default().iter().copied();
        plain.chain(pairs.into_iter().flatten())
    }

    /// Moves a row that is kept to the right by `by` (to the left where negative). What comes in is not told: nothing is
    /// measured there.
    #[inline]
    pub(crate) fn move_kept(self, row: &mut [i8], by: i32, otherwise: impl Fn(&mut [i8], i32)) {
        if !self.keeps_pairs() {
            return otherwise(row, by);
        }
        for _ in 0..by.unsigned_abs() {
            pairs::move_by_one(row, by > 0);
        }
    }

    /// Sums over a line and its whole row, as it is kept. The shorter length of the two counts.
    #[inline(always)]
    pub fn kept_u8(self, pixels: &[u8], row: &[i8]) -> LineSums {
        match self.0 {
            #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
            Kind::CortexM => cortex_m::kept_u8(pixels, row),
            _ => LineSums::of(self.sums_u8(pixels, row)),
        }
    }

    /// Sums over pixels and as many columns of a row that is kept, the first of them `from`.
    #[inline(always)]
    pub fn kept_part_u8(self, pixels: &[u8], row: &[i8], from: usize) -> LineSums {
        match self.0 {
            #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
            Kind::CortexM => cortex_m::kept_part_u8(pixels, row, from),
            _ => LineSums::of(self.sums_u8(pixels, row.get(from..).unwrap_or_default())),
        }
    }

    /// [`Kernel::kept_part_u8`] over 16-bit pixels.
    #[inline]
    pub(crate) fn kept_part_u16(self, pixels: &[u16], row: &[i8], from: usize) -> Sums {
        if self.keeps_pairs() {
            return one_by_one(pixels.iter().copied(), pairs::plain(row, from));
        }
        self.sums_u16(pixels, row.get(from..).unwrap_or_default())
    }

    /// [`Kernel::kept_u8`] over pixels where they lie.
    #[inline(always)]
    pub(crate) fn kept_spread(self, spread: Spread, bytes: &[u8], row: &[i8]) -> LineSums {
        if self.keeps_pairs() {
            let pixels = spread.pixels(bytes, 0).map(u16::from);
            return LineSums::of(one_by_one(pixels, pairs::plain(row, 0)));
        }
        LineSums::of(self.sums_spread(spread, bytes, row))
    }
}

/// Deeper pixels come from larger boards: plain Rust serves.
fn one_by_one(pixels: impl Iterator<Item = u16>, row: impl Iterator<Item = i8>) -> Sums {
    pixels.zip(row).fold(Sums::default(), |sums, (p, h)| Sums {
        product: sums.product + i64::from(i32::from(p) * i32::from(h)),
        pixels: sums.pixels + u64::from(p),
    })
}
