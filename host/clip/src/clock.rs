//! When each frame was exposed, and which number the camera gave it.

use crate::grid::{Rounding, rounding};

/// Where the times of the frames come from.
#[derive(Clone, Debug)]
pub enum Clock {
    /// Frame number over frame rate, Hz.
    Rate(f64),
    /// One time a frame, in the order of the frames.
    Times(Times),
    /// The time that comes with each frame.
    Stamped(Stamped),
}

/// Times of frames, known beforehand.
#[derive(Clone, Debug)]
pub struct Times {
    start_ns: Vec<i64>,
    numbers: Vec<u32>,
    fps: f64,
    coarse_ns: Option<i64>,
}

/// Steps to either side of one that the usual step there is taken from.
const NEARBY: usize = 4;

impl Times {
    /// Takes the times, in order, and counts the frames that are missing between them: a step of about
    /// two usual steps is one lost frame, where the usual step is the median of those nearby, so that a
    /// rate that changes is no loss. Times that were rounded coarsely from an even grid are put back on
    /// it. `fps` is the frame rate where it is known otherwise; else it is the usual step's. `None` for
    /// fewer than two times without a known rate.
    pub fn new(start_ns: Vec<i64>, fps: Option<f64>) -> Option<Self> {
        let (rounded, grid_fps, coarse_ns) = match rounding(&start_ns) {
            Rounding::Grid(grid, places) => {
                let times = places.iter().map(|&place| grid.time_ns(place)).collect();
                (times, Some(1e9 / grid.period_ns), None)
            }
            Rounding::Fine => (start_ns, None, None),
            Rounding::Coarse(unit_ns) => (start_ns, None, Some(unit_ns)),
        };
        let steps: Vec<i64> = rounded.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let fps = match grid_fps {
            Some(fps) => fps,
            None if steps.is_empty() => fps?,
            None => 1e9 / usual_step(&steps)?,
        };
        let mut number = 0_u32;
        let mut numbers = vec![0; rounded.len()];
        for (k, &step) in steps.iter().enumerate() {
            let nearby = &steps[k.saturating_sub(NEARBY)..(k + NEARBY + 1).min(steps.len())];
            let usual = median(nearby) as f64;
            number = number.saturating_add((step as f64 / usual).round().max(1.0) as u32);
            numbers[k + 1] = number;
        }
        Some(Self {
            start_ns: rounded,
            numbers,
            fps,
            coarse_ns,
        })
    }

    /// How many frames have a time.
    pub fn len(&self) -> usize {
        self.start_ns.len()
    }

    /// No frame has a time.
    pub fn is_empty(&self) -> bool {
        self.start_ns.is_empty()
    }

    /// Usual frame rate, Hz.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// The unit, ns, that times were rounded to where it is coarse and no even grid explains them.
    pub fn coarse_ns(&self) -> Option<i64> {
        self.coarse_ns
    }

    /// The same frames at another rate, Hz: from the first on, all distances change alike.
    #[must_use]
    pub fn at_rate(mut self, fps: f64) -> Self {
        let Some(&first) = self.start_ns.first() else {
            return self;
        };
        let slower = self.fps / fps;
        for time in &mut self.start_ns {
            *time = first + ((*time - first) as f64 * slower).round() as i64;
        }
        self.coarse_ns = self.coarse_ns.map(|unit| (unit as f64 * slower) as i64);
        self.fps = fps;
        self
    }
}

/// The mean of the steps in which no frame is missing, ns.
fn usual_step(steps: &[i64]) -> Option<f64> {
    let usual = 1.5 * median(steps) as f64;
    let (sum, count) = steps
        .iter()
        .filter(|&&step| (step as f64) < usual)
        .fold((0.0, 0.0), |(sum, count), &step| {
            (sum + step as f64, count + 1.0)
        });
    (sum > 0.0).then(|| sum / count)
}

/// The median, of at least one.
fn median(steps: &[i64]) -> i64 {
    let mut sorted = steps.to_vec();
    *sorted.select_nth_unstable(steps.len() / 2).1
}

/// Times that come with the frames, and what is known of them beforehand.
#[derive(Clone, Debug)]
pub struct Stamped {
    /// The stamps that are to come, in order, ns; none where they are not known.
    expected_ns: Vec<i64>,
    /// What the frames with these stamps get.
    times: Option<Times>,
    fps: f64,
    /// Of a time by the stamps, how much it is by the clock.
    slower: f64,
    /// The next of the expected.
    at: usize,
    /// Stamp, number and time of the frame before.
    before: Option<(i64, u32, i64)>,
}

impl Stamped {
    /// Takes the stamps that are to come, in order, ns, as far as they are known; the rate that they are
    /// said to have, Hz; and the true rate, where that is another. `None` where nothing tells a rate.
    pub fn new(
        expected_ns: Vec<i64>,
        said_fps: Option<f64>,
        true_fps: Option<f64>,
    ) -> Option<Self> {
        let times = Times::new(expected_ns.clone(), said_fps).filter(|times| !times.is_empty());
        let own_fps = times.as_ref().map(Times::fps).or(said_fps);
        let fps = true_fps.or(own_fps)?;
        Some(Self {
            times: match true_fps {
                Some(fps) => times.map(|times| times.at_rate(fps)),
                None => times,
            },
            expected_ns,
            fps,
            slower: own_fps.map_or(1.0, |own| own / fps),
            at: 0,
            before: None,
        })
    }

    /// The unit, ns, that the stamps were rounded to where that is coarse and no even grid explains them.
    pub fn coarse_ns(&self) -> Option<i64> {
        self.times.as_ref().and_then(Times::coarse_ns)
    }

    /// Number and start of exposure, ns, of the frame with this stamp, later than the one before.
    fn frame(&mut self, stamp_ns: Option<i64>) -> (u32, i64) {
        let period_ns = 1e9 / self.fps;
        let (stamp, number, time) = match (stamp_ns, self.before) {
            (Some(stamp), before) => match (self.expected(stamp), before) {
                (Some((number, time)), _) => (stamp, number, time),
                (None, None) => (stamp, 0, stamp),
                (None, Some((last, number, time))) => {
                    let step = (stamp.saturating_sub(last)).max(1) as f64 * self.slower;
                    let frames = (step / period_ns).round().max(1.0) as u32;
                    (
                        stamp,
                        number.saturating_add(frames),
                        time.saturating_add(step as i64),
                    )
                }
            },
            (None, None) => (0, 0, 0),
            (None, Some((last, number, time))) => {
                let step = period_ns as i64;
                (
                    last.saturating_add(step),
                    number.saturating_add(1),
                    time.saturating_add(step),
                )
            }
        };
        self.before = Some((stamp, number, time));
        (number, time)
    }

    /// What a frame with this stamp gets, if it was expected. Each of several with one stamp gets its own.
    fn expected(&mut self, stamp_ns: i64) -> Option<(u32, i64)> {
        while *self.expected_ns.get(self.at)? < stamp_ns {
            self.at += 1;
        }
        if self.expected_ns[self.at] != stamp_ns {
            return None;
        }
        let times = self.times.as_ref()?;
        let found = (*times.numbers.get(self.at)?, *times.start_ns.get(self.at)?);
        self.at += 1;
        Some(found)
    }
}

impl Clock {
    /// Usual frame rate, Hz.
    pub fn fps(&self) -> f64 {
        match self {
            Self::Rate(fps) => *fps,
            Self::Times(times) => times.fps,
            Self::Stamped(stamped) => stamped.fps,
        }
    }

    /// The unit, ns, that times were rounded to where it is coarse and no even grid explains them.
    pub fn coarse_ns(&self) -> Option<i64> {
        match self {
            Self::Rate(_) => None,
            Self::Times(times) => times.coarse_ns,
            Self::Stamped(stamped) => stamped.coarse_ns(),
        }
    }

    /// Number and start of exposure, ns, of the `index`-th frame of the file, which came with this stamp.
    /// `None` where the file of times has ended.
    pub fn frame(&mut self, index: u64, stamp_ns: Option<i64>) -> Option<(u32, i64)> {
        match self {
            Self::Rate(fps) => Some((index as u32, (index as f64 * 1e9 / *fps).round() as i64)),
            Self::Times(times) => {
                let index = usize::try_from(index).ok()?;
                Some((*times.numbers.get(index)?, *times.start_ns.get(index)?))
            }
            Self::Stamped(stamped) => Some(stamped.frame(stamp_ns)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames at a rate, of these numbers, in ns as a file in ticks of 1/90000 s would have them.
    fn ticks(fps: f64, numbers: impl IntoIterator<Item = u32>) -> Vec<i64> {
        let tick = |i: u32| (f64::from(i) * 90e3 / fps).round();
        numbers
            .into_iter()
            .map(|i| (tick(i) / 90e3 * 1e9).round() as i64)
            .collect()
    }

    fn numbers(clock: &mut Clock, stamps: &[i64]) -> Vec<u32> {
        (0..)
            .zip(stamps)
            .map(|(i, &stamp)| clock.frame(i, Some(stamp)).unwrap().0)
            .collect()
    }

    #[test]
    fn a_gap_in_the_times_is_a_gap_in_the_numbers() {
        let us = |t: i64| t * 1_000;
        let times = vec![us(0), us(33_017), us(66_950), us(166_721), us(200_003)];
        let mut clock = Clock::Times(Times::new(times, None).unwrap());
        let numbers: Vec<_> = (0..5).map(|i| clock.frame(i, None).unwrap().0).collect();
        assert_eq!(numbers, [0, 1, 2, 5, 6]);
        assert_eq!(clock.frame(5, None), None);
    }

    #[test]
    fn a_rate_that_changes_is_no_loss() {
        let mut times = ticks(60.0, 0..60);
        let last = times[59];
        times.extend(ticks(30.0, 1..60).iter().map(|t| t + last));
        times.remove(90);
        let times = Times::new(times, None).unwrap();
        assert!((times.fps() - 60.0).abs() < 0.01);
        let all = times.numbers.last().copied();
        // The one that was taken out is the only one missing.
        assert_eq!(all, Some(118));
    }

    #[test]
    fn without_times_a_frame_is_its_number_over_the_rate() {
        let mut clock = Clock::Rate(60.0);
        assert_eq!(clock.frame(3, None), Some((3, 50_000_000)));
    }

    #[test]
    fn stamps_in_whole_milliseconds_are_put_on_their_grid() {
        let stamps: Vec<i64> = (0..240)
            .map(|i| (f64::from(i) * 1e3 / 60.0).round() as i64 * 1_000_000)
            .collect();
        let mut clock = Clock::Stamped(Stamped::new(stamps.clone(), None, None).unwrap());
        assert!((clock.fps() - 60.0).abs() < 0.001 && clock.coarse_ns().is_none());
        for (i, &stamp) in (0..).zip(&stamps) {
            let (number, time) = clock.frame(i, Some(stamp)).unwrap();
            assert_eq!(u64::from(number), i);
            assert!(
                (time as f64 - i as f64 * 1e9 / 60.0).abs() < 0.35e6,
                "{i}: {time}"
            );
        }
    }

    #[test]
    fn another_rate_keeps_the_gaps() {
        let kept: Vec<u32> = (0..50).filter(|i| !(20..23).contains(i)).collect();
        let stamps = ticks(25.0, kept.iter().copied());
        let mut clock =
            Clock::Stamped(Stamped::new(stamps.clone(), Some(25.0), Some(1900.0)).unwrap());
        assert_eq!(clock.fps(), 1900.0);
        assert_eq!(numbers(&mut clock.clone(), &stamps), kept);
        for ((i, &stamp), &number) in (0..).zip(&stamps).zip(&kept) {
            let time = clock.frame(i, Some(stamp)).unwrap().1 as f64;
            assert!(
                (time - f64::from(number) * 1e9 / 1900.0).abs() < 1e3,
                "{number}: {time}"
            );
        }
    }

    #[test]
    fn stamps_that_nobody_announced() {
        let stamps = ticks(60.0, (5..100).filter(|i| *i != 50));
        let mut clock = Clock::Stamped(Stamped::new(vec![], Some(60.0), None).unwrap());
        let found = numbers(&mut clock, &stamps);
        assert_eq!((found[0], found[44], found[45], found[93]), (0, 44, 46, 94));
        assert_eq!(clock.frame(94, None).unwrap().0, 95);
        assert!(Stamped::new(vec![], None, None).is_none());
        // Beyond what was announced, by the steps.
        let mut clock = Clock::Stamped(Stamped::new(stamps[..40].to_vec(), None, None).unwrap());
        assert_eq!(numbers(&mut clock, &stamps)[93], 94);
    }
}
