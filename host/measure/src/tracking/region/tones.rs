//! Which tones there are, and how far each tile of the picture follows them.

use std::f64::consts::TAU;
use std::ops::Range;

use rowtone_fourier::{Complex64, Fourier};

use super::rectangle::Tile;
use super::shifts::Shifts;

/// Standard deviations of a normal distribution by which a tone must stand out: by chance it happens in one of
/// ten thousand pictures, of some thousand frequencies each.
const OUTSTANDING: f64 = 5.5;
/// Most points of a spectrum: of a longer recording only the lower frequencies are looked at.
const POINTS: usize = 1 << 15;
/// A tone of less than this share of the first one's power does not count.
const ALIKE: f64 = 0.1;
/// As near as this to a tone's frequency or to its ghost's is the same, in units of a spectrum's resolution.
const GHOST: f64 = 1.5;
/// A group whose texture is no more than so many times what its mean's noise makes has none.
const TEXTURE: f64 = 4.0;
/// The noise of the pixels of one strip is at most so many times the usual one's.
const MOTLEY: f64 = 4.0;

/// Takes each group's mean and trend over the frames off, measures the noise of each strip, and lets go of groups that
/// have no texture.
pub(super) fn measure_noise(shifts: &mut Shifts) {
    let frames = shifts.frames;
    for pulls in &mut shifts.pulls {
        for pulls in pulls.chunks_exact_mut(frames) {
            level(pulls, &shifts.starts_s);
        }
    }
    for (strip, mut power) in spectra(shifts).into_iter().enumerate() {
        let grip = total(&shifts.grips[strip]);
        if grip > 0.0 {
            // The power of noise is distributed exponentially.
            let middle = power.len() / 2;
            let (_, &mut median, _) = power.select_nth_unstable_by(middle, f32::total_cmp);
            let median = f64::from(median);
            shifts.noise[strip] = median / std::f64::consts::LN_2 / grip;
        }
    }
    let usual = usual_noise(&shifts.noise);
    for (strip, columns) in shifts.columns.iter().enumerate() {
        // What moves irregularly, or by more than a shift is linear in, has more than the pixels' noise.
        let noise = shifts.noise[strip].min(MOTLEY * usual);
        for (k, rows) in shifts.groups.iter().enumerate() {
            let pixels = (rows.len() * columns.len()) as f64;
            let chance = (noise * pixels / (2.0 * frames as f64)) as f32;
            let grip = &mut shifts.grips[strip][k];
            if *grip > (1.0 + TEXTURE as f32) * chance {
                *grip -= chance;
            } else {
                *grip = 0.0;
                shifts.pulls[strip][k * frames..(k + 1) * frames].fill(0.0);
            }
        }
    }
}

/// The median of the strips that have any.
fn usual_noise(noise: &[f64]) -> f64 {
    let mut some: Vec<f64> = noise.iter().copied().filter(|&n| n > 0.0).collect();
    let middle = some.len() / 2;
    if some.is_empty() {
        return 0.0;
    }
    *some.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// A tone that was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tone {
    pub(super) hz: f64,
    /// Power over that of the noise.
    power: f64,
}

/// The strongest tone that surely is one, and is none of the `known` ones nor their ghosts: where part of a tile moves,
/// taking a tone out of it leaves something at all multiples of the frame rate from it. The others are of about the same
/// strength.
pub(super) fn strongest(shifts: &Shifts, known: &[Tone]) -> Option<Tone> {
    outstanding(shifts, known, ALIKE)
}

/// The same, however much weaker than those known.
pub(super) fn weaker(shifts: &Shifts, known: &[Tone]) -> Option<Tone> {
    outstanding(shifts, known, 0.0)
}

fn outstanding(shifts: &Shifts, known: &[Tone], share: f64) -> Option<Tone> {
    let mut pooled: Vec<f64> = Vec::new();
    let mut strips = 0.0f64;
    for (strip, power) in spectra(shifts).into_iter().enumerate() {
        let expected = shifts.noise[strip] * total(&shifts.grips[strip]);
        if expected > 0.0 {
            pooled.resize(power.len(), 0.0);
            for (p, power) in pooled.iter_mut().zip(power) {
                *p += f64::from(power) / expected;
            }
            strips += 1.0;
        }
    }
    if strips == 0.0 {
        return None;
    }
    // Quantile of a sum of exponential distributions (Wilson & Hilferty).
    let threshold =
        strips * (1.0 - 1.0 / (9.0 * strips) + OUTSTANDING / (3.0 * strips.sqrt())).powi(3);
    let bin_hz = 1.0 / (shifts.step_s * points(shifts) as f64);
    let fps = (shifts.frames - 1) as f64 / shifts.starts_s.last()?;
    let near_hz = GHOST / shifts.span_s();
    let is_ghost = |bin: usize| {
        let hz = bin as f64 * bin_hz;
        let away = |hz: f64| (hz - (hz / fps).round() * fps).abs();
        let mut known = known.iter();
        known.any(|k| away(hz - k.hz).min(away(hz + k.hz)) < near_hz)
    };
    let inner = (1..pooled.len().saturating_sub(1)).filter(|&bin| !is_ghost(bin));
    let best = inner.max_by(|&a, &b| pooled[a].total_cmp(&pooled[b]))?;
    let least = known.first().map_or(0.0, |k| share * k.power);
    if pooled[best] < threshold.max(least) {
        return None;
    }
    let [left, here, right] = [pooled[best - 1], pooled[best], pooled[best + 1]];
    let bend = left - 2.0 * here + right;
    let offset = if bend < 0.0 {
        (0.5 * (left - right) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    Some(Tone {
        hz: (best as f64 + offset) * bin_hz,
        power: pooled[best],
    })
}

/// How each tile follows the tone of `hz`, which is taken out of the shifts; strip after strip for each band.
pub(super) fn take_out(shifts: &mut Shifts, hz: f64, bands: &[Range<usize>]) -> Vec<Tile> {
    let frames = shifts.frames;
    let turn = |&t: &f64| Complex64::cis((TAU * hz * t) % TAU);
    let frame_turns: Vec<Complex64> = shifts.starts_s.iter().map(turn).collect();
    let (mut cosine, mut sine): (Vec<f32>, Vec<f32>) = (shifts.within_s.iter())
        .map(turn)
        .flat_map(|group| frame_turns.iter().map(move |frame| frame * group))
        .map(|turn| (turn.re as f32, turn.im as f32))
        .unzip();
    // What was taken off the shifts is taken off the tone as well.
    for wave in [&mut cosine, &mut sine] {
        for wave in wave.chunks_exact_mut(frames) {
            level(wave, &shifts.starts_s);
        }
    }
    let mut tiles = Vec::with_capacity(bands.len() * shifts.columns.len());
    for band in bands {
        for strip in 0..shifts.columns.len() {
            let mut tile = Tile::default();
            let noise = shifts.noise[strip];
            for group in band.clone() {
                let span = group * frames..(group + 1) * frames;
                let waves = cosine[span.clone()].iter().zip(&sine[span.clone()]);
                let (mut cc, mut cs, mut ss, mut c, mut s) = (0.0, 0.0, 0.0, 0.0, 0.0);
                for ((&x, &y), &pull) in waves.zip(&shifts.pulls[strip][span]) {
                    cc += x * x;
                    cs += x * y;
                    ss += y * y;
                    c += x * pull;
                    s += y * pull;
                }
                let grip = shifts.grips[strip][group];
                if grip > 0.0 {
                    let share = 1.0 / noise;
                    let normal = [cc, cs, ss].map(|v| f64::from(v * grip) * share);
                    tile += Tile {
                        normal,
                        right: [c, s].map(|v| f64::from(v) * share),
                    };
                }
            }
            let [x, y] = tile.amplitude().unwrap_or_default().map(|v| v as f32);
            for group in band.clone() {
                let grip = shifts.grips[strip][group];
                let span = group * frames..(group + 1) * frames;
                let waves = cosine[span.clone()].iter().zip(&sine[span.clone()]);
                for (pull, (&c, &s)) in shifts.pulls[strip][span].iter_mut().zip(waves) {
                    *pull -= grip * (x * c + y * s);
                }
            }
            tiles.push(tile);
        }
    }
    tiles
}

fn total(grips: &[f32]) -> f64 {
    grips.iter().map(|&g| f64::from(g)).sum()
}

/// Takes the mean and the trend off.
fn level(series: &mut [f32], times: &[f64]) {
    let n = series.len() as f64;
    let middle = times.iter().sum::<f64>() / n;
    let (mut sum, mut along, mut power) = (0.0, 0.0, 0.0);
    for (&v, &t) in series.iter().zip(times) {
        sum += f64::from(v);
        along += f64::from(v) * (t - middle);
        power += (t - middle) * (t - middle);
    }
    let (mean, trend) = (sum / n, if power > 0.0 { along / power } else { 0.0 });
    for (v, &t) in series.iter_mut().zip(times) {
        *v -= (mean + trend * (t - middle)) as f32;
    }
}

/// Points of a spectrum: twice as many as there are samples, so that a tone between two is hardly weaker.
fn points(shifts: &Shifts) -> usize {
    let samples = (shifts.span_s() / shifts.step_s) as usize + 1;
    (2 * samples).next_power_of_two().min(POINTS)
}

/// Power of each strip's pulls against frequency, up to half the groups' rate.
fn spectra(shifts: &Shifts) -> Vec<Vec<f32>> {
    let n = points(shifts);
    let mut fourier = Fourier::forward(n);
    let times = shifts
        .within_s
        .iter()
        .flat_map(|group| shifts.starts_s.iter().map(move |frame| frame + group));
    let slots: Vec<usize> = times.map(|t| (t / shifts.step_s + 0.5) as usize).collect();
    let mut spectra = Vec::new();
    // Two strips at once: one as the real part, one as the imaginary.
    for pair in shifts.pulls.chunks(2) {
        let mut line = vec![Complex64::default(); n];
        let second = pair.last().filter(|_| pair.len() == 2);
        for (k, (&slot, &pull)) in slots.iter().zip(&pair[0]).enumerate() {
            if let Some(slot) = line.get_mut(slot) {
                let second = second.map_or(0.0, |second| second[k]);
                *slot += Complex64::new(f64::from(pull), f64::from(second));
            }
        }
        fourier.transform(&mut line);
        let half = |sign: f64| -> Vec<f32> {
            let mirrored = (0..n / 2).map(|k| line[(n - k) % n].conj());
            line.iter()
                .zip(mirrored)
                .map(|(a, b)| ((a + b * sign).norm_sqr() * 0.25) as f32)
                .collect()
        };
        spectra.push(half(1.0));
        if second.is_some() {
            spectra.push(half(-1.0));
        }
    }
    spectra
}
