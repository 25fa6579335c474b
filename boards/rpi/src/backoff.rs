//! Waiting longer from failure to failure.

use std::time::{Duration, Instant};

/// Doubles from the shortest to the longest wait.
#[derive(Clone, Debug)]
pub struct Backoff {
    shortest: Duration,
    longest: Duration,
    wait: Duration,
    failed: Option<Instant>,
}

impl Backoff {
    /// Waits within these bounds.
    pub fn new(shortest: Duration, longest: Duration) -> Self {
        Self {
            shortest,
            longest,
            wait: shortest,
            failed: None,
        }
    }

    /// The wait is over, or nothing has failed.
    pub fn is_due(&self) -> bool {
        self.failed.is_none_or(|at| at.elapsed() >= self.wait)
    }

    /// It failed now; how long to wait.
    pub fn failed(&mut self) -> Duration {
        if self.failed.is_some() {
            self.wait = (self.wait * 2).min(self.longest);
        }
        self.failed = Some(Instant::now());
        self.wait
    }

    /// It works again.
    pub fn reset(&mut self) {
        self.wait = self.shortest;
        self.failed = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_the_longest() {
        let ms = Duration::from_millis;
        let mut backoff = Backoff::new(ms(500), ms(1500));
        assert!(backoff.is_due());
        let waits: Vec<_> = (0..4).map(|_| backoff.failed()).collect();
        assert_eq!(waits, [ms(500), ms(1000), ms(1500), ms(1500)]);
        assert!(!backoff.is_due());
        backoff.reset();
        assert_eq!(backoff.failed(), ms(500));
    }
}
