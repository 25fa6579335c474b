//! From row means to the one fit that is believed, or the reason why there is none.

use super::Refusal;
use super::fit::{Fit, Problem, Rows};
use super::model::{Background, Model};
use super::search::{candidates, periodogram, share};
use crate::linear::{dot, median, remove};
use std::f64::consts::TAU;

/// How many harmonics are tried, in turn.
const LADDER: [usize; 10] = [1, 2, 3, 5, 8, 12, 18, 26, 36, 48];
/// Frames used where the stripes stand still.
const MOST_STILL_FRAMES: usize = 12;
/// A fundamental weaker than this part of what was taken for it is not believed.
const SUBHARMONIC_SHARE: f64 = 0.08;

/// The stripes of a recording.
#[derive(Clone, Debug)]
pub struct Stripes {
    /// The fit.
    pub fit: Fit,
    /// What was assumed of the picture behind the stripes.
    pub background: Background,
    /// Stripes (one period of one frame) that did not fit and were left out, and how many there are.
    pub left_out: (usize, usize),
}

/// Finds and fits the stripes in row means, `[frame][row]`.
///
/// `most_harmonics` bounds the wave form: 48 for a light that is switched, 6 for a lamp on the mains.
///
/// # Errors
/// Any [`Refusal`] about the stripes themselves.
pub fn find(rows: &Rows, most_harmonics: usize) -> Result<Stripes, Refusal> {
    let height = rows.first().map_or(0, Vec::len);
    if height < 16 {
        return Err(Refusal::TooFewRows { rows: height });
    }
    let frames = rows.len();
    // A short picture holds fewer periods: a stiffer background then, or it would take the stripes for its own.
    let smooth = |per_row: f64| match per_row * height as f64 {
        p if p < 2.0 => Background::Smooth(1),
        p if p < 4.0 => Background::Smooth(2),
        _ => Background::Smooth(4),
    };
    let moving = (frames >= 4).then(|| without_mean(rows));
    let (fit_rows, per_row_background, starts) = match moving {
        Some(moving) if is_striped(&moving) => {
            let starts = start_values(&moving, 3);
            (moving, true, starts)
        }
        _ => {
            let still = without_gradient(rows);
            let starts = start_values(&still, 4);
            (still, false, starts)
        }
    };
    // With still stripes all parameters hang together; more frames would cost much and add little.
    let rows = if per_row_background {
        rows
    } else {
        &rows[..frames.min(MOST_STILL_FRAMES)]
    };
    let fit_rows = &fit_rows[..rows.len()];
    let mut best: Option<(Fit, Background)> = None;
    for per_row in starts {
        let background = if per_row_background {
            Background::PerRow
        } else {
            smooth(per_row)
        };
        let problem = Problem::new(rows, background);
        let fit = problem.fit(&first_model(fit_rows, per_row), 8);
        if let Some(fit) = fit.filter(|f| plausible(f, height))
            && best.as_ref().is_none_or(|(b, _)| fit.rss < b.rss)
        {
            best = Some((fit, background));
        }
    }
    let (mut fit, mut background) = best.ok_or(Refusal::NoStripes)?;
    let mut rows = rows;
    if background == Background::PerRow && resultant(&fit.model.phases) > 0.7 {
        // The stripes stand nearly still: what does not move and what does cannot be told apart row by row.
        background = smooth(fit.model.per_row);
        rows = &rows[..rows.len().min(MOST_STILL_FRAMES)];
        fit.model.phases.truncate(rows.len());
        fit = Problem::new(rows, background)
            .fit(&fit.model, 12)
            .ok_or(Refusal::NoStripes)?;
    }
    let mut problem = Problem::new(rows, background);
    let limit = most_harmonics
        .min(if frames < 4 {
            (0.48 / fit.model.per_row) as usize
        } else {
            48
        })
        .max(1);
    fit = grow(&problem, fit, limit);
    let left_out = leave_out(&mut problem, &fit);
    if left_out.0 > 0 {
        fit = problem.fit(&fit.model, 12).ok_or(Refusal::NoStripes)?;
        fit = grow(&problem, fit, limit);
    }
    if left_out.0 * 10 > left_out.1 * 3 {
        return Err(Refusal::Irregular {
            left_out: left_out.0,
            stripes: left_out.1,
        });
    }
    check_fundamental(&problem, &fit, limit)?;
    check_quality(&problem, &fit)?;
    Ok(Stripes {
        fit,
        background,
        left_out,
    })
}

/// Less than half a stripe a row, and at least a good half of one in the frame.
fn plausible(fit: &Fit, height: usize) -> bool {
    let per_row = fit.model.per_row;
    per_row * height as f64 > 0.6 && per_row < 0.5
}

/// Each row's mean over the frames removed.
fn without_mean(rows: &Rows) -> Vec<Vec<f64>> {
    let height = rows[0].len();
    let mean: Vec<f64> = (0..height)
        .map(|y| rows.iter().map(|r| r[y]).sum::<f64>() / rows.len() as f64)
        .collect();
    rows.iter()
        .map(|r| r.iter().zip(&mean).map(|(v, m)| v - m).collect())
        .collect()
}

/// A straight line in y removed from every frame.
fn without_gradient(rows: &Rows) -> Vec<Vec<f64>> {
    let height = rows[0].len() as f64;
    let line = (0..rows[0].len())
        .map(|y| y as f64 - 0.5 * (height - 1.0))
        .collect();
    let basis = crate::linear::orthonormal(vec![vec![1.0; rows[0].len()], line]);
    rows.iter()
        .map(|r| {
            let mut frame = r.clone();
            remove(&basis, &mut frame);
            frame
        })
        .collect()
}

fn is_striped(rows: &Rows) -> bool {
    let (step, power) = periodogram(rows);
    let height = rows[0].len();
    candidates(step, &power, 0.6 / height as f64, 1)
        .first()
        .is_some_and(|&per_row| share(step, &power, height, per_row) > 0.15)
}

fn start_values(rows: &Rows, count: usize) -> Vec<f64> {
    let (step, power) = periodogram(rows);
    candidates(step, &power, 0.6 / rows[0].len() as f64, count)
}

/// A sinusoid of `per_row` stripes a row, each frame's phase read from the data.
fn first_model(rows: &Rows, per_row: f64) -> Model {
    let centre = 0.5 * (rows[0].len() as f64 - 1.0);
    let phases = rows
        .iter()
        .map(|frame| {
            let (mut re, mut im) = (0.0, 0.0);
            for (y, &value) in frame.iter().enumerate() {
                let (s, c) = (TAU * per_row * (y as f64 - centre)).sin_cos();
                re += value * c;
                im -= value * s;
            }
            im.atan2(re) / TAU
        })
        .collect();
    Model {
        per_row,
        phases,
        harmonics: vec![[1.0, 0.0]],
    }
}

/// More harmonics, as long as they pay for themselves.
fn grow(problem: &Problem<'_>, mut fit: Fit, limit: usize) -> Fit {
    let mut misses = 0;
    for &count in LADDER.iter().filter(|&&c| c <= limit) {
        if count <= fit.model.harmonics.len() {
            continue;
        }
        let mut start = fit.model.clone();
        start.harmonics.resize(count, [0.0, 0.0]);
        match problem.fit(&start, 3) {
            Some(next) if next.bic() < fit.bic() => {
                fit = next;
                misses = 0;
            }
            _ => misses += 1,
        }
        if misses == 2 {
            break;
        }
    }
    fit
}

/// |mean of e^{2πiφ}|: 1 where the phases are all the same, near 0 where they are spread evenly.
pub fn resultant(phases: &[f64]) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for phase in phases {
        let (s, c) = (TAU * phase).sin_cos();
        re += c;
        im += s;
    }
    re.hypot(im) / phases.len().max(1) as f64
}

/// Marks stripes whose residual is out of all proportion (the light missed a flash), and counts them.
fn leave_out(problem: &mut Problem<'_>, fit: &Fit) -> (usize, usize) {
    let mut stripes: Vec<(usize, usize, usize, f64)> = Vec::new();
    let height = fit.gain.len();
    let centre = 0.5 * (height as f64 - 1.0);
    for (n, frame) in fit.residual.iter().enumerate() {
        let number =
            |y: usize| (fit.model.per_row * (y as f64 - centre) + fit.model.phases[n]).round();
        let mut first = 0;
        for y in 1..=height {
            if y == height || number(y) != number(first) {
                let rms = (dot(&frame[first..y], &frame[first..y]) / (y - first) as f64).sqrt();
                stripes.push((n, first, y, rms));
                first = y;
            }
        }
    }
    let typical = median(&stripes.iter().map(|s| s.3).collect::<Vec<_>>());
    let gain = median(&fit.gain).abs();
    let mut count = 0;
    for &(n, first, last, rms) in &stripes {
        if rms > 4.0 * typical && rms > 0.15 * gain {
            problem.used[n][first..last].fill(false);
            count += 1;
        }
    }
    (count, stripes.len())
}

/// Refuses where every second or third stripe differs from its neighbours: the fundamental is then lower.
fn check_fundamental(problem: &Problem<'_>, fit: &Fit, limit: usize) -> Result<(), Refusal> {
    let height = fit.gain.len() as f64;
    for divisor in [2usize, 3] {
        let per_row = fit.model.per_row / divisor as f64;
        if per_row * height < 2.0 {
            continue;
        }
        let kept = fit.model.harmonics.len().min(limit / divisor).clamp(1, 8);
        let mut start = fit.model.clone();
        start.harmonics.truncate(kept);
        let Some(alone) = problem.fit(&start, 4) else {
            continue;
        };
        // The pattern again, its fundamental now the `divisor`th harmonic: amplitudes relative to that one.
        let mut residual = alone.residual.clone();
        for (frame, used) in residual.iter_mut().zip(&problem.used) {
            for (y, value) in frame.iter_mut().enumerate() {
                *value = if used[y] && alone.gain[y].is_finite() {
                    *value / alone.gain[y]
                } else {
                    0.0
                };
            }
        }
        let mut strongest: f64 = 0.0;
        for order in 1..divisor {
            strongest = strongest.max(coherent(
                &residual,
                &alone.model,
                order as f64 / divisor as f64,
            ));
        }
        if strongest > SUBHARMONIC_SHARE {
            return Err(Refusal::Subharmonic {
                divisor,
                share: strongest,
            });
        }
    }
    Ok(())
}

/// Amplitude of a component at `ratio` times the fundamental, coherent over the frames up to the unknown count of whole periods.
fn coherent(residual: &[Vec<f64>], model: &Model, ratio: f64) -> f64 {
    let height = residual[0].len();
    let centre = 0.5 * (height as f64 - 1.0);
    let mut power = 0.0;
    let (mut values, mut noise) = (0usize, 0.0);
    for frame in residual {
        let (mut re, mut im) = (0.0, 0.0);
        for (y, &value) in frame.iter().enumerate() {
            let (s, c) = (TAU * ratio * model.per_row * (y as f64 - centre)).sin_cos();
            re += value * c;
            im += value * s;
            noise += value * value;
        }
        values += height;
        power += (re * re + im * im) / (height as f64).powi(2);
    }
    let floor = noise / values as f64 / height as f64;
    2.0 * (power / residual.len() as f64 - 3.0 * floor)
        .max(0.0)
        .sqrt()
}

/// Refuses a fit that the data do not call for.
fn check_quality(problem: &Problem<'_>, fit: &Fit) -> Result<(), Refusal> {
    let relative = fit.per_row_sd / fit.model.per_row;
    let gains: Vec<f64> = fit.gain.iter().copied().filter(|g| g.is_finite()).collect();
    let gain = median(&gains);
    let contrast = gain / median(&fit.offset).abs().max(1e-9);
    if relative.is_nan() || relative > 0.01 || gain <= 0.0 {
        return Err(Refusal::LowContrast {
            contrast: contrast.max(0.0),
            relative_sd: relative,
        });
    }
    if let Background::Smooth(_) = problem.background {
        let striped: f64 = problem
            .rows
            .iter()
            .enumerate()
            .flat_map(|(n, frame)| (0..frame.len()).map(move |y| (n, y)))
            .filter(|&(n, y)| problem.used[n][y])
            .map(|(n, y)| (problem.rows[n][y] - fit.offset[y]).powi(2))
            .sum();
        let explained = 1.0 - fit.rss / striped.max(f64::MIN_POSITIVE);
        if explained < 0.7 {
            return Err(Refusal::OtherPattern { explained });
        }
    }
    let periods = fit.model.per_row * fit.gain.len() as f64;
    let least = if problem.background == Background::PerRow {
        1.0
    } else {
        2.0
    };
    if periods < least {
        return Err(Refusal::TooFewPeriods { periods, least });
    }
    if fit.model.per_row > 0.4 {
        return Err(Refusal::TooFine {
            rows_per_stripe: 1.0 / fit.model.per_row,
        });
    }
    Ok(())
}
