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

use crate::{
    band::{Level, MAX_HALF},
    kernel::MAX_COEFFICIENT,
    noise::PixelNoise,
};

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

    /// The shift for `product` = Σ h·p of a line whose brightness is `gain` times the reference's, px;
    /// right within ± 0.7 px or so.
    #[inline]
    pub fn shift_px(&self, product: f32, gain: f32) -> f32 {
        let u = product * self.px_per_product / gain - self.offset_px;
        let quadratic = f32::from(self.quadratic) * (1.0 / 256.0);
        let cubic = f32::from(self.cubic) * (1.0 / 64.0);
        u * (1.0 + u * (quadratic + u * cubic))
    }
}

/// How rows become coefficients: the same for all rows of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// How coarse the band is.
    pub level: Level,
    /// Pixels from one to the next of the same colour: 1, or 2 for raw Bayer.
    pub stride: usize,
    /// Columns at either edge that the motion may carry out of the picture, px.
    pub margin_px: usize,
    /// Noise of one pixel.
    pub noise: PixelNoise,
    /// Reference counts in one pixel value.
    pub counts_per_value: f32,
    /// Pixel value from which on a pixel is saturated.
    pub saturation: f32,
}

/// Rows whose shift is less sure than this are not used, px.
const WORST_SD_PX: f32 = 0.4;

impl Recipe {
    /// Builds a row's coefficients and table.
    ///
    /// `mean`: the reference row in counts, a mean of `frames` frames. `mask`: weight of each column,
    /// 0 = not used. `h`: scratch of the row's width. All of one length; where they differ, the
    /// shortest counts and the rest of `coefficients` is zeroed.
    pub fn build(
        &self,
        mean: &[u16],
        frames: f32,
        mask: &[u8],
        h: &mut [f32],
        coefficients: &mut [i8],
    ) -> RowTable {
        coefficients.fill(0);
        let width = mean
            .len()
            .min(mask.len())
            .min(h.len())
            .min(coefficients.len());
        let (Some(mean), Some(mask), Some(h), Some(coefficients)) = (
            mean.get(..width),
            mask.get(..width),
            h.get_mut(..width),
            coefficients.get_mut(..width),
        ) else {
            return RowTable::default();
        };
        let value = 1.0 / self.counts_per_value;
        let total: u64 = mean.iter().map(|&c| u64::from(c)).sum();
        let pixel_sum = total as f32 * value;
        let mut table = RowTable {
            pixel_sum,
            ..RowTable::default()
        };
        let centre = pixel_sum / width.max(1) as f32;
        self.derivative(mean, mask, h);
        self.drop_noise(mean, mask, frames, h);
        self.make_orthogonal(mean, mask, centre, h);
        if quantise(h, coefficients).is_none() {
            return table;
        }
        self.expand(mean, frames, mask, centre, h, coefficients, &mut table);
        table
    }

    /// Weight of column `x`: its mask and the inverse variance of its pixel; 0 beyond the margin, and
    /// where the pixel is black or saturated.
    fn weight(&self, mean: &[u16], mask: &[u8], x: usize) -> f32 {
        let (Some(&count), Some(&mask)) = (mean.get(x), mask.get(x)) else {
            return 0.0;
        };
        let value = f32::from(count) / self.counts_per_value;
        if mask == 0 || value >= self.saturation {
            return 0.0;
        }
        // A soft edge over four pixels, so that a picture moving past it changes little at a time.
        let from_edge = x.min(mean.len() - 1 - x);
        let edge = self.margin_px + MAX_HALF * self.stride;
        let ramp = (from_edge + 4).saturating_sub(edge).min(4) as f32 / 4.0;
        let ramp = if self.margin_px == 0 { 1.0 } else { ramp };
        ramp * f32::from(mask) / 255.0 / self.noise.variance(value)
    }

    /// h ← −weight · band-passed r'.
    fn derivative(&self, mean: &[u16], mask: &[u8], h: &mut [f32]) {
        let filter = self.level.half_filter();
        let reach = filter.len() * self.stride;
        let value = 1.0 / self.counts_per_value;
        for (x, h) in h.iter_mut().enumerate() {
            *h = 0.0;
            if x < reach || x + reach >= mean.len() {
                continue;
            }
            let weight = self.weight(mean, mask, x);
            if weight == 0.0 {
                continue;
            }
            let mut slope = 0.0;
            for (k, &f) in (1..).zip(filter) {
                let (Some(&right), Some(&left)) =
                    (mean.get(x + k * self.stride), mean.get(x - k * self.stride))
                else {
                    continue;
                };
                slope += f * (f32::from(right) - f32::from(left));
            }
            *h = -weight * slope * value;
        }
    }

    /// Where the reference's slope is no larger than its own noise it says nothing, and would only let
    /// the line's noise in: a Wiener gain over nine pixels.
    fn drop_noise(&self, mean: &[u16], mask: &[u8], frames: f32, h: &mut [f32]) {
        const REACH: usize = 4;
        let filter_power: f32 = 2.0 * self.level.half_filter().iter().map(|f| f * f).sum::<f32>();
        let per_pixel = filter_power / frames.max(1.0);
        let square = |h: &[f32], x: usize| h.get(x).map_or(0.0, |h| h * h);
        // Energies of the pixels that were already changed, oldest first.
        let mut before = [0.0f32; REACH];
        for x in 0..h.len() {
            let ahead: f32 = (x..=x + REACH).map(|x| square(h, x)).sum();
            let energy = (ahead + before.iter().sum::<f32>()) / (2 * REACH + 1) as f32;
            before.rotate_left(1);
            before[REACH - 1] = square(h, x);
            let weight = self.weight(mean, mask, x);
            let value = mean.get(x).map_or(0.0, |&c| f32::from(c)) / self.counts_per_value;
            let noise = weight * weight * self.noise.variance(value) * per_pixel;
            if let Some(h) = h.get_mut(x) {
                let gain = if energy > 2.0 * noise {
                    1.0 - noise / energy
                } else {
                    0.0
                };
                *h *= gain;
            }
        }
    }

    /// h ← h − weight·(α + β·r), so that Σ h = 0 and Σ h·r = 0.
    fn make_orthogonal(&self, mean: &[u16], mask: &[u8], centre: f32, h: &mut [f32]) {
        let (mut w0, mut w1, mut w2, mut h0, mut h1) = (0.0f32, 0.0f32, 0.0f32, 0.0f32, 0.0f32);
        for (x, (&h, &count)) in h.iter().zip(mean).enumerate() {
            if h == 0.0 {
                continue;
            }
            let weight = self.weight(mean, mask, x);
            let r = f32::from(count) / self.counts_per_value - centre;
            w0 += weight;
            w1 += weight * r;
            w2 += weight * r * r;
            h0 += h;
            h1 += h * r;
        }
        let determinant = w0 * w2 - w1 * w1;
        let (alpha, beta) = if determinant > 1e-3 * w0 * w2 {
            (
                (h0 * w2 - h1 * w1) / determinant,
                (h1 * w0 - h0 * w1) / determinant,
            )
        } else if w0 > 0.0 {
            (h0 / w0, 0.0)
        } else {
            (0.0, 0.0)
        };
        for (x, (h, &count)) in h.iter_mut().zip(mean).enumerate() {
            if *h != 0.0 {
                let r = f32::from(count) / self.counts_per_value - centre;
                *h -= self.weight(mean, mask, x) * (alpha + beta * r);
            }
        }
    }

    /// Fills the table from the row's phase-correlation function q at whole shifts.
    #[expect(clippy::too_many_arguments, reason = "the parts of one row")]
    fn expand(
        &self,
        mean: &[u16],
        frames: f32,
        mask: &[u8],
        centre: f32,
        h: &[f32],
        coefficients: &[i8],
        table: &mut RowTable,
    ) {
        let value = 1.0 / self.counts_per_value;
        // h was scaled to whole numbers: `scale` tells how far, for the noise that it carries.
        let scale = largest(coefficients) / largest_f32(h);
        let mut q = [0.0f32; 7];
        let (mut noise_power, mut reference_noise) = (0.0f32, 0.0f32);
        for (x, (&c, &count)) in coefficients.iter().zip(mean).enumerate() {
            if c == 0 {
                continue;
            }
            let c = f32::from(c);
            for (lag, q) in (0usize..).zip(&mut q) {
                // q(d) takes r(x − d), d = (lag − 3)·stride.
                let at = (x + 3 * self.stride).wrapping_sub(lag * self.stride);
                let at = at.min(mean.len() - 1);
                let r = mean.get(at).map_or(0.0, |&r| f32::from(r)) * value - centre;
                *q += c * r;
            }
            let variance = self.noise.variance(f32::from(count) * value);
            noise_power += c * c * variance;
            reference_noise += self.weight(mean, mask, x) * variance;
        }
        // The reference's noise stands in h too, where it looks like texture: E Σ h(x)·n(x − k) is
        // ±f[k] times the noise, known, and taken off.
        let reference_noise = reference_noise * scale / frames.max(1.0);
        for (k, &f) in (1usize..=3).zip(self.level.half_filter()) {
            q[3 + k] -= f * reference_noise;
            q[3 - k] += f * reference_noise;
        }
        let [q_3, q_2, q_1, q0, q1, q2, q3] = q;
        let slope = (45.0 * (q1 - q_1) - 9.0 * (q2 - q_2) + (q3 - q_3)) / 60.0;
        // Standard deviation of the slope by the noise in h and r, roughly.
        let slope_sd = libm::sqrtf(noise_power * self.noise.variance(centre) / frames.max(1.0));
        if !(slope > 3.0 * slope_sd && noise_power > 0.0) {
            return;
        }
        let stride = self.stride as f32;
        let slope_px = slope / stride;
        let information = slope_px * slope_px / noise_power;
        if information * WORST_SD_PX * WORST_SD_PX < 1.0 {
            return;
        }
        // Half-way between whole shifts, six-point interpolation; then the inverse through ± ½ stride.
        let half = |a: f32, b: f32, c: f32, d: f32, e: f32, f: f32| {
            (3.0 * (a + f) - 25.0 * (b + e) + 150.0 * (c + d)) / 256.0
        };
        let right = (half(q_2, q_1, q0, q1, q2, q3) - q0) / slope_px;
        let left = (half(q_3, q_2, q_1, q0, q1, q2) - q0) / slope_px;
        let (right_error, left_error) = (0.5 * stride - right, -0.5 * stride - left);
        // right_error = A·right² + B·right³, the same for left.
        let (a, b) = match (right * right, left * left) {
            (r2, l2) if r2 > 0.0 && l2 > 0.0 && right > left => {
                let (er, el) = (right_error / r2, left_error / l2);
                let cubic = (er - el) / (right - left);
                (er - cubic * right, cubic)
            }
            _ => (0.0, 0.0),
        };
        table.px_per_product = 1.0 / slope_px;
        table.offset_px = q0 / slope_px;
        table.quadratic = rounded(a * 256.0);
        table.cubic = rounded(b * 64.0);
        table.information = (information.to_bits() >> 16) as u16;
    }
}

fn rounded(v: f32) -> i8 {
    libm::roundf(v).clamp(-127.0, 127.0) as i8
}

fn largest(coefficients: &[i8]) -> f32 {
    f32::from(
        coefficients
            .iter()
            .map(|c| c.unsigned_abs())
            .max()
            .unwrap_or(0),
    )
}

fn largest_f32(h: &[f32]) -> f32 {
    h.iter().fold(0.0, |a, h| h.abs().max(a))
}

/// h scaled to −[`MAX_COEFFICIENT`]..=[`MAX_COEFFICIENT`] with Σ = 0 exactly. Each rounding error is
/// carried on to the next pixel, which keeps the errors out of the texture's band. `None` for nothing but
/// zeros.
fn quantise(h: &[f32], coefficients: &mut [i8]) -> Option<()> {
    let limit = f32::from(MAX_COEFFICIENT - 1);
    let largest = largest_f32(h);
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let scale = limit / largest;
    let (mut carry, mut sum) = (0.0f32, 0i32);
    for (&h, c) in h.iter().zip(coefficients.iter_mut()) {
        if h == 0.0 {
            *c = 0;
            continue;
        }
        let wanted = h * scale + carry;
        let whole = libm::roundf(wanted).clamp(-limit, limit);
        carry = (wanted - whole).clamp(-1.0, 1.0);
        *c = whole as i8;
        sum += i32::from(*c);
    }
    // What is left is a unit or so: taken from the first coefficients that can give it.
    for c in coefficients.iter_mut() {
        if sum == 0 {
            return Some(());
        }
        if *c != 0 && c.abs() < MAX_COEFFICIENT {
            let step = sum.signum();
            *c -= step as i8;
            sum -= step;
        }
    }
    (sum == 0).then_some(())
}
