//! The small ones: zero, a straight line, the median of the neighbours.

/// Zero in every gap.
pub fn zero(samples: &[Option<f64>]) -> Vec<f64> {
    samples.iter().map(|s| s.unwrap_or(0.0)).collect()
}

/// A straight line across every gap; the nearest sample at the ends.
pub fn linear(samples: &[Option<f64>]) -> Vec<f64> {
    across(samples, |before, after, share| match (before, after) {
        (Some(a), Some(b)) => a + share * (b - a),
        (Some(a), None) | (None, Some(a)) => a,
        (None, None) => 0.0,
    })
}

/// In every gap the median of the eight samples before and the eight after.
pub fn median(samples: &[Option<f64>]) -> Vec<f64> {
    let mut filled = zero(samples);
    for (first, last) in gaps(samples) {
        let before = samples[..first].iter().rev().filter_map(|s| *s).take(8);
        let after = samples[last..].iter().filter_map(|s| *s).take(8);
        let near: Vec<f64> = before.chain(after).collect();
        filled[first..last].fill(rowtone_linear::median(&near));
    }
    filled
}

fn across(
    samples: &[Option<f64>],
    value: impl Fn(Option<f64>, Option<f64>, f64) -> f64,
) -> Vec<f64> {
    let mut filled = zero(samples);
    for (first, last) in gaps(samples) {
        let before = first.checked_sub(1).and_then(|i| samples[i]);
        let after = samples.get(last).copied().flatten();
        for (i, slot) in filled[first..last].iter_mut().enumerate() {
            *slot = value(before, after, (i + 1) as f64 / (last - first + 1) as f64);
        }
    }
    filled
}

/// Runs of missing samples: first, and one after the last.
pub fn gaps(samples: &[Option<f64>]) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut start = None;
    for i in 0..=samples.len() {
        let missing = samples.get(i).is_some_and(Option::is_none);
        match (missing, start) {
            (true, None) => start = Some(i),
            (false, Some(first)) => {
                runs.push((first, i));
                start = None;
            }
            _ => {}
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_lines() {
        let samples = [None, Some(2.0), None, None, Some(5.0), None];
        assert_eq!(gaps(&samples), [(0, 1), (2, 4), (5, 6)]);
        assert_eq!(linear(&samples), [2.0, 2.0, 3.0, 4.0, 5.0, 5.0]);
        assert_eq!(median(&samples)[2], 3.5);
    }
}
