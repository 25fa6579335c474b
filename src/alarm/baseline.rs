//! What is usual for a machine, learned robustly.

use heapless::Vec;

/// Most windows, and by default as many, from which a baseline is learned.
pub const LEARN_WINDOWS: usize = 300;

/// What is usual: the median of the windows that were learned from, and 1.4826 times the median of their distances from
/// it, which is the standard deviation where they are normal and hardly moves where a few are not (Rousseeuw and Croux,
/// *Alternatives to the Median Absolute Deviation*, 1993).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Baseline {
    /// The usual value, in the quantity's unit.
    pub centre: f32,
    /// Its standard deviation from window to window.
    pub spread: f32,
}

/// 1/Φ⁻¹(3/4): a normal distribution's deviation over its median absolute one.
const NORMAL: f32 = 1.4826;

/// A baseline, or the windows towards one.
#[derive(Clone, Debug)]
pub(super) struct Learner {
    wanted: u16,
    seen: Vec<f32, LEARN_WINDOWS>,
    learned: Option<Baseline>,
}

impl Learner {
    pub(super) fn new(windows: u16) -> Self {
        Self {
            wanted: windows,
            seen: Vec::new(),
            learned: None,
        }
    }

    pub(super) fn set(&mut self, baseline: Option<Baseline>) {
        let possible =
            |b: &Baseline| b.centre.is_finite() && b.spread.is_finite() && b.spread >= 0.0;
        self.learned = baseline.filter(possible);
        self.seen.clear();
    }

    pub(super) fn learned(&self) -> Option<Baseline> {
        self.learned
    }

    /// Windows that are still to come.
    pub(super) fn missing(&self) -> u16 {
        match self.learned {
            Some(_) => 0,
            // At most LEARN_WINDOWS of them.
            None => self.wanted.saturating_sub(self.seen.len() as u16),
        }
    }

    /// Takes a finite value; the baseline, with the last one that it takes.
    pub(super) fn take(&mut self, value: f32) -> Option<Baseline> {
        if self.learned.is_some() {
            return None;
        }
        let full = self.seen.push(value).is_err();
        if !full && self.missing() > 0 {
            return None;
        }
        let centre = median(&mut self.seen)?;
        self.seen.iter_mut().for_each(|v| *v = (*v - centre).abs());
        let spread = NORMAL * median(&mut self.seen)?;
        self.set(Some(Baseline { centre, spread }));
        self.learned
    }
}

/// The upper median; `None` of nothing.
fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fifth_of_wild_windows_hardly_moves_it() {
        let mut learner = Learner::new(300);
        let mut last = None;
        for n in 0..300_u16 {
            assert_eq!(learner.missing(), 300 - n);
            // Evenly from 9 to 11: the median 10, its absolute deviation 0.5; every fifth window is 20 times that.
            let value = 9.0 + 2.0 * f32::from(n * 7 % 300) / 300.0;
            last = learner.take(if n % 5 == 0 { 20.0 * value } else { value });
        }
        let Baseline { centre, spread } = last.unwrap();
        assert!((centre - 10.0).abs() < 0.3, "{centre}");
        assert!((0.6..1.2).contains(&spread), "{spread}");
        assert_eq!((learner.missing(), learner.take(1e9)), (0, None));
    }
}
