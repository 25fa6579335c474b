//! Frame times that were rounded, and the regular grid behind them.
//!
//! Many files hold times in whole milliseconds (Matroska, `--save-pts` of some recorders, logs), and at
//! 60 fps a millisecond is 6 % of a frame: a tone of 130 Hz loses 3 % of its amplitude and gets images.
//! But cameras run evenly. Where all times lie within half a unit of an even grid, the grid is the truth
//! and the times are what rounding left of it; where they do not, they are coarse, and that is to be said.

/// Times rounded to more than this are worth a grid, ns: beyond it a tone of 200 Hz loses 0.1 %.
const COARSE_NS: i64 = 100_000;
/// Units that recorders round to, ns, the coarsest first: hundredths of a second, 1/600 s, milliseconds.
const UNITS: [Unit; 3] = [
    Unit {
        numerator: 10_000_000,
        denominator: 1,
    },
    Unit {
        numerator: 5_000_000,
        denominator: 3,
    },
    Unit {
        numerator: 1_000_000,
        denominator: 1,
    },
];

/// A unit of time, ns, as a quotient.
#[derive(Clone, Copy, Debug)]
struct Unit {
    numerator: i64,
    denominator: i64,
}

impl Unit {
    fn ns(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }

    /// The time after another is a multiple of it, to the nanosecond that both were rounded to.
    fn divides(self, ns: i64) -> bool {
        let rest =
            (i128::from(ns) * i128::from(self.denominator)).rem_euclid(i128::from(self.numerator));
        let slack = i128::from(self.denominator);
        rest <= slack || rest >= i128::from(self.numerator) - slack
    }
}

/// Times at equal distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Time of number 0, ns.
    pub start_ns: f64,
    /// From one to the next, ns.
    pub period_ns: f64,
}

impl Grid {
    /// The time of a number, ns.
    pub fn time_ns(&self, number: u32) -> i64 {
        (self.start_ns + f64::from(number) * self.period_ns).round() as i64
    }
}

/// What times were found to be.
#[derive(Clone, Debug, PartialEq)]
pub enum Rounding {
    /// Finer than matters.
    Fine,
    /// Rounded from this grid, to a unit that matters; with the place of each in it.
    Grid(Grid, Vec<u32>),
    /// Rounded to a unit that matters, ns, and to no grid.
    Coarse(i64),
}

/// What a recording's frame times are, in order, ns.
///
/// ```
/// use rowtone_clip::grid::{Rounding, rounding};
/// let times: Vec<i64> = (0..240).map(|i| 1_000_000 * ((i * 1000 + 30) / 60)).collect();
/// let Rounding::Grid(grid, numbers) = rounding(&times) else { panic!() };
/// assert_eq!(numbers[239], 239);
/// assert!((grid.period_ns * 60.0 - 1e9).abs() < 1e5);
/// assert_eq!(rounding(&[0, 16_666_667, 33_333_334, 50_000_021]), Rounding::Fine);
/// ```
pub fn rounding(times_ns: &[i64]) -> Rounding {
    let Some(unit) = unit_of(times_ns) else {
        return Rounding::Fine;
    };
    match behind(times_ns, unit.ns()) {
        Some((grid, numbers)) => Rounding::Grid(grid, numbers),
        None => Rounding::Coarse(unit.ns().round() as i64),
    }
}

/// The coarsest unit that all times are multiples of, from the first one on.
fn unit_of(times_ns: &[i64]) -> Option<Unit> {
    let first = *times_ns.first()?;
    let all = |unit: &Unit| times_ns.iter().all(|&time| unit.divides(time - first));
    UNITS
        .into_iter()
        .filter(|unit| unit.ns() >= COARSE_NS as f64)
        .find(all)
}

/// The grid that rounding to `unit_ns` made these times of. Frames may be missing in between.
///
/// Rounded or cut off, all times lie within one unit of the grid: the periods that allow this are an
/// interval, for how far the times then lie apart is a convex function of the period.
fn behind(times_ns: &[i64], unit_ns: f64) -> Option<(Grid, Vec<u32>)> {
    let points = numbered(times_ns, unit_ns)?;
    let rests = |period: f64| {
        let rest = |&(number, time): &(f64, f64)| time - number * period;
        let ends = (f64::MAX, f64::MIN);
        points
            .iter()
            .map(rest)
            .fold(ends, |(low, high), rest| (low.min(rest), high.max(rest)))
    };
    let width = |period: f64| {
        let (low, high) = rests(period);
        high - low
    };
    let &(last_number, last_time) = points.last()?;
    let around = 2.0 * unit_ns / last_number;
    let (mut left, mut right) = (
        last_time / last_number - around,
        last_time / last_number + around,
    );
    for _ in 0..SEARCH_STEPS {
        let (a, b) = (left + (right - left) / 3.0, right - (right - left) / 3.0);
        if width(a) < width(b) {
            right = b
        } else {
            left = a
        }
    }
    let best = 0.5 * (left + right);
    if width(best) > UNEVEN * unit_ns {
        return None;
    }
    // Where the times are within a unit, as far to either side as they stay so.
    let edge = |mut outside: f64| {
        let mut inside = best;
        for _ in 0..SEARCH_STEPS {
            let middle = 0.5 * (inside + outside);
            if width(middle) <= unit_ns + SLACK_NS {
                inside = middle
            } else {
                outside = middle
            }
        }
        inside
    };
    let period_ns = likely(edge(best - around), edge(best + around));
    let (low, high) = rests(period_ns);
    let grid = Grid {
        start_ns: *times_ns.first()? as f64 + 0.5 * (low + high),
        period_ns,
    };
    let numbers = points.iter().map(|&(number, _)| number as u32).collect();
    (period_ns > 0.0).then_some((grid, numbers))
}

/// The period between two, ns: that of a usual frame rate where there is one, else the middle.
fn likely(least_ns: f64, most_ns: f64) -> f64 {
    let middle = 0.5 * (least_ns + most_ns);
    let usual = USUAL_FPS.iter().flat_map(|fps| [1e9 / fps, 1.001e9 / fps]);
    usual
        .filter(|period| (least_ns..=most_ns).contains(period))
        .min_by(|a, b| (a - middle).abs().total_cmp(&(b - middle).abs()))
        .unwrap_or(middle)
}

/// Rates that cameras keep to some millionths, Hz, or a thousandth below them.
const USUAL_FPS: [f64; 10] = [
    24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0, 200.0, 240.0,
];

/// Steps of a search; each leaves two thirds or less of an interval.
const SEARCH_STEPS: usize = 60;
/// Times that lie apart by so many units are still a grid's: a camera's own clock is not quite even.
const UNEVEN: f64 = 1.2;
/// Times were rounded to whole ns on their way here, twice.
const SLACK_NS: f64 = 2.0;

/// Number of each frame and its time after the first, ns. A step of about two usual ones is one lost frame.
fn numbered(times_ns: &[i64], unit_ns: f64) -> Option<Vec<(f64, f64)>> {
    let &first = times_ns.first()?;
    if times_ns.len() < 3 {
        return None;
    }
    let steps: Vec<i64> = times_ns.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = usual_step(&steps)?;
    let mut number = 0.0;
    let mut points = vec![(0.0, 0.0)];
    for (&time, &step) in times_ns[1..].iter().zip(&steps) {
        // Where a frame takes hardly more than a unit, rounding alone makes steps of two.
        number += if usual < 3.0 * unit_ns {
            1.0
        } else {
            (step as f64 / usual).round().max(1.0)
        };
        points.push((number, (time - first) as f64));
    }
    Some(points)
}

/// The mean of the steps that no frame is missing in, ns.
fn usual_step(steps: &[i64]) -> Option<f64> {
    let mut sorted = steps.to_vec();
    let median = *sorted.select_nth_unstable(steps.len() / 2).1;
    let (sum, count) = steps
        .iter()
        .filter(|&&step| (step as f64) < 1.5 * median as f64)
        .fold((0.0, 0.0), |(sum, count), &step| {
            (sum + step as f64, count + 1.0)
        });
    (count > 0.0 && sum > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Times of frames with these numbers, rounded to whole milliseconds.
    fn rounded(fps: f64, numbers: impl IntoIterator<Item = u32>) -> Vec<i64> {
        let ms = numbers
            .into_iter()
            .map(|i| (f64::from(i) * 1e3 / fps).round() as i64);
        ms.map(|ms| ms * 1_000_000).collect()
    }

    #[test]
    fn the_rate_behind_whole_milliseconds_is_found() {
        for fps in [
            23.976, 25.0, 29.97, 30.0, 47.6, 59.94, 60.0, 119.88, 206.7, 240.0,
        ] {
            for lost in [0..0, 40..43, 90..91] {
                let kept: Vec<u32> = (0..240).filter(|i| !lost.contains(i)).collect();
                let times = rounded(fps, kept.iter().copied());
                let Rounding::Grid(grid, numbers) = rounding(&times) else {
                    panic!("{fps}: {:?}", rounding(&times));
                };
                assert!(
                    (grid.period_ns * fps * 1e-9 - 1.0).abs() < 4e-5,
                    "{fps}: {grid:?}"
                );
                assert_eq!(numbers, kept, "{fps}");
            }
        }
    }

    #[test]
    fn a_rate_that_changes_is_no_grid() {
        let mut times = rounded(60.0, 0..120);
        let last = times[119];
        times.extend(rounded(48.0, 1..100).iter().map(|t| t + last));
        assert_eq!(rounding(&times), Rounding::Coarse(1_000_000));
    }

    #[test]
    fn ticks_of_a_600th_are_a_unit_too() {
        let times: Vec<i64> = (0..66)
            .map(|i| (f64::from(i) * 20.02).floor() as i64 * 1_000_000_000 / 600)
            .collect();
        let Rounding::Grid(grid, _) = rounding(&times) else {
            panic!("{:?}", rounding(&times));
        };
        assert!(
            (grid.period_ns / (20.02e9 / 600.0) - 1.0).abs() < 1e-4,
            "{grid:?}"
        );
    }

    #[test]
    fn fine_times_and_few_are_left_alone() {
        assert_eq!(rounding(&[]), Rounding::Fine);
        assert_eq!(
            rounding(&[0, 33_366_667, 66_733_333, 100_100_000]),
            Rounding::Fine
        );
        assert_eq!(rounding(&[5, 1_000_005]), Rounding::Coarse(1_000_000));
    }

    proptest! {
        /// The true grid rounds to these times, and so does the one that was found: each lies within half a unit
        /// of every time, and a nanosecond.
        #[test]
        fn grids_are_found_to_within_rounding(
            fps in 10.0_f64..300.0, count in 20_usize..400, start_ms in -5e5_f64..5e5, lost in 0_u32..400,
        ) {
            let exact = |i: u32| start_ms + f64::from(i) * 1e3 / fps;
            let numbers: Vec<u32> = (0..=count as u32).filter(|&i| i != lost || i == 0).collect();
            let times: Vec<i64> = numbers.iter().map(|&i| exact(i).round() as i64 * 1_000_000).collect();
            let Rounding::Grid(grid, found) = rounding(&times) else {
                return Err(TestCaseError::fail(format!("{:?}", rounding(&times))));
            };
            for (&i, &k) in numbers.iter().zip(&found) {
                let found = grid.time_ns(k) as f64 * 1e-6;
                prop_assert!((found - exact(i)).abs() < 1.00001, "{i}: {found} for {}", exact(i));
            }
        }

        #[test]
        fn any_times_are_fine_coarse_or_a_grid(steps in proptest::collection::vec(0_i64..1 << 40, 0..60)) {
            let times: Vec<i64> = steps.iter().scan(0, |t, step| { *t += step; Some(*t) }).collect();
            if let Rounding::Grid(grid, numbers) = rounding(&times) {
                prop_assert!(grid.period_ns > 0.0 && grid.start_ns.is_finite());
                prop_assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]));
            }
        }
    }
}
