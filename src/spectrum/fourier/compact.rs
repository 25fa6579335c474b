//! One loop for all sizes, without a table.

use crate::math::cos_sin;

/// Real and imaginary part.
type Bin = [f32; 2];

/// From n points, a power of two from 64 to 8192, to real and imaginary part of bins 0 to n/2 - 1. `None` for other
/// lengths. Errors are below 2·10⁻⁶ of the points' root sum of squares.
pub(super) fn transform(points: &mut [f32]) -> Option<()> {
    if !points.len().is_power_of_two() || !(64..=8192).contains(&points.len()) {
        return None;
    }
    let (bins, _) = points.as_chunks_mut();
    transform_complex(bins);
    untangle(bins);
    Some(())
}

#[inline(always)]
fn times(a: Bin, b: Bin) -> Bin {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// e^(-2πi·k/n) for k = 0, 1, 2 …, n a power of two above 1.
struct Roots {
    /// The turn from one to the next, 2⁻³² turns.
    turn: u32,
    k: u32,
    step: Bin,
    last: Bin,
}

impl Roots {
    /// So many are had from the one before: rounding does not pile up.
    const RUN: u32 = 8;

    fn of(n: usize) -> Self {
        let turn = 1 << (32 - n.trailing_zeros());
        Self {
            turn,
            k: 0,
            step: root(turn),
            last: [1.0, 0.0],
        }
    }

    fn next(&mut self) -> Bin {
        self.last = if self.k.is_multiple_of(Self::RUN) {
            root(self.k.wrapping_mul(self.turn))
        } else {
            times(self.last, self.step)
        };
        self.k += 1;
        self.last
    }
}

fn root(turns: u32) -> Bin {
    let (re, im) = cos_sin(turns.wrapping_neg());
    [re, im]
}

fn transform_complex(bins: &mut [Bin]) {
    let n = bins.len();
    let unused = n.leading_zeros() + 1;
    for i in 0..n {
        let mirrored = i.reverse_bits() >> unused;
        if i < mirrored {
            bins.swap(i, mirrored);
        }
    }
    // The first two stages' roots are 1 and -i.
    let (fours, rest) = bins.as_chunks_mut();
    fours.iter_mut().for_each(transform_four);
    if let [a, b] = rest {
        (*a, *b) = butterfly(*a, *b);
    }
    let mut half = 4;
    while half < n {
        let mut roots = Roots::of(2 * half);
        let mut some = [[0.0; 2]; AT_A_TIME];
        for from in (0..half).step_by(AT_A_TIME) {
            some.fill_with(|| roots.next());
            for block in bins.chunks_exact_mut(2 * half) {
                let (lower, upper) = block.split_at_mut(half);
                let pairs = lower.iter_mut().zip(upper).skip(from);
                for ((a, b), &root) in pairs.zip(&some) {
                    (*a, *b) = butterfly(*a, times(*b, root));
                }
            }
        }
        half *= 2;
    }
}

/// Roots that are kept at a time: bins are then read side by side.
const AT_A_TIME: usize = 32;

#[inline(always)]
fn butterfly(a: Bin, b: Bin) -> (Bin, Bin) {
    ([a[0] + b[0], a[1] + b[1]], [a[0] - b[0], a[1] - b[1]])
}

#[inline(always)]
fn transform_four(bins: &mut [Bin; 4]) {
    let (a, b) = butterfly(bins[0], bins[1]);
    let (c, d) = butterfly(bins[2], bins[3]);
    let turned = [d[1], -d[0]];
    (bins[0], bins[2]) = butterfly(a, c);
    (bins[1], bins[3]) = butterfly(b, turned);
}

/// From the transform of the pairs to that of the points.
fn untangle(bins: &mut [Bin]) {
    let n = bins.len();
    let mut roots = Roots::of(2 * n);
    roots.next();
    let Some((first, rest)) = bins.split_first_mut() else {
        return;
    };
    *first = [first[0] + first[1], 0.0];
    let (lower, upper) = rest.split_at_mut(n / 2);
    if let Some(middle) = lower.last_mut() {
        middle[1] = -middle[1];
    }
    for (a, b) in lower.iter_mut().zip(upper.iter_mut().rev()) {
        let even = [0.5 * (a[0] + b[0]), 0.5 * (a[1] - b[1])];
        let odd = [0.5 * (a[1] + b[1]), 0.5 * (b[0] - a[0])];
        let turned = times(odd, roots.next());
        *a = [even[0] + turned[0], even[1] + turned[1]];
        *b = [even[0] - turned[0], turned[1] - even[1]];
    }
}
