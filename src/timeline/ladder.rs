//! Weighted moments of equidistant rows, by addition alone.

/// Each rung adds up the one before it: a row of weight w adds w to the first sum, that to the second, and so
/// on. A row that lies m rows before the next one has then been added C(m + k − 1, k) times to sum k (m = 1 for
/// the last), so that the sums are Σ w, Σ w·m, Σ w·m(m+1)/2 and Σ w·m(m+1)(m+2)/6.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ladder([f32; 4]);

/// Where the weight of rows lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    /// From the mean to the row that comes next, rows.
    pub(super) to_next: f32,
    /// Mean square about the mean, rows².
    pub(super) variance: f32,
    /// Mean cube about the mean, rows³: above 0 with little weight far behind it.
    pub(super) third: f32,
}

impl Ladder {
    /// The next row has this weight.
    #[inline(always)]
    pub(super) fn add(&mut self, weight: f32) {
        let [w, first, second, third] = self.0;
        let w = w + weight;
        let first = first + w;
        let second = second + first;
        self.0 = [w, first, second, third + second];
    }

    /// The next `rows` rows have none.
    pub(super) fn skip(&mut self, rows: u16) {
        for _ in 0..rows {
            self.add(0.0);
        }
    }

    /// Weight of all rows.
    #[inline(always)]
    pub(super) fn weight(&self) -> f32 {
        self.0[0]
    }

    /// Moments of the rows; `per_weight`: 1 over the weight of all.
    #[inline(always)]
    pub(super) fn moments(&self, per_weight: f32) -> Moments {
        let [_, first, second, third] = self.0;
        let to_next = first * per_weight;
        let square = 2.0 * second * per_weight - to_next;
        let cube = 6.0 * third * per_weight - 3.0 * square - 2.0 * to_next;
        let variance = square - to_next * to_next;
        Moments {
            to_next,
            variance: if variance > 0.0 { variance } else { 0.0 },
            // Counted backwards.
            third: to_next * (3.0 * square - 2.0 * to_next * to_next) - cube,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_moments_are_those_of_the_rows() {
        // Row and weight; rows between have none.
        let rows = [
            (0u8, 3.0),
            (1, 0.5),
            (4, 7.0),
            (5, 1.0),
            (9, 2.0),
            (22, 0.25),
        ];
        let mut ladder = Ladder::default();
        let mut next = 0;
        for (row, weight) in rows {
            ladder.skip(u16::from(row - next));
            ladder.add(weight);
            next = row + 1;
        }
        let mean_of = |f: &dyn Fn(f32) -> f32| {
            let sum: f32 = rows.iter().map(|&(row, w)| w * f(f32::from(row))).sum();
            sum / rows.iter().map(|&(_, w)| w).sum::<f32>()
        };
        let mean = mean_of(&|x| x);
        let Moments {
            to_next,
            variance,
            third,
        } = ladder.moments(1.0 / ladder.weight());
        assert!((23.0 - to_next - mean).abs() < 1e-5);
        assert!((variance - mean_of(&|x| (x - mean) * (x - mean))).abs() < 1e-4);
        assert!((third / mean_of(&|x| (x - mean) * (x - mean) * (x - mean)) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_whole_picture_of_equal_rows_is_even() {
        let mut ladder = Ladder::default();
        (0..1080).for_each(|_| ladder.add(1e4));
        let moments = ladder.moments(1.0 / ladder.weight());
        let variance = (1080.0 * 1080.0 - 1.0) / 12.0;
        assert!((moments.variance / variance - 1.0).abs() < 1e-4);
        // Of 1080³.
        assert!(moments.third.abs() < 1e-4 * variance * 1080.0);
    }
}
