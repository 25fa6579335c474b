//! What a row of the reference knows of the motion along the columns.

use super::Two;

/// What the line path needs of a row besides the coefficients of its second inner product: 32 bytes.
///
/// See [`VerticalBuild`](super::VerticalBuild) for what the second product is. A row that knows nothing of y, for want of
/// texture or of rows beside it, has an information of 0; its coupling then still tells what y does to the first product, but
/// next to the picture's edge, where nothing is known of that.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct VerticalTable {
    /// 1/q', px per unit of Σ h'·p at the reference's brightness.
    pub(super) px_per_product: f32,
    /// Information, 1/px², and where the row's own reference reads, px.
    pub(super) information_and_offset: Two,
    /// κ, how much of y the first product takes for x, and how much of x the second one takes for y.
    pub(super) coupling_and_leak: Two,
    /// The coefficients of u² in px⁻¹ and of u³ in px⁻².
    pub(super) quadratic_and_cubic: Two,
    /// What the first product takes of y² and y³ for x, and the second one of x² and x³ for y.
    pub(super) first_of_down: Two,
    pub(super) second_of_right: Two,
    /// What the first and the second one take of x·y, px⁻¹.
    pub(super) mixed: Two,
    /// While learning: mean shift downwards of the frames of the first round, px.
    pub(crate) learned_px: f32,
}

impl VerticalTable {
    /// Of a row that is not known yet: all zeros, as memory is at first.
    pub(crate) const EMPTY: Self = Self {
        px_per_product: 0.0,
        information_and_offset: Two::ZERO,
        coupling_and_leak: Two::ZERO,
        quadratic_and_cubic: Two::ZERO,
        first_of_down: Two::ZERO,
        second_of_right: Two::ZERO,
        mixed: Two::ZERO,
        learned_px: 0.0,
    };

    /// What the row knows of its shift downwards where that to the right is not known, 1/px²; 0 where it cannot be measured.
    #[inline(always)]
    pub fn information_per_px2(&self) -> f32 {
        self.information_and_offset.first()
    }

    /// κ: the first product reads x + κ·y.
    #[inline(always)]
    pub fn coupling(&self) -> f32 {
        self.coupling_and_leak.first()
    }

    /// The shift downwards for `product` = Σ h'·p/g of a line whose brightness is g times the reference's, px. `near_px`:
    /// about where it is, to the right and down; the row's own reading is too noisy to be taken to a power.
    #[inline(always)]
    pub(crate) fn shift_px(&self, product: f32, [right, down]: [f32; 2]) -> f32 {
        let (bend, across) = (self.quadratic_and_cubic, self.second_of_right);
        let plain = product * self.px_per_product - self.information_and_offset.second();
        let bent = plain * (1.0 + down * (bend.first() + down * bend.second()));
        let leak = self.coupling_and_leak.second() + self.mixed.second() * down;
        bent - right * (leak + right * (across.first() + right * across.second()))
    }

    /// What the first product takes for a shift to the right of a shift of about `near_px`, to the right and down, px:
    /// κ·y and what bends it.
    #[inline(always)]
    pub(crate) fn lean_px(&self, [right, down]: [f32; 2]) -> f32 {
        let bend = self.first_of_down;
        let straight = self.coupling() + self.mixed.first() * right;
        down * (straight + down * (bend.first() + down * bend.second()))
    }

    /// −q‴/q' of the second product's response at rest, 1/px², as [`RowTable::curvature_per_px2`](super::RowTable::curvature_per_px2).
    pub fn curvature_per_px2(&self) -> f32 {
        let both = self.quadratic_and_cubic;
        6.0 * (both.second() - 2.0 * both.first() * both.first())
    }

    /// The same row, which cannot be measured.
    pub(crate) fn without_texture(&self) -> Self {
        Self {
            coupling_and_leak: self.coupling_and_leak,
            ..Self::EMPTY
        }
    }
}

impl Default for VerticalTable {
    fn default() -> Self {
        Self::EMPTY
    }
}
