//! Random numbers of a fixed seed, for tests: the same on every machine and for ever.
//!
//! Each generator is a published one of a few lines. Tests keep the one that their seeds were chosen
//! with, so that a figure or a fault that one of them found stays what it was.

use std::f64::consts::TAU;

/// A source of random bits, and what tests draw from it.
pub trait Chance {
    /// 64 bits, of which the upper ones are the best.
    fn next(&mut self) -> u64;

    /// Evenly from 0 to below 1, of 53 bits.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Evenly from 0 to below `end`.
    fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.next()) * u128::from(end)) >> 64) as u64
    }

    /// True with this probability.
    fn happens(&mut self, probability: f64) -> bool {
        ((self.next() >> 11) as f64) < probability * (1_u64 << 53) as f64
    }

    /// Of nearly a standard normal distribution, within ±6: the sum of twelve even numbers, less 6.
    fn bell(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    /// Of a standard normal distribution (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.unit().max(1e-300).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }

    /// Of a standard normal distribution, from numbers of 53 bits that lie between the steps, so that
    /// none is 0.
    fn normal_between(&mut self) -> f64 {
        let mut between = || ((self.next() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
        let (a, b) = (between(), between());
        (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
    }
}

/// Knuth's linear congruential generator of 64 bits (The Art of Computer Programming 2, section 3.3.4:
/// that of MMIX).
#[derive(Clone, Debug)]
pub struct Mmix(pub u64);

impl Chance for Mmix {
    fn next(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0
    }
}

/// Marsaglia's xorshift of 64 bits (2003), steps 13, 7 and 17. The seed must not be 0.
#[derive(Clone, Debug)]
pub struct XorShift(pub u64);

impl Chance for XorShift {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
}

/// Vigna's xorshift64* (2016). The seed must not be 0.
#[derive(Clone, Debug)]
pub struct XorShiftStar(pub u64);

impl Chance for XorShiftStar {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }
}

/// SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub struct SplitMix(pub u64);

impl Chance for SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }
}

/// The generator of 32 bits of Numerical Recipes (section 7.1, "quick and dirty").
#[derive(Clone, Debug)]
pub struct Quick(pub u32);

impl Quick {
    /// Evenly from 0 to below 1, of 24 bits.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever changes a generator changes every test that uses it.
    #[test]
    fn generators_stay_what_they_are() {
        // The authors' own first values, where they give some: SplitMix64 of the seed 1234567.
        let mut split_mix = SplitMix(1_234_567);
        let first = [split_mix.next(), split_mix.next()];
        assert_eq!(
            first,
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]
        );
        assert_eq!(Mmix(1).next(), 7_806_831_264_735_756_412);
        assert_eq!(XorShift(1).next(), 1_082_269_761);
        assert_eq!(XorShiftStar(1).next(), 5_180_492_295_206_395_165);
        assert_eq!(
            Quick(1).unit(),
            f64::from(1_015_568_748 >> 8) / 16_777_216.0
        );
    }

    /// Of 10 000 numbers; the bounds are five standard deviations of each figure: false failure below
    /// 1e-5, of a fixed seed.
    #[test]
    fn what_is_drawn_has_its_mean_and_spread() {
        type Draw = fn(&mut Mmix) -> f64;
        let draws: [(Draw, f64, f64); 4] = [
            (Chance::unit, 0.5, 1.0 / 12.0),
            (Chance::bell, 0.0, 1.0),
            (Chance::normal, 0.0, 1.0),
            (Chance::normal_between, 0.0, 1.0),
        ];
        for (draw, mean, variance) in draws {
            let mut chance = Mmix(3);
            let values: Vec<f64> = (0..10_000).map(|_| draw(&mut chance)).collect();
            let average = values.iter().sum::<f64>() / 1e4;
            let spread = values.iter().map(|v| (v - average).powi(2)).sum::<f64>() / 1e4;
            assert!((average - mean).abs() < 0.05 * variance.sqrt(), "{average}");
            assert!((spread / variance - 1.0).abs() < 0.071, "{spread}");
        }
        let mut chance = XorShiftStar(5);
        let hits = (0..10_000).filter(|_| chance.happens(0.25)).count();
        assert!(hits.abs_diff(2500) < 217, "{hits}");
        assert!((0..1000).all(|_| chance.below(7) < 7));
    }
}
