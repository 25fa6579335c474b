//! When each frame starts, and which frames never arrive.

use rand_distr::{Distribution, StandardNormal};

use super::config::Config;
use super::random::{stream, unit};

/// One frame's place in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Number of the frame, lost ones counted.
    pub number: u32,
    /// Start of exposure of the first row to be read, ns.
    pub start_ns: i64,
    /// It never arrives.
    pub lost: bool,
}

/// The starts of all frames. A frame never starts before the one before it has been read out.
pub fn slots(config: &Config) -> Vec<Slot> {
    let readout_ns = (config.sensor.readout_s() * 1e9).round() as i64;
    let faults = &config.faults;
    let (mut from_s, mut fps, mut since) = (0.0, config.sensor.fps, 0u32);
    let mut changes = config.rate_changes.iter().peekable();
    let mut earliest_ns = i64::MIN;
    (0..config.frames)
        .map(|number| {
            let mut nominal_s = from_s + f64::from(since) / fps;
            if let Some(change) = changes.next_if(|c| c.t_s <= nominal_s + 1e-9) {
                (from_s, fps, since) = (nominal_s, change.fps, 0);
                nominal_s = from_s;
            }
            since += 1;
            let mut rng = stream(config.seed, 1, number);
            let normal: f64 = StandardNormal.sample(&mut rng);
            let late = unit(&mut rng) < faults.late_probability;
            let unlucky = unit(&mut rng) < faults.lost_probability;
            let delay_us = faults.jitter_us * normal + if late { faults.late_us } else { 0.0 };
            let start_ns = ((nominal_s * 1e9 + delay_us * 1e3).round() as i64).max(earliest_ns);
            earliest_ns = start_ns + readout_ns;
            Slot {
                number,
                start_ns,
                lost: unlucky || faults.lost.contains(&number),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RateChange;

    #[test]
    fn frames_start_evenly_without_faults() {
        let slots = slots(&Config {
            frames: 4000,
            ..Config::default()
        });
        assert!(slots.iter().all(|s| !s.lost && s.start_ns == (f64::from(s.number) * 1e9 / 60.0).round() as i64));
    }

    #[test]
    fn jitter_losses_and_delays_have_the_asked_size() {
        let mut config = Config {
            frames: 4000,
            ..Config::default()
        };
        config.faults.jitter_us = 30.0;
        config.faults.lost_probability = 0.05;
        config.faults.lost = vec![7, 8];
        let all = slots(&config);
        let off = |s: &Slot| s.start_ns as f64 - f64::from(s.number) * 1e9 / 60.0;
        let rms = (all.iter().map(|s| off(s).powi(2)).sum::<f64>() / 4000.0).sqrt();
        assert!((29_000.0..31_000.0).contains(&rms), "{rms}"); // sd of the estimate: 335
        let lost = all.iter().filter(|s| s.lost).count();
        assert!((140..=262).contains(&lost), "{lost}"); // mean 202, sd 14
        assert!(all[7].lost && all[8].lost);
        config.faults.jitter_us = 0.0;
        config.faults.late_probability = 0.5;
        config.faults.late_us = 4000.0;
        let late = slots(&config).iter().filter(|s| off(s) > 3e6).count();
        assert!((1850..=2150).contains(&late), "{late}");
    }

    #[test]
    fn no_frame_starts_before_the_last_is_read() {
        let mut config = Config {
            frames: 2000,
            ..Config::default()
        };
        config.faults.jitter_us = 20_000.0;
        let all = slots(&config);
        assert!(
            all.windows(2)
                .all(|w| w[1].start_ns - w[0].start_ns >= 12_000_000)
        );
    }

    #[test]
    fn the_rate_hops_and_hops_back() {
        let mut config = Config {
            frames: 200,
            ..Config::default()
        };
        config.rate_changes = vec![
            RateChange {
                t_s: 1.0,
                fps: 50.0,
            },
            RateChange {
                t_s: 2.0,
                fps: 60.0,
            },
        ];
        let at: Vec<i64> = slots(&config).iter().map(|s| s.start_ns).collect();
        assert_eq!(
            (at[60], at[61], at[110], at[170]),
            (1_000_000_000, 1_020_000_000, 2_000_000_000, 3_000_000_000)
        );
    }
}
