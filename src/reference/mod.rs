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

mod build;

pub use build::{Build, Parts, Recipe};

/// What the line path needs of a row besides its coefficients: 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct RowTable {
    /// 1/q', px per unit of Σ h·p at the reference's brightness.
    px_per_product: f32,
    /// Where the row's own reference reads, px.
    offset_px: f32,
    /// Σ r over the whole row.
    pixel_sum: f32,
    /// Information, 1/px², as the upper half of an f32; 0 where the row has no texture.
    information: u16,
    /// In 1/256 px⁻¹.
    quadratic: i8,
    /// In 1/64 px⁻².
    cubic: i8,
}

impl RowTable {
    /// What the row knows of its shift, 1/px²; 0 where it has too little texture to be measured.
    pub fn information_per_px2(&self) -> f32 {
        f32::from_bits(u32::from(self.information) << 16)
    }

    /// Σ r over the whole row, in pixel values.
    pub fn pixel_sum(&self) -> f32 {
        self.pixel_sum
    }

    /// The shift for `product` = Σ h·p/g of a line whose brightness is g times the reference's, px;
    /// right within ± 0.7 px or so.
    #[inline]
    pub fn shift_px(&self, product: f32) -> f32 {
        let u = product * self.px_per_product - self.offset_px;
        let quadratic = f32::from(self.quadratic) * (1.0 / 256.0);
        let cubic = f32::from(self.cubic) * (1.0 / 64.0);
        u * (1.0 + u * (quadratic + u * cubic))
    }
}
