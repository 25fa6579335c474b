//! One row of the reference, and what the line path needs of it.
//!
//! The reference picture is a running mean of aligned frames (the thesis's Algorithm 1 in a stream). From
//! its row r the coefficients h of the line's inner product are built: h is the band-passed derivative of
//! r, weighted by the inverse variance of each pixel and made orthogonal to a constant and to r, so that
//! neither a gain nor an offset of the light looks like motion. Then for a line p(x) = g·r(x − d)
//!
//! ```text
//! u = Σ h·p / (g·q') − offset,     d = u + quadratic·u² + cubic·u³,
//! ```
//!
//! where q(d) = Σ h(x)·r(x − d) is the row's phase-correlation function: its values at whole shifts are
//! inner products of h and r, those between follow by band-limited interpolation, and the two
//! coefficients make the inverse exact at d = 0 and ± ½ px. With the weights 1/variance this is the
//! maximum-likelihood estimate (Cramér–Rao bound 1/Σ r'²/σ²), and the reference's gradient instead of the
//! line's is the inverse-compositional form of Gauss–Newton (Baker & Matthews 2004): nothing of it
//! depends on the line.

pub(crate) mod align;
mod background;
pub mod band;
mod build;
mod learned;
mod meter;
mod moving;
pub mod noise;
mod planar;
mod recipe;
mod round;
mod static_pixels;
mod storage;
mod store;
mod vertical;
mod work;

#[cfg(feature = "long-exposure")]
use band::{Level, SLOPE};

pub use build::{Build, Parts, VerticalBuild, VerticalParts};
pub use learned::{ColumnLearning, RowLearning};
pub use meter::NoiseMeter;
pub(crate) use planar::Beside;
pub use recipe::Recipe;
pub(crate) use storage::BufferTooShort;
pub use storage::{StaticStorage, StaticVerticalStorage, Storage, VerticalStorage};
pub(crate) use store::Store;
pub use vertical::VerticalTable;

/// What the line path needs of a row besides its coefficients: 20 bytes. [`VerticalTable`] is that of its second ones.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RowTable {
    /// 1/q', px per unit of Σ h·p at the reference's brightness.
    px_per_product: f32,
    /// Σ r over the columns that tell of the light, at least 1 where the row was built.
    pixel_sum: f32,
    /// Information, 1/px², and where the row's own reference reads, px. All 0 where the row has no texture.
    information_and_offset: Two,
    /// The coefficients of u² in px⁻¹ and of u³ in px⁻².
    quadratic_and_cubic: Two,
    /// Print of the row's last line; 0 where its coefficients are others since.
    print: u32,
}

/// Two numbers of the precision of half an f32, 2⁻⁹. The first is the f32 itself, rounded so that the upper half of the
/// second can stand in its lower half: a microcontroller reads it in one instruction, and the other in two more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Two(u32);

impl Two {
    const ZERO: Self = Self(0);

    /// What is not finite is 0.
    fn new(first: f32, second: f32) -> Self {
        let bits = |v: f32| if v.is_finite() { v.to_bits() } else { 0 };
        let (first, second) = (bits(first), bits(second).saturating_add(0x8000) >> 16);
        let magnitude = ((first & !(1 << 31)).saturating_sub(second) + 0x8000).min(0x7F7F_FFFF);
        Self(first & (1 << 31) | magnitude & 0xFFFF_0000 | second)
    }

    #[inline(always)]
    fn first(self) -> f32 {
        f32::from_bits(self.0)
    }

    #[inline(always)]
    fn second(self) -> f32 {
        f32::from_bits(self.0 << 16)
    }
}

impl RowTable {
    /// Of a row that is not known yet: all zeros, as memory is at first.
    pub(crate) const EMPTY: Self = Self {
        px_per_product: 0.0,
        pixel_sum: 0.0,
        information_and_offset: Two::ZERO,
        quadratic_and_cubic: Two::ZERO,
        print: 0,
    };

    /// What the row knows of its shift, 1/px²; 0 where it has too little texture to be measured.
    #[inline(always)]
    pub fn information_per_px2(&self) -> f32 {
        self.information_and_offset.first()
    }

    /// The same row, which cannot be measured.
    pub(crate) fn without_texture(&self) -> Self {
        Self {
            pixel_sum: self.pixel_sum,
            print: self.print,
            ..Self::EMPTY
        }
    }

    /// Becomes `built`, but for the print of the row's last line.
    pub(super) fn become_built(&mut self, built: Self) {
        *self = Self {
            print: self.print,
            ..built
        };
    }

    /// The row can be measured.
    #[inline]
    pub(crate) fn has_texture(&self) -> bool {
        self.information_and_offset != Two::ZERO
    }

    /// Σ r over the whole row, or its even columns where those tell of the light
    /// ([`Kernel::with_half_the_light`](crate::kernel::Kernel::with_half_the_light)), in pixel values; at least 1 where the row
    /// was built.
    #[inline(always)]
    pub fn pixel_sum(&self) -> f32 {
        self.pixel_sum
    }

    /// The factor that brings a line of this `pixel_sum` to the reference's brightness.
    #[inline(always)]
    pub(crate) fn factor_to_reference(&self, pixel_sum: f32) -> f32 {
        // A black line has no brightness to divide by, and no texture to measure.
        self.pixel_sum / at_least_1(pixel_sum)
    }

    /// The shift for `product` = Σ h·p/g of a line whose brightness is g times the reference's, px;
    /// right within ± 0.7 px or so.
    #[inline(always)]
    pub fn shift_px(&self, product: f32) -> f32 {
        let (quadratic, cubic) = self.inverse();
        let u = product * self.px_per_product - self.information_and_offset.second();
        u * (1.0 + u * (quadratic + u * cubic))
    }

    /// The same for a line that, being displaced along the columns, reads `lean_px` too large.
    #[inline(always)]
    pub(crate) fn shift_of_leaning_px(&self, product: f32, lean_px: f32) -> f32 {
        let (quadratic, cubic) = self.inverse();
        let u = product * self.px_per_product - (self.information_and_offset.second() + lean_px);
        u * (1.0 + u * (quadratic + u * cubic))
    }

    /// What a lean of so many px adds to a product.
    #[inline(always)]
    pub(crate) fn product_of_lean(&self, lean_px: f32) -> f32 {
        if lean_px == 0.0 {
            0.0
        } else {
            lean_px / self.px_per_product
        }
    }

    /// The same for a line that is smeared out along x by `variance_px2` more than its reference, with a
    /// third central moment of `skew_px3`: the mean of the smear's path is wanted. The response is then
    /// the mean of q over the path, of which q's second and third derivative tell.
    pub fn shift_of_smeared_px(&self, product: f32, variance_px2: f32, skew_px3: f32) -> f32 {
        let d = self.shift_px(product);
        let (quadratic, cubic) = self.inverse();
        // q/q' = d − quadratic·d² + third·d³, the inverse of the polynomial.
        let third = 2.0 * quadratic * quadratic - cubic;
        let excess = variance_px2 * (3.0 * third * d - quadratic) + skew_px3 * third;
        self.shift_px(product - excess / self.px_per_product)
    }

    /// Takes off q, given at whole steps either way of its middle, what the reference's own noise is in it: the same noise
    /// is in h, and looks like texture. How much, the slope tells, which was made without it.
    #[cfg(feature = "long-exposure")]
    pub(crate) fn drop_own_noise(&self, q: &mut [f32], level: Level, stride: usize) {
        let (middle, mut slope, mut of_noise) = (q.len() / 2, 0.0, 0.0);
        for (k, f) in (1..).zip(SLOPE) {
            let at = |at: usize| q.get(at).copied().unwrap_or(0.0);
            slope += f * (at(middle + k) - at(middle.saturating_sub(k)));
            of_noise += 2.0 * f * level.half_filter().get(k - 1).unwrap_or(&0.0);
        }
        let noise = (slope - stride as f32 / self.px_per_product) / of_noise;
        // Neither is true of what is no number.
        let plausible = noise > 0.0 && noise.is_finite();
        let noise = if plausible { noise } else { 0.0 };
        for (k, f) in (1..).zip(level.half_filter()) {
            if let Some(right) = q.get_mut(middle + k) {
                *right -= f * noise;
            }
            if let Some(left) = middle.checked_sub(k).and_then(|at| q.get_mut(at)) {
                *left += f * noise;
            }
        }
    }

    /// −q‴/q' at rest, 1/px²: how fast the response falls off from there, k² for a texture of the one wave number k. 0
    /// for a row without texture.
    pub fn curvature_per_px2(&self) -> f32 {
        let (quadratic, cubic) = self.inverse();
        6.0 * (cubic - 2.0 * quadratic * quadratic)
    }

    /// The coefficients of u² in px⁻¹ and of u³ in px⁻².
    #[inline(always)]
    fn inverse(&self) -> (f32, f32) {
        let both = self.quadratic_and_cubic;
        (both.first(), both.second())
    }
}

/// 1 for NaN; `f32::max` takes a microcontroller twice as long.
#[inline(always)]
pub(crate) fn at_least_1(v: f32) -> f32 {
    if v > 1.0 { v } else { 1.0 }
}

impl Default for RowTable {
    fn default() -> Self {
        Self::EMPTY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;
    use band::Level;
    use noise::PixelNoise;

    const WIDTH: usize = 256;

    fn recipe() -> Recipe {
        Recipe {
            level: Level::Fine,
            stride: 1,
            margin_px: 8,
            noise: PixelNoise {
                dark: 1.0,
                per_value: 0.0,
            },
            pattern: 0.0,
            counts_per_value: 128.0,
            saturation: 254.0,
            kernel: Kernel::PORTABLE,
        }
    }

    /// A texture at `shift_px`, seen along a path of speed `speed` and acceleration `change` px an exposure.
    fn line(shift_px: f32, speed: f32, change: f32) -> [u16; WIDTH] {
        let texture =
            |x: f32| 8000.0 + 4000.0 * libm::sinf(0.41 * x) + 2500.0 * libm::cosf(0.23 * x + 1.0);
        core::array::from_fn(|x| {
            let sum: f32 = (0..100u8)
                .map(|k| {
                    let t = (f32::from(k) + 0.5) / 100.0 - 0.5;
                    let path = speed * t + 0.5 * change * (t * t - 1.0 / 12.0);
                    texture(x as f32 - shift_px - path)
                })
                .sum();
            libm::roundf(sum / 100.0) as u16
        })
    }

    /// The reference is smeared out by a path of speed 3.
    fn table(coefficients: &mut [i8; WIDTH]) -> RowTable {
        Build::new(&recipe(), 1e4).all(&mut Parts {
            mean: &line(0.0, 3.0, 0.0),
            mask: &[255; WIDTH],
            scratch: &mut [0.0; 2 * WIDTH],
            coefficients,
        })
    }

    #[test]
    fn a_smeared_line_reads_the_mean_of_its_path() {
        let mut coefficients = [0; WIDTH];
        let table = table(&mut coefficients);
        let (mut worst, mut plain) = (0.0f32, 0.0f32);
        for (speed, change) in [(3.0, 0.0), (0.0, 0.0), (4.5, 0.0), (4.5, 3.0), (4.5, -3.0)] {
            for shift in [-0.5, -0.2, 0.0, 0.3, 0.5] {
                let line = line(shift, speed, change);
                let sums = Kernel::PORTABLE.sums_u16(&line, &coefficients);
                let product = sums.product as f32 / 128.0;
                let variance = (speed * speed - 9.0) / 12.0 + change * change / 720.0;
                let skew = speed * speed * change / 120.0;
                let got = table.shift_of_smeared_px(product, variance, skew);
                worst = worst.max((got - shift).abs());
                plain = plain.max((table.shift_px(product) - shift).abs());
            }
        }
        assert!(worst < 0.012, "{worst} px");
        assert!(plain > 0.03, "without it too: {plain} px");
    }

    proptest::proptest! {
        #[test]
        fn two_numbers_keep_half_their_digits(first in -1e6f32..1e6, second in -16f32..16.0) {
            let two = Two::new(first, second);
            for (kept, given) in [(two.first(), first), (two.second(), second)] {
                proptest::prop_assert!((kept - given).abs() <= given.abs() / 256.0 + 1e-30, "{kept} {given}");
            }
        }
    }

    #[test]
    fn two_numbers_are_finite_whatever_they_are_made_of() {
        let odd = [
            0.0,
            -0.0,
            1e-45,
            -1e-45,
            f32::MAX,
            f32::MIN,
            f32::NAN,
            f32::INFINITY,
            1.0,
            -2.0,
        ];
        for (a, b) in odd.iter().flat_map(|&a| odd.iter().map(move |&b| (a, b))) {
            let two = Two::new(a, b);
            assert!(two.first().is_finite(), "{a} {b}");
            assert!(!two.second().is_nan(), "{a} {b}");
        }
    }

    #[test]
    fn all_kernels_build_the_same_row() {
        let built = |kernel: Kernel, margin_px: usize| {
            let mut coefficients = [0; WIDTH];
            let recipe = Recipe {
                kernel,
                margin_px,
                ..recipe()
            };
            let table = Build::new(&recipe, 7.0).all(&mut Parts {
                mean: &line(0.3, 2.0, 0.0),
                mask: &core::array::from_fn::<_, WIDTH, _>(|x| 255 - (x % 90) as u8),
                scratch: &mut [0.0; 2 * WIDTH],
                coefficients: &mut coefficients,
            });
            (table, coefficients)
        };
        for margin_px in [0, 13] {
            let expected = built(Kernel::PORTABLE, margin_px);
            assert!(expected.0.has_texture());
            for kernel in Kernel::all() {
                assert_eq!(built(kernel, margin_px), expected, "{kernel:?}");
            }
        }
    }

    #[test]
    fn a_row_is_twenty_bytes() {
        assert_eq!(size_of::<RowTable>(), 20);
    }
}
