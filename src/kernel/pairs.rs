//! How a Cortex-M keeps coefficients: as differences, two by two, so that four of them reach the multiplier with one extension
//! and the pixels are added up on the way.
//!
//! Of a row h, what is kept of column x is g\[x\] = h\[x + 4\] − h\[x\], 0 beyond the end. Two neighbours g, g' (of an even and the
//! next column) are kept as the half-word E = 256·(−g) + g'; so they tell of K = −256·e + o of the coefficients e, o
//! themselves, as E = K(two pairs further on) − K. A sum by parts over every second pair, with R, the sum of the even pixels
//! so far,
//!
//! ```text
//! Σ R·E = −Σ p·K = 256·Σ p·e − Σ p·o,
//! ```
//!
//! and of the half-word P = 256·q + p of two pixels, its uppermost bit turned over, and the odd coefficient o, which is the
//! sum of E's lower bytes so far,
//!
//! ```text
//! Σ (P − 32768)·o = 256·Σ q·o + Σ p·o − 32768·Σ o.
//! ```
//!
//! Where Σ o = 0, the sum of both is 256 times the inner product, and R at the end is the sum of the even pixels. Nothing is
//! rounded, and what does not fit 32 bits on the way comes back. What can be kept so: [`can_keep`].

/// From a coefficient to the one that it is taken from; and columns at either end whose coefficients must be 0.
const STEP: usize = 4;

/// Largest magnitude of a coefficient: their differences fit a byte, and 256 times those half a word.
pub(super) const MOST: i8 = 63;

/// What is kept as `pair`: of the even and of the odd column.
#[inline(always)]
const fn apart(pair: [i8; 2]) -> [i8; 2] {
    let word = i16::from_le_bytes([pair[0] as u8, pair[1] as u8]);
    let odd = pair[0];
    [(odd as i16).wrapping_sub(word).wrapping_shr(8) as i8, odd]
}

/// How these two are kept.
#[inline(always)]
const fn pair(even: i8, odd: i8) -> [i8; 2] {
    let word = (odd as i16).wrapping_sub((even as i16) << 8);
    let [low, high] = word.to_le_bytes();
    [low as i8, high as i8]
}

/// A row can be kept: none of it is beyond [`MOST`], four columns at either end are 0, and so is the sum of the odd ones.
pub(super) fn can_keep(row: &[i8]) -> bool {
    let ends = row.iter().take(STEP).chain(row.iter().rev().take(STEP));
    let odd = row.iter().skip(1).step_by(2);
    row.iter().all(|h| h.unsigned_abs() <= MOST.unsigned_abs())
        && ends.into_iter().all(|&h| h == 0)
        && odd.map(|&h| i32::from(h)).sum::<i32>() == 0
}

/// Keeps these columns, of which the first is even; all before them are kept already.
pub(super) fn keep(row: &mut [i8], span: core::ops::Range<usize>) {
    let n = span.len();
    let mut row = row.get_mut(span.start..).unwrap_or_default();
    for _ in 0..n / 2 {
        let [even, odd, later @ ..] = row else { return };
        // The last four are 0.
        let (c, d) = match later {
            &mut [_, _, c, d, ..] => (c, d),
            _ => (0, 0),
        };
        [*even, *odd] = pair(c.wrapping_sub(*even), d.wrapping_sub(*odd));
        row = later;
    }
}

/// The four coefficients from column `from`, an even one, on, as a processor has them: two half-words, the first below.
pub(super) fn from(row: &[i8], from: usize) -> u32 {
    let mut all = 0u32;
    let row = row.get(..from & !1).unwrap_or(row);
    let (words, rest) = row.as_chunks::<STEP>();
    // Both halves are added up apart: what one carries must not reach the other.
    let add = |all: u32, word: u32| {
        const UPPERMOST: u32 = 0x8000_8000;
        ((all & !UPPERMOST) + (word & !UPPERMOST)) ^ ((all ^ word) & UPPERMOST)
    };
    for word in words {
        all = add(all, u32::from_le_bytes(word.map(|byte| byte as u8)));
    }
    if let &[a, b, ..] = rest {
        all = add(all, u32::from_le_bytes([a as u8, b as u8, 0, 0])).rotate_right(16);
    }
    all
}

/// The four apart.
#[cfg_attr(not(any(test, target_arch = "arm")), allow(dead_code))]
#[inline(always)]
pub(super) fn of_lanes(lanes: u32) -> [i8; STEP] {
    let [a, b, c, d] = lanes.to_le_bytes().map(|byte| byte as i8);
    let ([a, b], [c, d]) = (apart([a, b]), apart([c, d]));
    [a, b, c, d]
}

/// What was kept by [`keep`], from column `from` on.
pub(super) fn plain(row: &[i8], from: usize) -> impl Iterator<Item = i8> {
    let first = from & !1;
    let mut lanes = self::from(row, first);
    // The last of an odd number is 0 and stays so.
    let pairs = row.get(first..).unwrap_or_default().chunks(2);
    let all = pairs.flat_map(move |both| match *both {
        [a, b] => next_two([a, b], &mut lanes),
        _ => [0; 2],
    });
    all.take(row.len().saturating_sub(first)).skip(from & 1)
}

/// The next two coefficients: the lower half of `lanes`, which becomes that of the next pair.
#[inline(always)]
pub(super) fn next_two(kept: [i8; 2], lanes: &mut u32) -> [i8; 2] {
    let kept = u16::from_le_bytes(kept.map(|byte| byte as u8));
    let here = *lanes as u16;
    *lanes = *lanes >> 16 | u32::from(here.wrapping_add(kept)) << 16;
    apart(here.to_le_bytes().map(|byte| byte as i8))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    /// Makes of any row one that can be kept.
    pub(crate) fn keepable(row: &mut [i8]) {
        let n = row.len();
        for (x, h) in row.iter_mut().enumerate() {
            let end = x < STEP || x + STEP >= n;
            *h = if end { 0 } else { (*h).clamp(-MOST, MOST) };
        }
        let inner = row
            .get_mut(STEP..n.saturating_sub(STEP))
            .unwrap_or_default();
        let mut sum: i32 = inner.iter().skip(1).step_by(2).map(|&h| i32::from(h)).sum();
        for h in inner.iter_mut().skip(1).step_by(2) {
            let new = (i32::from(*h) - sum).clamp(-i32::from(MOST), i32::from(MOST));
            sum -= i32::from(*h) - new;
            *h = new as i8;
        }
        assert!(can_keep(row));
    }

    proptest::proptest! {
        #[test]
        fn what_is_kept_comes_out(
            mut row in proptest::collection::vec(-64i8..=64, 0..80),
            at in 0usize..80,
            cut in 0usize..80,
        ) {
            keepable(&mut row);
            let mut kept = row.clone();
            let cut = cut.min(row.len()) & !1;
            keep(&mut kept, 0..cut);
            keep(&mut kept, cut..row.len());
            let out: Vec<i8> = plain(&kept, at).collect();
            proptest::prop_assert_eq!(&out[..], row.get(at..).unwrap_or_default());
            let at = at.min(row.len()) & !1;
            let four: Vec<i8> = row[at..].iter().copied().chain([0; 4]).take(4).collect();
            proptest::prop_assert_eq!(&of_lanes(from(&kept, at))[..], &four[..]);
        }

        /// The identity that the kernel is built on, in its own arithmetic.
        #[test]
        fn a_sum_by_parts_is_the_inner_product(
            line in proptest::collection::vec((0u8.., -64i8..=64), 0..512),
        ) {
            let mut row: Vec<i8> = line.iter().map(|&(_, h)| h).collect();
            row.truncate(row.len() & !3);
            keepable(&mut row);
            let product: i32 = line.iter().zip(&row).map(|(&(p, _), &h)| i32::from(p) * i32::from(h)).sum();
            keep(&mut row, 0..line.len());
            let (mut all, mut so_far, mut odd) = (0i32, [0i16; 2], [0i16; 2]);
            for (line, kept) in line.as_chunks::<4>().0.iter().zip(row.as_chunks::<4>().0) {
                for lane in 0..2 {
                    let (p, q) = (line[2 * lane].0, line[2 * lane + 1].0);
                    let pair = i16::from_le_bytes([kept[2 * lane] as u8, kept[2 * lane + 1] as u8]);
                    let turned = (u16::from_le_bytes([p, q]) ^ 0x8000) as i16;
                    so_far[lane] += i16::from(p);
                    all = all.wrapping_add(i32::from(so_far[lane]) * i32::from(pair));
                    all = all.wrapping_add(i32::from(turned) * i32::from(odd[lane]));
                    odd[lane] += i16::from(pair as i8);
                }
            }
            proptest::prop_assert_eq!(all >> 8, product);
            let even: i32 = line[..row.len()].iter().step_by(2).map(|&(p, _)| i32::from(p)).sum();
            proptest::prop_assert_eq!(even, so_far.iter().map(|&s| i32::from(s)).sum::<i32>());
        }
    }

    #[test]
    fn what_cannot_be_kept_is_told() {
        let mut row = [0i8; 16];
        assert!(can_keep(&row) && can_keep(&[]));
        row[5] = 3;
        assert!(!can_keep(&row), "the odd ones' sum");
        row[7] = -3;
        assert!(can_keep(&row));
        row[6] = 64;
        assert!(!can_keep(&row), "too large");
        (row[6], row[12]) = (0, 1);
        assert!(!can_keep(&row), "an end");
    }
}
