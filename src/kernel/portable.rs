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

/// Σ h·p alone, for a processor without vectors: eight at a time, so that little else is done.
#[cfg(any(test, target_arch = "arm"))]
pub(super) fn product_u16(pixels: &[u16], coefficients: &[i8]) -> i64 {
    let n = pixels.len().min(coefficients.len());
    let (pixels, coefficients) = (&pixels[..n], &coefficients[..n]);
    let times =
        |product: i32, (&p, &h): (&u16, &i8)| product.wrapping_add(i32::from(p) * i32::from(h));
    let mut all = 0;
    // 64·65535·256 < 2³¹.
    for (p, h) in pixels.chunks(256).zip(coefficients.chunks(256)) {
        let ((p, p_rest), (h, h_rest)) = (p.as_chunks::<8>(), h.as_chunks::<8>());
        let eights = p.iter().zip(h);
        let whole = eights.fold(0i32, |product, (p, h)| p.iter().zip(h).fold(product, times));
        all += i64::from(p_rest.iter().zip(h_rest).fold(whole, times));
    }
    all
}
