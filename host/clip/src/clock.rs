//! When each frame was exposed, and which number the camera gave it.

use super::pts;

/// Where the times of the frames come from.
#[derive(Clone, Debug)]
pub enum Clock {
    /// Frame number over frame rate, Hz.
    Rate(f64),
    /// A file of times.
    Times(Times),
}

/// Times read from a file.
#[derive(Clone, Debug)]
pub struct Times {
    start_ns: Vec<i64>,
    numbers: Vec<u32>,
    fps: f64,
}

impl Times {
    /// Takes the times, in order, and counts the frames that are missing between them: a step of about
    /// two usual steps is one lost frame. `fps` is the frame rate where it is known otherwise; else it
    /// is the usual step's. `None` for fewer than two times without a known rate.
    pub fn new(start_ns: Vec<i64>, fps: Option<f64>) -> Option<Self> {
        let period = match (pts::period_ns(&start_ns), fps) {
            (Some(period), _) => period as f64,
            (None, Some(fps)) => 1e9 / fps,
            (None, None) => return None,
        };
        let mut number = 0_u32;
        let mut before = None;
        let numbers = start_ns
            .iter()
            .map(|&time| {
                if let Some(before) = before.replace(time) {
                    let steps = ((time - before) as f64 / period).round().max(1.0);
                    number = number.wrapping_add(steps as u32);
                }
                number
            })
            .collect();
        Some(Self {
            start_ns,
            numbers,
            fps: 1e9 / period,
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
}

impl Clock {
    /// Usual frame rate, Hz.
    pub fn fps(&self) -> f64 {
        match self {
            Self::Rate(fps) => *fps,
            Self::Times(times) => times.fps,
        }
    }

    /// Number and start of exposure, ns, of the `index`-th frame of the file. `None` where the file of
    /// times has ended.
    pub fn frame(&self, index: u64) -> Option<(u32, i64)> {
        match self {
            Self::Rate(fps) => Some((index as u32, (index as f64 * 1e9 / fps).round() as i64)),
            Self::Times(times) => {
                let index = usize::try_from(index).ok()?;
                Some((*times.numbers.get(index)?, *times.start_ns.get(index)?))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_in_the_times_is_a_gap_in_the_numbers() {
        let ms = |t: i64| t * 1_000_000;
        let times = vec![ms(0), ms(33), ms(67), ms(167), ms(200)];
        let clock = Clock::Times(Times::new(times, None).unwrap());
        let numbers: Vec<_> = (0..5).map(|i| clock.frame(i).unwrap().0).collect();
        assert_eq!(numbers, [0, 1, 2, 5, 6]);
        assert_eq!(clock.frame(5), None);
    }

    #[test]
    fn without_times_a_frame_is_its_number_over_the_rate() {
        let clock = Clock::Rate(60.0);
        assert_eq!(clock.frame(3), Some((3, 50_000_000)));
    }
}
