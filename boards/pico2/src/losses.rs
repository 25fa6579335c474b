//! What was lost since the start, as it is said on the serial line.

use core::fmt;

/// Counts since the start; each saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Lines that came while the last was still being worked on.
    pub late: u32,
    /// Lines whose pixel clock or HREF broke off.
    pub short: u32,
    /// Lines during which the DMA was late.
    pub stalled: u32,
    /// Samples that found core 1's queue full.
    pub samples: u32,
    /// Windows that found core 1 still busy with the last.
    pub windows: u32,
}

impl fmt::Display for Losses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "lost since the start: {} lines too late, {} cut short, {} by DMA; {} samples, {} windows",
            self.late, self.short, self.stalled, self.samples, self.windows
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_fits_a_note() {
        let most = u32::MAX;
        let losses = Losses {
            late: 7,
            short: most,
            stalled: most,
            samples: most,
            windows: most,
        };
        let said = losses.to_string();
        assert!(said.starts_with("lost since the start: 7 lines too late, 4294967295 cut short"));
        assert!(said.len() + 2 + 9 <= 160, "{}", said.len());
    }
}
