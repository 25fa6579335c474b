//! The least-squares fit of [`Model`] to the mean of every row of every frame.
//!
//! b and g are linear and are eliminated inside each step (variable projection, Golub and Pereyra 1973, in
//! Kaufman's form); the rest is Levenberg–Marquardt. The standard deviation of ν comes from what the residuals
//! do (`uncertainty.rs`), not from assuming them white.

use super::model::{Background, Model, legendre};
use super::uncertainty;
use rowtone_linear::{Symmetric, dot, orthonormal};

/// Row means: `[frame][row]`.
pub type Rows = [Vec<f64>];

/// A fitted [`Model`].
#[derive(Clone, Debug)]
pub struct Fit {
    /// The parameters.
    pub model: Model,
    /// b(y), by row.
    pub offset: Vec<f64>,
    /// g(y), by row.
    pub gain: Vec<f64>,
    /// What the fit leaves, `[frame][row]`; 0 where a value was left out.
    pub residual: Vec<Vec<f64>>,
    /// Sum of squares of the residual.
    pub rss: f64,
    /// Values that took part.
    pub count: usize,
    /// Parameters, the linear ones too.
    pub parameters: usize,
    /// Standard deviation of the model's `per_row`.
    pub per_row_sd: f64,
    /// How far a wave form that the rows cannot show may bend `per_row`.
    pub not_met: f64,
}

impl Fit {
    /// Standard deviation of one row mean about the fit.
    pub fn noise(&self) -> f64 {
        let free = self.count.saturating_sub(self.parameters).max(1);
        (self.rss / free as f64).sqrt()
    }

    /// Schwarz's criterion; the smaller the better.
    pub fn bic(&self) -> f64 {
        let count = self.count as f64;
        count * (self.rss.max(f64::MIN_POSITIVE) / count).ln() + self.parameters as f64 * count.ln()
    }
}

/// The data and what is assumed of them.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// Row means.
    pub rows: &'a Rows,
    /// Whether a value takes part, `[frame][row]`.
    pub used: Vec<Vec<bool>>,
    /// What b and g may be.
    pub background: Background,
}

/// Fewer values than this to a parameter: leverage is worth its time.
const FEW_VALUES: usize = 40;
/// A value is not believed to be explained by more than this: it would count for nothing but itself.
const MOST_LEVERAGE: f64 = 0.9;

/// How much of a value's own error the fit follows.
#[derive(Clone, Copy, PartialEq)]
enum Leverage {
    /// The same for all.
    Mean,
    /// Each value's own share of b and g, the same share of the rest.
    Linear,
    /// Each value's own.
    Each,
}

/// Values that share their linear parameters.
struct Group {
    cells: Vec<(usize, usize)>,
    /// Smooth functions of the row, `[function][cell]`.
    smooth: Vec<Vec<f64>>,
}

/// One group, its linear parameters fitted.
struct Solved {
    residual: Vec<f64>,
    gain: Vec<f64>,
    offset: Vec<f64>,
    basis: Vec<Vec<f64>>,
    linear: usize,
}

impl<'a> Problem<'a> {
    /// All values take part.
    pub fn new(rows: &'a Rows, background: Background) -> Self {
        let used = rows.iter().map(|r| vec![true; r.len()]).collect();
        Self {
            rows,
            used,
            background,
        }
    }

    fn height(&self) -> usize {
        self.rows.first().map_or(0, Vec::len)
    }

    /// Row, counted from the middle one.
    fn distance_from_centre(&self, y: usize) -> f64 {
        y as f64 - 0.5 * (self.height() as f64 - 1.0)
    }

    fn groups(&self) -> Vec<Group> {
        let frames = self.rows.len();
        let taken = |n: usize, y: usize| self.used[n][y];
        match self.background {
            Background::PerRow => (0..self.height())
                .map(|y| {
                    let cells: Vec<_> = (0..frames)
                        .filter(|&n| taken(n, y))
                        .map(|n| (n, y))
                        .collect();
                    Group {
                        smooth: vec![vec![1.0; cells.len()]],
                        cells,
                    }
                })
                .filter(|group| group.cells.len() > 2)
                .collect(),
            Background::Smooth(degree) => {
                let cells: Vec<_> = (0..frames)
                    .flat_map(|n| (0..self.height()).map(move |y| (n, y)))
                    .filter(|&(n, y)| taken(n, y))
                    .collect();
                let half = 0.5 * self.height() as f64;
                let mut smooth = vec![Vec::with_capacity(cells.len()); degree + 1];
                for &(_, y) in &cells {
                    for (column, value) in smooth
                        .iter_mut()
                        .zip(legendre(self.distance_from_centre(y) / half, degree))
                    {
                        column.push(value);
                    }
                }
                vec![Group { cells, smooth }]
            }
        }
    }

    /// Fits b and g of one group.
    fn solve(&self, group: &Group, model: &Model, with_basis: bool) -> Option<Solved> {
        let wave: Vec<f64> = group
            .cells
            .iter()
            .map(|&(n, y)| model.wave(model.psi(n, self.distance_from_centre(y))))
            .collect();
        let mut columns = group.smooth.clone();
        columns.extend(group.smooth.iter().map(|c| {
            c.iter()
                .zip(&wave)
                .map(|(a, b)| a * b)
                .collect::<Vec<f64>>()
        }));
        let data: Vec<f64> = group.cells.iter().map(|&(n, y)| self.rows[n][y]).collect();
        let mut normal = Symmetric::zeros(columns.len());
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate().take(i + 1) {
                normal.add(i, j, dot(a, b));
            }
        }
        let right: Vec<f64> = columns.iter().map(|c| dot(c, &data)).collect();
        let solution = normal.factor()?.solve(&right);
        let (offsets, gains) = solution.split_at(group.smooth.len());
        let combine = |weights: &[f64], cell: usize| -> f64 {
            weights
                .iter()
                .zip(&group.smooth)
                .map(|(w, c)| w * c[cell])
                .sum()
        };
        let offset: Vec<f64> = (0..data.len()).map(|i| combine(offsets, i)).collect();
        let gain: Vec<f64> = (0..data.len()).map(|i| combine(gains, i)).collect();
        let residual = (0..data.len())
            .map(|i| data[i] - offset[i] - gain[i] * wave[i])
            .collect();
        let linear = columns.len();
        let basis = if with_basis {
            orthonormal(columns)
        } else {
            Vec::new()
        };
        Some(Solved {
            residual,
            gain,
            offset,
            basis,
            linear,
        })
    }

    /// Derivatives by the nonlinear parameters, as [ν, φ of the value's own frame, harmonics...] of every cell, and
    /// what the group's basis explains of them, `[basis vector][parameter]`.
    fn slopes(
        &self,
        group: &Group,
        model: &Model,
        solved: &Solved,
    ) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let (count, frames) = (model.parameters(), model.phases.len());
        let shapes = count - 1 - frames;
        let mut lines = Vec::with_capacity(group.cells.len());
        let mut explained = vec![vec![0.0; count]; solved.basis.len()];
        for (i, &(n, y)) in group.cells.iter().enumerate() {
            let distance_from_centre = self.distance_from_centre(y);
            let mut line = vec![0.0; 2 + shapes];
            let (_, slope) =
                model.wave_and_slopes(model.psi(n, distance_from_centre), &mut line[2..]);
            let gain = solved.gain[i];
            line[2..].iter_mut().for_each(|s| *s *= gain);
            line[0] = gain * slope * distance_from_centre;
            line[1] = gain * slope;
            for (sum, q) in explained.iter_mut().zip(&solved.basis) {
                sum[0] += q[i] * line[0];
                sum[1 + n] += q[i] * line[1];
                for (slot, value) in sum[1 + frames..].iter_mut().zip(&line[2..]) {
                    *slot += q[i] * value;
                }
            }
            lines.push(line);
        }
        (lines, explained)
    }

    fn rss(&self, groups: &[Group], model: &Model) -> Option<f64> {
        let mut sum = 0.0;
        for group in groups {
            let solved = self.solve(group, model, false)?;
            sum += dot(&solved.residual, &solved.residual);
        }
        Some(sum)
    }

    fn normal_equations(&self, groups: &[Group], model: &Model) -> Option<(Symmetric, Vec<f64>)> {
        let (count, frames) = (model.parameters(), model.phases.len());
        let shapes = count - 1 - frames;
        let mut right = vec![0.0; count];
        let mut normal = Symmetric::zeros(count);
        // Frame by frame: a value knows nothing of another frame's phase but through b and g.
        let mut by_frame = vec![Symmetric::zeros(2 + shapes); frames];
        for group in groups {
            let solved = self.solve(group, model, true)?;
            let (lines, explained) = self.slopes(group, model, &solved);
            for ((line, &residual), &(n, _)) in lines.iter().zip(&solved.residual).zip(&group.cells)
            {
                right[0] += line[0] * residual;
                right[1 + n] += line[1] * residual;
                for (slot, value) in right[1 + frames..].iter_mut().zip(&line[2..]) {
                    *slot += value * residual;
                }
                by_frame[n].add_outer(line, 1.0);
            }
            for vector in &explained {
                normal.add_outer(vector, -1.0);
            }
        }
        for (n, own) in by_frame.iter().enumerate() {
            let place = |k: usize| match k {
                0 => 0,
                1 => 1 + n,
                k => frames + k - 1,
            };
            for i in 0..own.side() {
                for j in 0..=i {
                    normal.add(place(i), place(j), own.at(i, j));
                }
            }
        }
        Some((normal, right))
    }

    /// Levenberg–Marquardt from `start`, at most `steps` steps. `None` where the data do not determine the model.
    pub fn fit(&self, start: &Model, steps: usize) -> Option<Fit> {
        let groups = self.groups();
        let mut model = start.clone();
        let mut rss = self.rss(&groups, &model)?;
        let mut damping = 1e-4;
        'steps: for _ in 0..steps {
            let (normal, right) = self.normal_equations(&groups, &model)?;
            loop {
                let mut damped = normal.clone();
                for i in 0..damped.side() {
                    damped.add(i, i, damping * normal.at(i, i) + f64::MIN_POSITIVE);
                }
                let next = damped
                    .factor()
                    .map(|factor| model.moved(&factor.solve(&right)))
                    .and_then(|next| self.rss(&groups, &next).map(|rss| (next, rss)));
                match next {
                    Some((next, next_rss)) if next_rss < rss => {
                        let gained = (rss - next_rss) / rss;
                        model = next;
                        rss = next_rss;
                        damping = (damping * 0.1_f64).max(1e-12);
                        if gained < 1e-9 {
                            break 'steps;
                        }
                        break;
                    }
                    _ if damping > 1e6 => break 'steps,
                    _ => damping *= 10.0,
                }
            }
        }
        self.finish(&groups, model, rss, Leverage::Mean)
    }

    /// `fit` again with the leverage of every value taken into account, which takes longer: for the last fit.
    pub fn with_leverage(&self, fit: Fit) -> Fit {
        // Where there are hundreds of values to a parameter it makes no difference.
        let each = fit.model.parameters() * FEW_VALUES > fit.count;
        let leverage = if each {
            Leverage::Each
        } else {
            Leverage::Linear
        };
        let again = self.finish(&self.groups(), fit.model.clone(), fit.rss, leverage);
        again.map_or(fit.clone(), |again| Fit {
            not_met: fit.not_met,
            ..again
        })
    }

    /// Residuals, b, g and the standard deviation of ν.
    fn finish(&self, groups: &[Group], model: Model, rss: f64, leverage: Leverage) -> Option<Fit> {
        let (normal, _) = self.normal_equations(groups, &model)?;
        let factor = normal.factor()?;
        let inverse = factor.inverse_column(0);
        let (frames, height) = (self.rows.len(), self.height());
        let mut influence = vec![vec![0.0; height]; frames];
        let mut residual = vec![vec![0.0; height]; frames];
        let (mut offset, mut gain) = (vec![f64::NAN; height], vec![f64::NAN; height]);
        let (mut count, mut parameters) = (0, model.parameters());
        let all: usize = groups.iter().map(|g| g.cells.len()).sum();
        let linear: usize = groups.iter().map(|g| 2 * g.smooth.len()).sum();
        let mean_leverage = (linear + parameters) as f64 / all.max(1) as f64;
        let full_line =
            |line: &[f64], n: usize, i: usize, explained: &[Vec<f64>], solved: &Solved| {
                let frames = model.phases.len();
                let mut full = vec![0.0; model.parameters()];
                full[0] = line[0];
                full[1 + n] = line[1];
                full[1 + frames..].copy_from_slice(&line[2..]);
                for (q, vector) in solved.basis.iter().zip(explained) {
                    for (slot, value) in full.iter_mut().zip(vector) {
                        *slot -= q[i] * value;
                    }
                }
                full
            };
        for group in groups {
            let solved = self.solve(group, &model, true)?;
            let (lines, explained) = self.slopes(group, &model, &solved);
            let shared: Vec<f64> = explained.iter().map(|v| dot(v, &inverse)).collect();
            count += group.cells.len();
            parameters += solved.linear;
            for (i, &(n, y)) in group.cells.iter().enumerate() {
                let line = &lines[i];
                let own = inverse[0] * line[0]
                    + inverse[1 + n] * line[1]
                    + dot(&inverse[1 + model.phases.len()..], &line[2..]);
                let weight = own
                    - solved
                        .basis
                        .iter()
                        .zip(&shared)
                        .map(|(q, s)| q[i] * s)
                        .sum::<f64>();
                let explained_share = match leverage {
                    Leverage::Mean => mean_leverage,
                    _ => {
                        let linear: f64 = solved.basis.iter().map(|q| q[i] * q[i]).sum();
                        linear
                            + if leverage == Leverage::Each {
                                factor.inverse_form(&full_line(line, n, i, &explained, &solved))
                            } else {
                                model.parameters() as f64 / all as f64
                            }
                    }
                };
                residual[n][y] = solved.residual[i];
                // A value that the fit follows closely leaves little: what it would have left of itself.
                influence[n][y] =
                    weight * solved.residual[i] / (1.0 - explained_share.min(MOST_LEVERAGE));
                offset[y] = solved.offset[i];
                gain[y] = solved.gain[i];
            }
        }
        let variance = uncertainty::variance(&influence, &residual);
        Some(Fit {
            model,
            offset,
            gain,
            residual,
            rss,
            count,
            parameters,
            per_row_sd: variance.max(0.0).sqrt(),
            not_met: 0.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(frames: usize, rows: usize, per_row: f64, step: f64) -> Vec<Vec<f64>> {
        (0..frames)
            .map(|n| {
                (0..rows)
                    .map(|y| {
                        let distance_from_centre = y as f64 - 0.5 * (rows as f64 - 1.0);
                        let psi = std::f64::consts::TAU
                            * (per_row * distance_from_centre + step * n as f64 + 0.1);
                        80.0 + 0.02 * distance_from_centre
                            + (30.0 + 0.01 * distance_from_centre)
                                * (psi.cos() + 0.2 * (2.0 * psi).sin())
                    })
                    .collect()
            })
            .collect()
    }

    fn start(frames: usize, per_row: f64, step: f64) -> Model {
        Model {
            per_row,
            phases: (0..frames).map(|n| step * n as f64).collect(),
            harmonics: vec![[1.0, 0.0], [0.0, 0.0]],
        }
    }

    #[test]
    fn exact_data_are_met_exactly() {
        for background in [Background::PerRow, Background::Smooth(2)] {
            let rows = scene(6, 200, 0.0312, 0.3);
            let problem = Problem::new(&rows, background);
            let fit = problem.fit(&start(6, 0.0308, 0.3), 40).unwrap();
            assert!(
                (fit.model.per_row - 0.0312).abs() < 1e-9,
                "{background:?} {}",
                fit.model.per_row
            );
            assert!(
                (fit.model.harmonics[1][1] - 0.2).abs() < 1e-5,
                "{:?}",
                fit.model.harmonics
            );
        }
    }

    #[test]
    fn a_single_frame_is_enough_for_a_smooth_background() {
        let rows = scene(1, 300, 0.0312, 0.0);
        let fit = Problem::new(&rows, Background::Smooth(1))
            .fit(&start(1, 0.0315, 0.0), 40)
            .unwrap();
        assert!((fit.model.per_row - 0.0312).abs() < 1e-9);
        assert!(
            Problem::new(&rows, Background::PerRow)
                .fit(&start(1, 0.0315, 0.0), 4)
                .is_none()
        );
    }
}
