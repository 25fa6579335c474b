//! Plain Rust, written so that a compiler can use whatever vectors it knows of.

use super::Sums;

pub(super) fn sums_u8(pixels: &[u8], coefficients: &[i8]) -> Sums {
    let mut sums = Sums::default();
    // 64·255·4096 < 2³¹: a block's sums fit 32 bits.
    for (p, h) in pixels.chunks(4096).zip(coefficients.chunks(4096)) {
        let (mut product, mut plain) = (0i32, 0u32);
        for (&p, &h) in p.iter().zip(h) {
            product = product.wrapping_add(i32::from(p) * i32::from(h));
            plain = plain.wrapping_add(u32::from(p));
        }
        sums.product += i64::from(product);
        sums.pixels += u64::from(plain);
    }
    sums
}

pub(super) fn sums_u16(pixels: &[u16], coefficients: &[i8]) -> Sums {
    let mut sums = Sums::default();
    // 64·65535·256 < 2³¹.
    for (p, h) in pixels.chunks(256).zip(coefficients.chunks(256)) {
        let (mut product, mut plain) = (0i32, 0u32);
        for (&p, &h) in p.iter().zip(h) {
            product = product.wrapping_add(i32::from(p) * i32::from(h));
            plain = plain.wrapping_add(u32::from(p));
        }
        sums.product += i64::from(product);
        sums.pixels += u64::from(plain);
    }
    sums
}
