//! From row means to the one fit that is believed, or the reason why there is none.

use super::fit::{Fit, Problem, Rows};
use super::model::{Background, Model};
use super::search::{candidates, periodogram, share};
use super::{Refusal, fundamental, outliers};
use rowtone_linear::{median, remove};
use std::f64::consts::TAU;

/// How many harmonics are tried, in turn.
const LADDER: [usize; 12] = [1, 2, 3, 5, 8, 12, 18, 26, 36, 48, 66, 90];
/// Peak of the periodogram over its median. White noise in four frames gets that far once in a thousand recordings, in
/// more frames never.
const STANDS_OUT: f64 = 8.0;
/// Least share of the changes that the stripes explain, of a picture with a smooth background and of one without.
const LEAST_EXPLAINED: [f64; 2] = [0.7, 0.5];
/// Variance of the rows' means over what chance makes it: over hundreds of rows it then stays within 1.2.
const OWN_ROWS: f64 = 1.4;
/// With fewer harmonics than this a switched light is not met well enough.
const FEWEST_TOLD_APART: usize = 4;
/// Periods in a frame below which the picture behind the stripes must not be taken for smooth.
const LEAST_PERIODS_OF_SMOOTH: f64 = 2.0;
/// Values to each harmonic in a few frames.
const VALUES_A_HARMONIC: usize = 12;
/// Frames used where the stripes stand still.
const MOST_STILL_FRAMES: usize = 12;

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
/// `most_harmonics` bounds the wave form: 90 for a light that is switched, 6 for a lamp on the mains.
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
    let limit = |fit: &Fit, background| {
        let rows_show =
            points_show(&fit.model, height).min(rows.len() * height / VALUES_A_HARMONIC);
        let frames_show = if background == Background::PerRow {
            told_apart(&fit.model.phases)
        } else {
            usize::MAX
        };
        most_harmonics.min(rows_show).min(frames_show).max(1)
    };
    // Most pictures are smooth from row to row: to say so spares two unknowns a row. But less than two periods are like
    // a smooth picture themselves.
    let periods = fit.model.per_row * height as f64;
    let found = if background == Background::PerRow {
        let few_phases =
            |fit: &Fit| told_apart(&fit.model.phases) < FEWEST_TOLD_APART.min(most_harmonics);
        // Unless they move: where they come back to few places, no more is asked of a picture that is smooth.
        let simple = if periods >= LEAST_PERIODS_OF_SMOOTH {
            Some(smooth(fit.model.per_row))
        } else {
            few_phases(&fit).then_some(Background::Smooth(4))
        };
        let simple = simple.map(|smooth| grown(rows, smooth, fit.clone(), limit, most_harmonics));
        match simple {
            Some(Ok(smooth)) if !has_own_rows(&smooth.fit) => smooth,
            smooth => {
                let own = grown(rows, background, fit, limit, most_harmonics)?;
                match smooth {
                    Some(Ok(smooth)) if smooth.fit.bic() < own.fit.bic() => smooth,
                    _ if few_phases(&own.fit) => return Err(Refusal::FewPhases),
                    _ => own,
                }
            }
        }
    } else {
        grown(rows, background, fit, limit, most_harmonics)?
    };
    let Grown {
        problem,
        fit,
        left_out,
    } = found;
    let limit = limit(&fit, problem.background);
    if left_out.0 * 10 > left_out.1 * 3 {
        return Err(Refusal::Irregular {
            left_out: left_out.0,
            stripes: left_out.1,
        });
    }
    fundamental::check(&problem, &fit, limit)?;
    let mut fit = problem.with_leverage(fit);
    fit.per_row_sd = fit.per_row_sd.hypot(fit.not_met);
    check_quality(&problem, &fit)?;
    Ok(Stripes {
        background: problem.background,
        fit,
        left_out,
    })
}

/// A fit with as many harmonics as pay, failed flashes left out.
struct Grown<'a> {
    problem: Problem<'a>,
    fit: Fit,
    left_out: (usize, usize),
}

fn grown(
    rows: &Rows,
    background: Background,
    start: Fit,
    limit: impl Fn(&Fit, Background) -> usize,
    wanted: usize,
) -> Result<Grown<'_>, Refusal> {
    let mut problem = Problem::new(rows, background);
    let mut first = start.model;
    first.harmonics.truncate(2);
    let mut fit = problem.fit(&first, 8).ok_or(Refusal::NoStripes)?;
    outliers::trim(&mut problem, &mut fit);
    let most = limit(&fit, background);
    let mut fit = grow(&problem, fit, most, wanted);
    let left_out = outliers::leave_out(&mut problem, &mut fit, |problem, fit| {
        let again = Fit {
            not_met: fit.not_met,
            ..problem.fit(&fit.model, 12).ok_or(Refusal::NoStripes)?
        };
        Ok(grow(problem, again, most, wanted))
    })?;
    Ok(Grown {
        problem,
        fit,
        left_out,
    })
}

/// Whether rows keep offsets of their own that the fit's smooth background leaves: their means over the frames are
/// larger than the scatter about them makes them.
fn has_own_rows(fit: &Fit) -> bool {
    let frames = fit.residual.len() as f64;
    let (mut of_means, mut within) = (0.0, 0.0);
    for y in 0..fit.gain.len() {
        let mean = fit.residual.iter().map(|f| f[y]).sum::<f64>() / frames;
        of_means += mean * mean;
        within += fit
            .residual
            .iter()
            .map(|f| (f[y] - mean).powi(2))
            .sum::<f64>();
    }
    of_means * frames > OWN_ROWS * within / (frames - 1.0)
}

/// Harmonics that the points of the period at which there is a row in some frame can show: half a period of the
/// highest is not to fall into the widest gap between them.
fn points_show(model: &Model, height: usize) -> usize {
    let mut points: Vec<f64> = (0..model.phases.len())
        .flat_map(|n| (0..height).map(move |y| (n, y)))
        .map(|(n, y)| (model.psi(n, y as f64) / TAU).rem_euclid(1.0))
        .collect();
    points.sort_by(f64::total_cmp);
    let around = points[0] + 1.0 - points[points.len() - 1];
    let widest = points
        .windows(2)
        .map(|w| w[1] - w[0])
        .fold(around, f64::max);
    (0.5 / widest) as usize
}

/// Harmonics below the first that the frames see at one phase only: over the frames it, and those beside it, look like
/// the picture behind the stripes and like their own amplitude. Stripes that move by a third of a period a frame leave 1.
fn told_apart(phases: &[f64]) -> usize {
    if phases.len() < 4 || resultant(phases) > 0.7 {
        return usize::MAX;
    }
    (2..64)
        .find(|&h| {
            let turned: Vec<f64> = phases.iter().map(|p| f64::from(h) * p).collect();
            resultant(&turned) > 0.9
        })
        .map_or(usize::MAX, |h| h as usize - 2)
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
    let basis = rowtone_linear::orthonormal(vec![vec![1.0; rows[0].len()], line]);
    rows.iter()
        .map(|r| {
            let mut frame = r.clone();
            remove(&basis, &mut frame);
            frame
        })
        .collect()
}

/// Whether there is more than noise: the periodogram's peak holds a good part of the power and stands out.
fn is_striped(rows: &Rows) -> bool {
    let (step, power) = periodogram(rows);
    let height = rows[0].len();
    let floor = median(&power);
    candidates(step, &power, 0.6 / height as f64, 1)
        .first()
        .is_some_and(|&per_row| {
            let peak = power[((per_row / step).round() as usize).min(power.len() - 1)];
            peak > STANDS_OUT * floor && share(step, &power, height, per_row) > 0.15
        })
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
///
/// Where they still do at `limit`, because the rows lie at too few places of the period for the `wanted` ones, what is left
/// of the wave form looks like fewer harmonics and bends ν: what the last ones moved it by is then added to its standard
/// deviation, or half of what those before them did, if that is more: one step alone is small by chance now and then. (In
/// a few frames what is left shows in the residuals.)
fn grow(problem: &Problem<'_>, mut fit: Fit, limit: usize, wanted: usize) -> Fit {
    let mut misses = 0;
    let before = fit.not_met;
    let mut moved: Option<[f64; 2]> = None;
    for &count in LADDER.iter().filter(|&&c| c <= limit) {
        if count <= fit.model.harmonics.len() {
            continue;
        }
        let mut start = fit.model.clone();
        start.harmonics.resize(count, [0.0, 0.0]);
        match problem.fit(&start, 3) {
            Some(next) if next.bic() < fit.bic() => {
                let by = (next.model.per_row - fit.model.per_row).abs();
                moved = Some([by, moved.map_or(0.0, |m| m[0])]);
                fit = next;
                misses = 0;
            }
            _ => misses += 1,
        }
        // A wave form may lack even harmonics, but hardly all from 18 to 26.
        if misses == 2 || (misses == 1 && count > 20) {
            break;
        }
    }
    fit.not_met = if misses == 0 && limit < wanted && problem.rows.len() >= 4 {
        // Nothing to add to a fit of before: what was said of it still holds.
        moved.map_or(before, |[last, one_before]| last.max(0.5 * one_before))
    } else {
        0.0
    };
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
    let striped: f64 = problem
        .rows
        .iter()
        .enumerate()
        .flat_map(|(n, frame)| (0..frame.len()).map(move |y| (n, y)))
        .filter(|&(n, y)| problem.used[n][y] && fit.offset[y].is_finite())
        .map(|(n, y)| (problem.rows[n][y] - fit.offset[y]).powi(2))
        .sum();
    // What the parameters would explain of mere noise does not count.
    let lost = fit.count as f64 / fit.count.saturating_sub(fit.parameters).max(1) as f64;
    let explained = 1.0 - lost * fit.rss / striped.max(f64::MIN_POSITIVE);
    let [smooth, per_row] = LEAST_EXPLAINED;
    let least = if problem.background == Background::PerRow {
        per_row
    } else {
        smooth
    };
    if explained < least {
        return Err(Refusal::OtherPattern { explained });
    }
    let periods = fit.model.per_row * fit.gain.len() as f64;
    let moving = problem.rows.len() >= 4 && resultant(&fit.model.phases) <= 0.7;
    let least = if moving { 1.0 } else { LEAST_PERIODS_OF_SMOOTH };
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
