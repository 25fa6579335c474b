//! Single frames that are unlike all others: black, over-exposed, of another scene. One of them spoils what is common.

use super::rows::Recording;
use super::search::periodogram;
use rowtone_linear::{median, orthonormal, remove};

/// Fewest frames of which one can be called unlike.
const LEAST_FRAMES: usize = 3;
/// Part of the frames that may be left out; one in any case.
const MOST: usize = 10;
/// A frame is unlike where its mean brightness or the power of its changes from row to row is so many times that of most,
const BRIGHTNESS: f64 = 3.0;
const POWER: f64 = 10.0;
/// or where its spectrum has less than this in common with that of most (1: the same), while most have
const COMMON: f64 = 0.6;
/// this.
const USUAL: f64 = 0.85;

impl Recording {
    /// The recording without frames that are unlike the others, and how many those are; with all of them where there are
    /// too many.
    pub fn without_bad_frames(self) -> (Self, usize) {
        let bad = bad_frames(&self.rows);
        let count = bad.iter().filter(|b| **b).count();
        if count == 0 || count > (self.rows.len() / MOST).max(1) {
            return (self, 0);
        }
        let is_good = |n: &usize| !bad.get(*n).copied().unwrap_or(false);
        let rows = (0..self.rows.len()).filter(is_good);
        let rows = rows.map(|n| self.rows[n].clone()).collect();
        let times_s = self.times_s.as_ref().map(|times| {
            let kept = (0..times.len()).filter(is_good);
            kept.map(|n| times[n]).collect()
        });
        let kept = Self {
            rows,
            times_s,
            ..self
        };
        (kept, count)
    }
}

fn bad_frames(rows: &[Vec<f64>]) -> Vec<bool> {
    let height = rows.first().map_or(0, Vec::len);
    if rows.len() < LEAST_FRAMES || height < 16 {
        return vec![false; rows.len()];
    }
    let line: Vec<f64> = (0..height)
        .map(|y| y as f64 - 0.5 * height as f64)
        .collect();
    let basis = orthonormal(vec![vec![1.0; height], line]);
    let mean: Vec<f64> = rows
        .iter()
        .map(|r| r.iter().sum::<f64>() / height as f64)
        .collect();
    let spectra: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| {
            let mut changes = row.clone();
            remove(&basis, &mut changes);
            periodogram(&[changes]).1
        })
        .collect();
    let total: Vec<f64> = spectra.iter().map(|s| s.iter().sum::<f64>()).collect();
    let of_most: Vec<f64> = (0..spectra[0].len())
        .map(|k| median(&spectra.iter().map(|s| s[k]).collect::<Vec<f64>>()))
        .collect();
    let all = of_most.iter().sum::<f64>();
    let common: Vec<f64> = spectra
        .iter()
        .zip(&total)
        .map(|(s, t)| {
            let products = s.iter().zip(&of_most).map(|(a, b)| (a * b).sqrt());
            products.sum::<f64>() / (t * all).sqrt().max(f64::MIN_POSITIVE)
        })
        .collect();
    let [usual_mean, usual_power, usual_common] = [&mean, &total, &common].map(|v| median(v));
    let is_off = |value: f64, usual: f64, times: f64| {
        usual > 0.0 && !(usual / times..=usual * times).contains(&value)
    };
    (0..rows.len())
        .map(|n| {
            is_off(mean[n], usual_mean, BRIGHTNESS)
                || is_off(total[n], usual_power, POWER)
                || usual_common > USUAL && common[n] < COMMON
        })
        .collect()
}
