//! Quotients of whole numbers: time bases and rates.

use std::str::FromStr;

/// A quotient of whole numbers, as ffmpeg writes time bases (`1/15360`, s) and rates (`30000/1001`, Hz).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ratio {
    /// Above 0.
    pub numerator: u32,
    /// Above 0.
    pub denominator: u32,
}

impl Ratio {
    /// The quotient.
    pub fn value(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// That many times the quotient, taken as seconds, in ns. `None` beyond 146 years, so that the time
    /// between any two fits as well.
    pub fn times_in_ns(self, count: i64) -> Option<i64> {
        let product = i128::from(count) * i128::from(self.numerator) * 1_000_000_000;
        let denominator = i128::from(self.denominator);
        let half = denominator / 2 * product.signum();
        let ns = i64::try_from((product + half) / denominator).ok()?;
        (ns.unsigned_abs() < 1 << 62).then_some(ns)
    }
}

impl FromStr for Ratio {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let (numerator, denominator) = text.split_once('/').ok_or(())?;
        let part = |text: &str| text.parse().ok().filter(|&n: &u32| n > 0).ok_or(());
        Ok(Self {
            numerator: part(numerator)?,
            denominator: part(denominator)?,
        })
    }
}
