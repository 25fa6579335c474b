//! How a Cortex-M keeps coefficients: two by two, so that one extension less brings four of them to the multiplier.
//!
//! Two neighbours e, o (of an even and the next column) are kept as the half-word 256·e − o. For the pixels p, q above
//! them, of which a processor has the half-word P = 256·q + p and, by one extension, p alone,
//!
//! ```text
//! p·(256·e − o) + (32767 − P)·(−o) = 256·(e·p + o·q) − 32767·o
//! ```
//!
//! where −o is the half-word's lower byte and 32767 − P is P with all bits but the uppermost turned over. So the sum over a
//! row is 256 times the inner product, less 32767·Σ o; and Σ o, where it is small, stands in the sum's last byte, as
//! 32767 is −1 there. Nothing is rounded.

use super::MAX_COEFFICIENT;

/// Largest |Σ o| that a byte tells.
const MOST_ODD: i32 = 127;

/// The two that are kept as `pair`.
#[inline(always)]
const fn apart(pair: [i8; 2]) -> (i8, i8) {
    let word = i16::from_le_bytes([pair[0] as u8, pair[1] as u8]);
    let low = pair[0] as i16;
    (
        (word.wrapping_sub(low) >> 8) as i8,
        low.wrapping_neg() as i8,
    )
}

/// How these two are kept.
#[inline(always)]
const fn pair(even: i8, odd: i8) -> [i8; 2] {
    let word = ((even as i16) << 8).wrapping_sub(odd as i16);
    let [low, high] = word.to_le_bytes();
    [low as i8, high as i8]
}

/// Makes |Σ o| small enough for [`keep`] and leaves Σ h as it is: a row of which it is not so has a texture of two pixels a
/// period, or of two colours. False where that cannot be.
pub(super) fn even_out(row: &mut [i8]) -> bool {
    let (pairs, _) = row.as_chunks_mut::<2>();
    let most = MAX_COEFFICIENT.unsigned_abs();
    let mut sum: i32 = pairs.iter().map(|&[_, odd]| i32::from(odd)).sum();
    while sum.abs() > MOST_ODD {
        let (before, step) = (sum, sum.signum() as i8);
        for [even, odd] in pairs.iter_mut() {
            let used = *even != 0 && *odd != 0;
            let room = even.unsigned_abs() < most && odd.unsigned_abs() < most;
            if used && room && sum.abs() > MOST_ODD {
                *odd -= step;
                *even += step;
                sum -= i32::from(step);
            }
        }
        if sum == before {
            return false;
        }
    }
    true
}

/// Two by two. The last of an odd number stays as it is.
pub(super) fn keep(row: &mut [i8]) {
    for both in row.as_chunks_mut::<2>().0 {
        *both = pair(both[0], both[1]);
    }
}

/// What was kept by [`keep`], from column `from` on.
pub(super) fn plain(row: &[i8], from: usize) -> impl Iterator<Item = i8> {
    // Pairs are not cut.
    let (pairs, last) = row.get(from & !1..).unwrap_or_default().as_chunks::<2>();
    let all = pairs.iter().flat_map(|&both| {
        let (even, odd) = apart(both);
        [even, odd]
    });
    all.chain(last.iter().copied()).skip(from & 1)
}

/// Moves a row that was kept by one column, to the right or to the left; what comes in is 0.
pub(super) fn move_by_one(row: &mut [i8], right: bool) {
    let (pairs, last) = row.as_chunks_mut::<2>();
    let last = last.first_mut();
    if right {
        let mut before = 0;
        for both in pairs {
            let (even, odd) = apart(*both);
            *both = pair(before, even);
            before = odd;
        }
        if let Some(last) = last {
            *last = before;
        }
    } else {
        let mut after = last.map_or(0, core::mem::take);
        for both in pairs.iter_mut().rev() {
            let (even, odd) = apart(*both);
            *both = pair(odd, after);
            after = even;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    const MOST: i8 = crate::kernel::MAX_COEFFICIENT;

    proptest::proptest! {
        #[test]
        fn what_is_kept_comes_out_and_moves(
            row in proptest::collection::vec(-MOST..=MOST, 0..80),
            from in 0usize..80,
        ) {
            let mut kept = row.clone();
            keep(&mut kept);
            let out: Vec<i8> = plain(&kept, from).collect();
            proptest::prop_assert_eq!(&out[..], row.get(from..).unwrap_or_default());
            for right in [true, false] {
                let mut kept = kept.clone();
                move_by_one(&mut kept, right);
                let out: Vec<i8> = plain(&kept, 0).collect();
                let mut moved = row.clone();
                if !moved.is_empty() {
                    match right {
                        true => moved.rotate_right(1),
                        false => moved.rotate_left(1),
                    }
                    let edge = if right { 0 } else { moved.len() - 1 };
                    moved[edge] = 0;
                }
                proptest::prop_assert_eq!(&out, &moved);
            }
        }

        /// The identity that the kernel is built on, and the sum of the odd ones in its last byte.
        #[test]
        fn a_sum_over_pairs_tells_both_sums(
            line in proptest::collection::vec((0u8.., -MOST..=MOST), 0..256),
        ) {
            let mut row: Vec<i8> = line.iter().map(|&(_, h)| h).collect();
            row.truncate(row.len() & !1);
            let sum: i32 = row.iter().map(|&h| i32::from(h)).sum();
            proptest::prop_assume!(even_out(&mut row));
            proptest::prop_assert_eq!(sum, row.iter().map(|&h| i32::from(h)).sum());
            let mut kept = row.clone();
            keep(&mut kept);
            let both = kept.as_chunks::<2>().0.iter().zip(line.as_chunks::<2>().0);
            let all = both.fold(0i32, |all, (pair, [(p, _), (q, _)])| {
                let kept = i16::from_le_bytes([pair[0] as u8, pair[1] as u8]);
                let word = u16::from_le_bytes([*p, *q]) ^ 0x7FFF;
                all + i32::from(*p) * i32::from(kept) + i32::from(word as i16) * i32::from(pair[0])
            });
            let odd = i32::from(all as i8);
            let product = ((all - odd) >> 8) + 128 * odd;
            let exact: i32 = line.iter().zip(&row).map(|(&(p, _), &h)| i32::from(p) * i32::from(h)).sum();
            proptest::prop_assert_eq!(product, exact);
        }
    }

    #[test]
    fn odd_columns_are_evened_out_where_that_can_be() {
        let mut stripes: Vec<i8> = (0..256)
            .map(|x| if x % 2 == 0 { 40 } else { -40 })
            .collect();
        assert!(even_out(&mut stripes));
        let odd: i32 = stripes
            .iter()
            .skip(1)
            .step_by(2)
            .map(|&h| i32::from(h))
            .sum();
        assert!(odd.abs() <= MOST_ODD && stripes.iter().map(|&h| i32::from(h)).sum::<i32>() == 0);
        // Nothing that could take it.
        let mut alone = [0i8; 64];
        alone.iter_mut().skip(1).step_by(2).for_each(|h| *h = 60);
        assert!(!even_out(&mut alone));
    }
}
