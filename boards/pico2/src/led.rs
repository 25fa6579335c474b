//! What the LED shows.

/// How the board is doing, as far as one LED can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// No picture to measure yet: slow, half on and half off, once a second.
    Searching,
    /// Measuring: on, with a short gap every two seconds (so that a frozen board looks different).
    Measuring,
    /// Lines are lost because the work is late: fast, five times a second.
    LineOverrun,
    /// The camera is faulty: two short flashes a second.
    Fault,
}

impl Show {
    /// Whether the LED is on, this many milliseconds after the start.
    pub const fn is_lit(self, ms: u64) -> bool {
        match self {
            Self::Searching => ms % 1000 < 500,
            Self::Measuring => ms % 2000 >= 100,
            Self::LineOverrun => ms % 200 < 100,
            Self::Fault => matches!(ms % 1000, 0..80 | 200..280),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of time lit, and changes in two seconds: no two states look alike.
    #[test]
    fn states_look_different() {
        let look = |show: Show| {
            let lit: Vec<bool> = (0..2000).map(|ms| show.is_lit(ms)).collect();
            (
                lit.iter().filter(|&&l| l).count(),
                lit.windows(2).filter(|w| w[0] != w[1]).count(),
            )
        };
        assert_eq!(look(Show::Searching), (1000, 3));
        assert_eq!(look(Show::Measuring), (1900, 1));
        assert_eq!(look(Show::LineOverrun), (1000, 19));
        assert_eq!(look(Show::Fault), (320, 7));
    }
}
