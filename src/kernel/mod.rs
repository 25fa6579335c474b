//! The inner products of a line: the only code that must be fast, and the only unsafe code.
//!
//! For pixels `p` and coefficients `h` of equal length each kernel returns Σ h·p and Σ p, exactly, so
//! all of them give the same bits. The fastest one that the processor offers is chosen once, at start.
//!
//! A row's coefficients are made once and read with every line: [`Kernel::keep`] brings them into the form that a kernel
//! likes best.
//!
//! |h| ≤ [`MAX_COEFFICIENT`], so that a pair of products u8 × i8 never leaves 16 bits.
#![allow(unsafe_code)]

#[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
mod aarch64;
#[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
mod cortex_m;
mod kept;
mod pairs;
mod portable;
pub(crate) mod spread;
mod sqrt;
#[cfg(target_arch = "x86_64")]
mod x86_64;
#[cfg(target_arch = "x86_64")]
mod x86_64_avx512;

pub use kept::LineSums;
pub(crate) use sqrt::sqrtf;

/// Largest magnitude of a coefficient: 2·64·255 < 2¹⁵.
pub const MAX_COEFFICIENT: i8 = 64;

/// Σ h·p and Σ p of one line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// Σ h·p.
    pub product: i64,
    /// Σ p.
    pub pixels: u64,
}

/// Work that is worth compiling for wide vectors; its `run` must be `#[inline(always)]`, and so must be
/// what it calls.
pub(crate) trait Wide {
    /// What comes of it.
    type Out;
    /// The work.
    fn run(self) -> Self::Out;
}

/// What stands in front of the point of 0 ≤ `v` < 2¹⁶. A cast does the same and is one instruction of most
/// processors; on x86-64 it stays one value at a time, and this becomes vectors.
#[inline(always)]
pub(crate) fn whole(v: f32) -> u16 {
    if cfg!(not(target_arch = "x86_64")) {
        return v as u16;
    }
    // From 2²³ to 2²⁴ an f32 has no bits behind the point, and what is in front of it stands in its last bits.
    const POINT_AT_THE_END: f32 = 8_388_608.0;
    let nearest = v + POINT_AT_THE_END;
    let above = nearest - POINT_AT_THE_END > v;
    (nearest.to_bits() - u32::from(above)) as u16
}

/// Asks memory for what will be read some lines later, where a processor can be asked: it reads other things meanwhile.
#[inline(always)]
pub(crate) fn ask_for<T>(later: &[T]) {
    #[cfg(target_arch = "x86_64")]
    for some in later.chunks((64 / size_of::<T>().max(1)).max(1)) {
        x86_64::ask(some.as_ptr().cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = later;
}

/// Which implementation is used. Only those that the processor can run can be had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel(Kind, Columns);

/// Which columns' pixels tell of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Columns {
    All,
    /// Every second, the first included.
    Even,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Plain Rust, for every machine.
    Portable,
    /// Cortex-M with the DSP extension: two products an instruction.
    #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
    CortexM,
    /// x86-64 with AVX2: 32 pixels a step.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// x86-64 with AVX-512 and VNNI: 64 pixels a step.
    #[cfg(target_arch = "x86_64")]
    Avx512 {
        /// Byte permutations (VBMI) besides.
        vbmi: bool,
    },
    /// 64-bit Arm: 16 pixels a step.
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    Neon,
    /// 64-bit Arm with the dot product of ARMv8.2.
    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    NeonDot,
}

impl Kernel {
    /// Plain Rust, for every machine.
    pub const PORTABLE: Self = Self(Kind::Portable, Columns::All);

    /// The fastest kernel that this processor can run.
    pub fn detect() -> Self {
        Self(Self::fastest(), Columns::All)
    }

    #[cfg(target_arch = "x86_64")]
    fn fastest() -> Kind {
        let features = x86_64::Features::detect();
        if features.avx512_vnni {
            let vbmi = features.avx512_vbmi;
            Kind::Avx512 { vbmi }
        } else if features.avx2 {
            Kind::Avx2
        } else {
            Kind::Portable
        }
    }

    #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
    fn fastest() -> Kind {
        Kind::CortexM
    }

    #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
    fn fastest() -> Kind {
        if aarch64::has_dot_product() {
            Kind::NeonDot
        } else {
            Kind::Neon
        }
    }

    #[cfg(not(any(
        target_arch = "x86_64",
        all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)),
        all(target_arch = "aarch64", target_feature = "neon")
    )))]
    fn fastest() -> Kind {
        Kind::Portable
    }

    /// All kernels that this processor can run, [`Kernel::PORTABLE`] first.
    pub fn all() -> impl Iterator<Item = Self> {
        let best = Self::fastest();
        let slower = [
            Some(Kind::Portable),
            // Every processor with the dot product has the rest of NEON too, every one with AVX-512 AVX2.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Some(Kind::Neon),
            #[cfg(target_arch = "x86_64")]
            matches!(best, Kind::Avx512 { .. }).then_some(Kind::Avx2),
            #[cfg(target_arch = "x86_64")]
            (best == Kind::Avx512 { vbmi: true }).then_some(Kind::Avx512 { vbmi: false }),
        ];
        let better = (!slower.contains(&Some(best))).then_some(best);
        let all = slower.into_iter().flatten().chain(better);
        all.map(|kind| Self(kind, Columns::All))
    }

    /// Runs work on floats, compiled for the vectors that this kernel's processor has. The bits are the
    /// same as anywhere: Rust neither reorders float arithmetic nor fuses it.
    #[inline(always)]
    pub(crate) fn run<W: Wide>(self, wide: W) -> W::Out {
        match self.0 {
            // SAFETY: `fastest` made this kind after it asked the processor for AVX2.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86_64::run(wide) },
            // SAFETY: `fastest` made this kind after it asked for all of AVX-512 that this needs.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 { .. } => unsafe { x86_64_avx512::run(wide) },
            _ => wide.run(),
        }
    }

    /// Sums over 8-bit pixels. The shorter length of the two counts. |h| ≤ [`MAX_COEFFICIENT`], or the
    /// sums are unspecified (never unsafe).
    #[inline(always)]
    pub fn sums_u8(self, pixels: &[u8], coefficients: &[i8]) -> Sums {
        match self.0 {
            Kind::Portable => portable::sums_u8(pixels, coefficients),
            #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
            Kind::CortexM => cortex_m::sums_u8(pixels, coefficients),
            // SAFETY: `fastest` made this kind after it asked the processor for AVX2.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86_64::sums_u8(pixels, coefficients) },
            // SAFETY: `fastest` made this kind after it asked for all of AVX-512 that these need.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 { .. } => unsafe { x86_64_avx512::sums_u8(pixels, coefficients) },
            // SAFETY: the program was compiled for processors with NEON.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon => unsafe { spread::Bytes::sums_neon(pixels, coefficients) },
            // SAFETY: `fastest` made this kind after it asked for the dot product.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::NeonDot => unsafe { spread::Bytes::sums_dot(pixels, coefficients) },
        }
    }

    /// [`Kernel::sums_u8`], and Σ h'·p with a second row of coefficients: the pixels are loaded once. The shortest length of the
    /// three counts.
    #[inline(always)]
    pub(crate) fn both_u8(self, pixels: &[u8], coefficients: &[i8], second: &[i8]) -> (Sums, i64) {
        let n = pixels.len().min(coefficients.len()).min(second.len());
        let (pixels, coefficients, second) = (&pixels[..n], &coefficients[..n], &second[..n]);
        match self.0 {
            // SAFETY: as for `sums_u8`.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86_64::both_u8(pixels, coefficients, second) },
            // SAFETY: as for `sums_u8`.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 { .. } => unsafe { x86_64_avx512::both_u8(pixels, coefficients, second) },
            // SAFETY: the program was compiled for processors with NEON.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon => unsafe { aarch64::both_neon(pixels, coefficients, second) },
            // SAFETY: `fastest` made this kind after it asked for the dot product.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::NeonDot => unsafe { aarch64::both_dot(pixels, coefficients, second) },
            _ => (
                self.sums_u8(pixels, coefficients),
                self.sums_u8(pixels, second).product,
            ),
        }
    }

    /// Σ h·p alone, over 16-bit pixels.
    #[inline]
    pub(crate) fn product_u16(self, pixels: &[u16], coefficients: &[i8]) -> i64 {
        #[cfg(target_arch = "arm")]
        return portable::product_u16(pixels, coefficients);
        #[cfg(not(target_arch = "arm"))]
        self.sums_u16(pixels, coefficients).product
    }

    /// Sums over 16-bit pixels, as [`Kernel::sums_u8`].
    #[inline]
    pub fn sums_u16(self, pixels: &[u16], coefficients: &[i8]) -> Sums {
        match self.0 {
            Kind::Portable => portable::sums_u16(pixels, coefficients),
            // Deeper pixels come from larger boards: plain Rust serves.
            #[cfg(all(target_arch = "arm", any(target_feature = "dsp", rowtone_dsp)))]
            Kind::CortexM => portable::sums_u16(pixels, coefficients),
            // SAFETY: as for `sums_u8`.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86_64::sums_u16(pixels, coefficients) },
            // SAFETY: as for `sums_u8`.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 { .. } => unsafe { x86_64_avx512::sums_u16(pixels, coefficients) },
            // SAFETY: as for `sums_u8`.
            #[cfg(all(target_arch = "aarch64", target_feature = "neon"))]
            Kind::Neon | Kind::NeonDot => unsafe { aarch64::sums_u16(pixels, coefficients) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    /// A small generator: the tests need nothing better (Knuth's MMIX constants).
    fn bytes(seed: u64, n: usize) -> impl Iterator<Item = u8> {
        let mut state = seed;
        (0..n).map(move |_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 56) as u8
        })
    }

    /// One after the other, in 64 bits.
    fn exact<P: Copy + Into<i64>>(pixels: &[P], coefficients: &[i8]) -> Sums {
        let pairs = pixels.iter().zip(coefficients);
        Sums {
            product: pairs.map(|(&p, &h)| p.into() * i64::from(h)).sum(),
            pixels: pixels.iter().map(|&p| p.into() as u64).sum(),
        }
    }

    #[test]
    fn all_kernels_give_the_same_bits() {
        for n in (0..200).chain([255, 256, 257, 640, 1536, 4096, 8192, 70_001]) {
            let h: Vec<i8> = bytes(n as u64, n)
                .map(|b| (i16::from(b % 129) - 64) as i8)
                .collect();
            let p: Vec<u8> = bytes(n as u64 + 7, n).collect();
            let deep: Vec<u16> = bytes(3, 2 * n)
                .collect::<Vec<_>>()
                .chunks(2)
                .map(|b| u16::from_le_bytes([b[0], b[1]]))
                .collect();
            let (full, full_deep) = (std::vec![255u8; n], std::vec![65535u16; n]);
            let (zero, zero_deep) = (std::vec![0u8; n], std::vec![0u16; n]);
            let signs: Vec<i8> = h.iter().map(|&h| if h < 0 { -64 } else { 64 }).collect();
            let most = std::vec![-MAX_COEFFICIENT; n];
            for kernel in Kernel::all() {
                for (p, h) in [(&p, &h), (&full, &signs), (&zero, &most), (&full, &most)] {
                    assert_eq!(kernel.sums_u8(p, h), exact(p, h), "{kernel:?} {n}");
                    for second in [&most, &signs] {
                        let both = (exact(p, h), exact(p, second).product);
                        assert_eq!(kernel.both_u8(p, h, second), both, "{kernel:?} {n}");
                    }
                }
                for (p, h) in [
                    (&deep, &h),
                    (&full_deep, &signs),
                    (&zero_deep, &most),
                    (&full_deep, &most),
                ] {
                    assert_eq!(kernel.sums_u16(p, h), exact(p, h), "{kernel:?} {n}");
                    assert_eq!(portable::product_u16(p, h), exact(p, h).product, "{n}");
                }
            }
        }
    }

    proptest::proptest! {
        /// Half the light: whole rows and parts of any row, pixels of any depth, side by side and spread.
        #[test]
        fn half_the_light_is_that_of_the_even_columns(
            mut line in proptest::collection::vec((0u16.., -MAX_COEFFICIENT..=MAX_COEFFICIENT), 0..600),
            from in 0usize..40,
        ) {
            line.iter_mut().for_each(|(p, _)| *p &= 0x7FF);
            let mut row: Vec<i8> = line.iter().map(|&(_, h)| h).collect();
            pairs::tests::keepable(&mut row);
            let from = from.min(row.len());
            let deep: Vec<u16> = line[from..].iter().map(|&(p, _)| p).collect();
            let bytes: Vec<u8> = deep.iter().map(|&p| p as u8).collect();
            let words: Vec<u8> = bytes.iter().flat_map(|&p| [99, p]).collect();
            let part = &row[from..];
            let even = |values: &[u16]| -> u64 {
                let even = values.iter().skip(from % 2).step_by(2);
                even.map(|&p| u64::from(p)).sum()
            };
            let values: Vec<u16> = bytes.iter().map(|&p| p.into()).collect();
            for kernel in Kernel::all() {
                let half = kernel.with_half_the_light();
                let mut kept = row.clone();
                proptest::prop_assert!(half.keep(&mut kept));
                for (kernel, light, light_deep) in [
                    (kernel, exact(&bytes, part).pixels, exact(&deep, part).pixels),
                    (half, even(&values), even(&deep)),
                ] {
                    let sums = LineSums { product: exact(&bytes, part).product as i32, pixels: light as u32 };
                    proptest::prop_assert_eq!(kernel.kept_part_u8(&bytes, &kept, from), sums);
                    let deep_sums = Sums { pixels: light_deep, ..exact(&deep, part) };
                    proptest::prop_assert_eq!(kernel.kept_part_u16(&deep, &kept, from), deep_sums);
                    proptest::prop_assert_eq!(u64::from(kernel.light(from, &deep)), light_deep);
                    if from == 0 {
                        proptest::prop_assert_eq!(kernel.kept_u8(&bytes, &kept), sums);
                        let both = (sums, sums.product);
                        proptest::prop_assert_eq!(kernel.kept_both_u8(&bytes, &kept, &kept), both);
                        proptest::prop_assert_eq!(kernel.kept_spread(spread::Spread::Words, &words, &kept), sums);
                    }
                }
            }
        }

        /// Lines of any length that begin anywhere, with any pixels and coefficients.
        #[test]
        fn all_kernels_are_exact(
            line in proptest::collection::vec((0u16.., -MAX_COEFFICIENT..=MAX_COEFFICIENT), 0..2000),
            skip in 0usize..64,
        ) {
            let h: Vec<i8> = line.iter().map(|&(_, h)| h).collect();
            let deep: Vec<u16> = line.iter().map(|&(p, _)| p).collect();
            let bytes: Vec<u8> = deep.iter().map(|&p| p as u8).collect();
            // Starts that are no multiple of a vector.
            let at = skip.min(h.len());
            for kernel in Kernel::all() {
                proptest::prop_assert_eq!(kernel.sums_u8(&bytes[at..], &h[at..]), exact(&bytes[at..], &h[at..]));
                proptest::prop_assert_eq!(kernel.sums_u16(&deep[at..], &h[at..]), exact(&deep[at..], &h[at..]));
            }
        }
    }

    #[test]
    fn whole_numbers_are_those_of_a_cast() {
        // Up to four bits behind the point, of both kinds of whole number.
        for sixteenths in (0u32..70_000).chain(1_000_000..1_048_560) {
            let v = sixteenths as f32 / 16.0;
            assert_eq!(whole(v), v as u16, "{v}");
        }
        for v in [0.999_999_94, 65_534.996, 65_535.0] {
            assert_eq!(whole(v), v as u16, "{v}");
        }
    }

    /// tools/test-aarch64.sh says which kernel each of its processors must choose.
    #[test]
    fn the_expected_kernel_is_chosen() {
        if let Some(expected) = std::env::var_os("ROWTONE_EXPECT_KERNEL") {
            assert_eq!(
                std::format!("{:?}", Kernel::detect().0),
                expected.to_string_lossy()
            );
        }
    }

    #[test]
    fn the_shorter_side_counts() {
        for kernel in Kernel::all() {
            assert_eq!(kernel.sums_u8(&[1, 2, 3], &[10, 10]).product, 30);
            assert_eq!(kernel.sums_u16(&[1], &[10, 10, 10]).product, 10);
            assert_eq!(kernel.sums_u8(&[], &[]), Sums::default());
        }
    }
}
