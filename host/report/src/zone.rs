//! Evaluation zones after ISO 20816: A (as new) to D (damaging).
//!
//! The limits between them depend on the kind of machine and its mounting: the user names one ([`super::machine`]), or gives
//! those of the part of the standard that applies.

use std::str::FromStr;

use super::machine::MACHINES;

/// Velocities, mm/s RMS, from which on a machine is in zone B, C and D.
///
/// ```
/// use rowtone_report::zone::ZoneLimits;
/// let limits: ZoneLimits = "1.4,2.8,4.5".parse()?;
/// assert_eq!([1.39, 1.4, 3.0, 9.0].map(|v| limits.zone(v)), ['A', 'B', 'C', 'D']);
/// assert!("2.8,1.4,4.5".parse::<ZoneLimits>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneLimits([f64; 3]);

impl ZoneLimits {
    /// Those of a kind of machine, by its name in [`MACHINES`].
    ///
    /// # Errors
    /// A line with all names, for one that is none of them.
    ///
    /// ```
    /// use rowtone_report::zone::ZoneLimits;
    /// let limits = ZoneLimits::of_machine("iso20816-3:group2:flexible")?;
    /// assert_eq!(limits.zone(3.0), 'B');
    /// assert!(ZoneLimits::of_machine("toaster").is_err());
    /// # Ok::<(), String>(())
    /// ```
    pub fn of_machine(name: &str) -> Result<Self, String> {
        let found = MACHINES.iter().find(|machine| machine.name == name);
        found
            .map(|machine| Self(machine.limits_mm_s))
            .ok_or_else(|| {
                let names: Vec<_> = MACHINES.iter().map(|machine| machine.name).collect();
                format!("want one of {}", names.join(", "))
            })
    }

    /// The zone of a velocity, mm/s RMS.
    pub fn zone(&self, mm_s_rms: f64) -> char {
        let above = self.0.iter().filter(|&&limit| mm_s_rms >= limit).count();
        ['A', 'B', 'C', 'D'][above]
    }
}

impl FromStr for ZoneLimits {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers: Vec<f64> = text.split(',').filter_map(|s| s.parse().ok()).collect();
        match *numbers {
            [b, c, d] if 0.0 < b && b < c && c < d && d.is_finite() => Ok(Self([b, c, d])),
            _ => Err("want three velocities in mm/s RMS, rising, with commas: where zones B, C and D begin".to_owned()),
        }
    }
}
