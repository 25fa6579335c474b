//! What is counted while a clip runs.

/// Instructions of one kind of work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    times: u64,
    sum: u64,
    min: Option<u64>,
    max: u64,
}

impl Count {
    /// It was done once more.
    pub fn add(&mut self, instructions: u64) {
        self.times += 1;
        self.sum += instructions;
        self.min = Some(self.min.map_or(instructions, |min| min.min(instructions)));
        self.max = self.max.max(instructions);
    }

    /// Fewest; 0 where it was never done.
    pub fn min(&self) -> u64 {
        self.min.unwrap_or(0)
    }

    /// Mean, rounded to the nearest.
    pub fn mean(&self) -> u64 {
        (self.sum + self.times / 2) / self.times.max(1)
    }

    /// Most.
    pub fn max(&self) -> u64 {
        self.max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts() {
        let mut count = Count::default();
        assert_eq!((count.min(), count.mean(), count.max()), (0, 0, 0));
        for n in [10, 20, 33] {
            count.add(n);
        }
        assert_eq!((count.min(), count.mean(), count.max()), (10, 21, 33));
    }
}
