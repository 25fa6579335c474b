//! One tile of the picture against the reference, moved to where its rows are thought to be.

/// Grey values of a part of a picture, row by row.
#[derive(Clone, Debug, Default)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    /// Row `y`; beyond the edge the nearest one.
    fn row(&self, y: isize) -> &[f32] {
        let y = y.clamp(0, self.height as isize - 1) as usize;
        &self.values[y * self.width..(y + 1) * self.width]
    }

    /// Values of row `y` from column `x` on, moved by `[right, down]` px, into `to`: what stands there was `right` columns
    /// further left. Cubic convolution (Keys 1981, a = −1/2) along both axes; beyond the edge the nearest value.
    pub(super) fn moved(&self, [x, y]: [isize; 2], [right, down]: [f32; 2], to: &mut [f32]) {
        let (rows, row_taps) = taps(-down);
        let (columns, column_taps) = taps(-right);
        let mut across = [0.0_f32; MOST + 3];
        let across = &mut across[..to.len() + 3];
        for (k, tap) in (-1..).zip(row_taps) {
            let row = self.row(y + rows + k);
            let first = x + columns - 1;
            let inside = usize::try_from(first).ok();
            match inside.and_then(|first| row.get(first..first + across.len())) {
                Some(row) => add(across, row, tap),
                None => {
                    let last = self.width as isize - 1;
                    for (k, sum) in (first..).zip(across.iter_mut()) {
                        *sum += tap * row[k.clamp(0, last) as usize];
                    }
                }
            }
        }
        let [a, b, c, d] = column_taps;
        for (to, v) in to.iter_mut().zip(across.windows(4)) {
            *to = a * v[0] + b * v[1] + c * v[2] + d * v[3];
        }
    }
}

fn add(sums: &mut [f32], values: &[f32], times: f32) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += times * value;
    }
}

/// The whole part of a place, and the weights of the four values around it.
fn taps(place: f32) -> (isize, [f32; 4]) {
    let whole = place.floor();
    let f = place - whole;
    let (f2, f3) = (f * f, f * f * f);
    let weights = [
        -0.5 * f + f2 - 0.5 * f3,
        1.0 - 2.5 * f2 + 1.5 * f3,
        0.5 * f + 2.0 * f2 - 1.5 * f3,
        -0.5 * f2 + 0.5 * f3,
    ];
    (whole as isize, weights)
}

/// Longest side of a tile, and of one with the pixels around it.
pub(super) const SIDE: usize = 24;
const MOST: usize = SIDE + 2;

/// What a row of a tile, or of all of them, says of its motion: sums over its pixels, tile means taken off.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RowSums {
    /// Σ of the products of the slopes, xx, xy, yy, grey values² a px².
    pub(super) slopes: [f64; 3],
    /// Σ slope·(reference − frame), x and y.
    pub(super) pulls: [f64; 2],
    /// Σ slope·reference, x and y.
    pub(super) bright: [f64; 2],
    /// Σ reference², Σ reference·(reference − frame), Σ (reference − frame)².
    pub(super) light: [f64; 3],
    /// Pixels.
    pub(super) pixels: f64,
}

impl RowSums {
    pub(super) fn add(&mut self, other: &Self) {
        let sum = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        sum(&mut self.slopes, &other.slopes);
        sum(&mut self.pulls, &other.pulls);
        sum(&mut self.bright, &other.bright);
        sum(&mut self.light, &other.light);
        self.pixels += other.pixels;
    }
}

/// A tile: columns and rows of the part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) width: usize,
    pub(super) height: usize,
}

/// Quantities of a pixel: slopes along x and y, the reference, the reference less the frame.
const QUANTITIES: usize = 4;

impl Tile {
    /// Sums of each row of the tile, of the reference moved by `motion` of each of the part's rows, against `frame`.
    pub(super) fn sums(
        &self,
        reference: &Plane,
        frame: &Plane,
        motion: impl Fn(usize) -> [f32; 2],
        mut take: impl FnMut(usize, RowSums),
    ) {
        let (w, h) = (self.width, self.height);
        let mut patch = [[0.0_f32; MOST]; MOST];
        for (k, row) in patch[..h + 2].iter_mut().enumerate() {
            let y = (self.y + k).saturating_sub(1).min(frame.height - 1);
            let place = [self.x as isize - 1, (self.y + k) as isize - 1];
            reference.moved(place, motion(y), &mut row[..w + 2]);
        }
        let mut all = [[[0.0_f32; SIDE]; QUANTITIES]; SIDE];
        let mut means = [0.0_f32; QUANTITIES];
        for (k, values) in all[..h].iter_mut().enumerate() {
            let [above, here, below] = [&patch[k], &patch[k + 1], &patch[k + 2]];
            let at = (self.y + k) * frame.width + self.x;
            let pixels = &frame.values[at..at + w];
            let [right, down, light, off] = values;
            for x in 0..w {
                right[x] = 0.5 * (here[x + 2] - here[x]);
                down[x] = 0.5 * (below[x + 1] - above[x + 1]);
                light[x] = here[x + 1];
                off[x] = here[x + 1] - pixels[x];
            }
            for (mean, values) in means.iter_mut().zip(&*values) {
                *mean += values[..w].iter().sum::<f32>();
            }
        }
        let share = 1.0 / (w * h) as f32;
        for (k, values) in all[..h].iter_mut().enumerate() {
            for (values, mean) in values.iter_mut().zip(means) {
                let mean = mean * share;
                values[..w].iter_mut().for_each(|v| *v -= mean);
            }
            let product = |a: usize, b: usize| -> f64 {
                let pairs = values[a][..w].iter().zip(&values[b][..w]);
                pairs.map(|(a, b)| a * b).sum::<f32>().into()
            };
            let sums = RowSums {
                slopes: [product(0, 0), product(0, 1), product(1, 1)],
                pulls: [product(0, 3), product(1, 3)],
                bright: [product(0, 2), product(1, 2)],
                light: [product(2, 2), product(2, 3), product(3, 3)],
                pixels: w as f64,
            };
            take(self.y + k, sums);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(right: f32, down: f32) -> Plane {
        let (width, height) = (40, 30);
        let place = |k: usize| ((k % width) as f32 - right, (k / width) as f32 - down);
        let value = |k| {
            let (x, y) = place(k);
            100.0 + 30.0 * (0.5 * x + 0.2 * y).sin() + 20.0 * (0.4 * y - 0.1 * x).cos()
        };
        let values = (0..width * height).map(value).collect();
        Plane {
            width,
            height,
            values,
        }
    }

    #[test]
    fn a_plane_is_moved_to_the_right_and_downwards() {
        let (still, there) = (wave(0.0, 0.0), wave(1.3, -2.4));
        let mut row = [0.0; 20];
        for y in 8..20 {
            still.moved([10, y], [1.3, -2.4], &mut row);
            for (x, v) in row.iter().enumerate() {
                let right = there.values[y as usize * 40 + 10 + x];
                assert!((v - right).abs() < 0.5, "{x} {y}: {v} for {right}");
            }
        }
    }

    #[test]
    fn the_rows_of_a_tile_tell_how_far_they_moved() {
        let tile = Tile {
            x: 9,
            y: 7,
            width: 16,
            height: 12,
        };
        let mut all = RowSums::default();
        let add = |_, sums: RowSums| all.add(&sums);
        tile.sums(&wave(0.0, 0.0), &wave(0.35, 0.2), |_| [0.3, 0.1], add);
        let [xx, xy, yy] = all.slopes;
        let [x, y] = all.pulls;
        let determinant = xx * yy - xy * xy;
        let left = [
            (yy * x - xy * y) / determinant,
            (xx * y - xy * x) / determinant,
        ];
        assert!((left[0] - 0.05).abs() < 0.01, "{left:?}");
        assert!((left[1] - 0.1).abs() < 0.01, "{left:?}");
        assert_eq!(all.pixels, 192.0);
    }
}
