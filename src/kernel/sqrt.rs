//! The square root: an instruction where the core library lets nobody have it.

/// √`v`, correctly rounded; NaN below 0. The same bits as [`libm::sqrtf`], whose 460 bytes and 60 instructions
/// a Cortex-M with a float unit need not spend.
#[inline(always)]
pub(crate) fn sqrtf(v: f32) -> f32 {
    // Every processor that passes floats in float registers has the instruction.
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    {
        let mut bits = v.to_bits();
        // SAFETY: the float register is given back as it was found (stable Rust cannot name one on this target).
        unsafe {
            core::arch::asm!(
                "vmov {kept}, s0",
                "vmov s0, {bits}",
                "vsqrt.f32 s0, s0",
                "vmov {bits}, s0",
                "vmov s0, {kept}",
                bits = inout(reg) bits,
                kept = out(reg) _,
                options(pure, nomem, nostack),
            );
        }
        f32::from_bits(bits)
    }
    #[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
    libm::sqrtf(v)
}
