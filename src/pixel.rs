//! What the stages need of a pixel, whatever its depth.

use crate::kernel::{Kernel, Sums};

/// A pixel of 8 or of up to 16 bits.
pub(crate) trait Pixel: Copy {
    /// Its value.
    fn value(self) -> u16;
    /// Σ h·p and Σ p.
    fn sums(kernel: Kernel, pixels: &[Self], coefficients: &[i8]) -> Sums;
}

impl Pixel for u8 {
    fn value(self) -> u16 {
        u16::from(self)
    }
    #[inline]
    fn sums(kernel: Kernel, pixels: &[Self], coefficients: &[i8]) -> Sums {
        kernel.sums_u8(pixels, coefficients)
    }
}

impl Pixel for u16 {
    fn value(self) -> u16 {
        self
    }
    #[inline]
    fn sums(kernel: Kernel, pixels: &[Self], coefficients: &[i8]) -> Sums {
        kernel.sums_u16(pixels, coefficients)
    }
}
