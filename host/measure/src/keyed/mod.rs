//! What an encoder took, and how key frames give it back.
//!
//! A codec that predicts frames from each other throws small motion away and dribbles it back later: all frames read
//! tones too small, and others that are not there. Key frames are coded afresh. So a recording is looked at whole: its
//! rows of key frames, against a reference learned from key frames alone, say which tones there are and how large; all
//! frames only propose frequencies and tell images at multiples of the key frames' rate apart. Then each
//! window's report gets those tones, its amplitudes fitted to the key frames that lie in it, and what key frames
//! neither confirm nor refute is marked as ambiguous.

mod data;
mod fit;
mod search;

use rowtone::report::{MAX_PEAKS, Motion, Peak, PeakShape, Report, Warning};
use rowtone::spectrum::name_harmonics;
use rowtone::timeline::{Group, Sample};
use rowtone_linear::Symmetric;

use self::data::{Data, Datum};
use self::fit::{Orbit, take_means};
use self::search::{Found, Hint, Tone};

/// Fewer key frames tell nothing.
const LEAST_KEYS: usize = 3;
/// A motion as large as this no encoder can leave out, px.
const PLAIN_PX: f32 = 0.5;
/// In a window a tone is told of where it stands out by so many standard deviations.
const SEEN_SD: f64 = 3.0;
/// A tone of all frames that key frames see smaller by so many standard deviations is refuted.
const REFUTED_SD: f64 = 4.0;
/// An error of the key frames themselves, as a share of the amplitude.
const OWN_ERROR: f64 = 0.005;

/// Reports of a compressed recording, held back until its key frames have been looked at.
#[derive(Debug, Default)]
pub(crate) struct Held {
    reports: Vec<(Report, Vec<PeakShape>)>,
    /// Start of the first frame, ns.
    origin_ns: Option<i64>,
}

impl Held {
    pub(crate) fn note_frame(&mut self, start_ns: i64) {
        self.origin_ns.get_or_insert(start_ns);
    }

    pub(crate) fn push(&mut self, report: Report, shapes: Vec<PeakShape>) {
        self.reports.push((report, shapes));
    }

    /// The reports as the key frames have them.
    pub(crate) fn judged(
        self,
        keys: &[Sample],
        group: Group,
        band_hz: (f64, f64),
    ) -> Vec<(Report, Vec<PeakShape>)> {
        let mut reports = self.reports;
        let largest = reports.iter().flat_map(|(report, _)| &report.peaks);
        let largest = largest.map(|peak| peak.amplitude_px).fold(0.0, f32::max);
        let data = Data::new(keys, group, self.origin_ns.unwrap_or(0));
        // One sample a frame tells no frequency from its images.
        let at_once = group.timing().is_global_shutter();
        let found = (data.frames >= LEAST_KEYS && largest < PLAIN_PX && !at_once)
            .then(|| search::search(&data, &hints(&reports), band_hz))
            .flatten();
        match found {
            Some(found) => {
                let judge = Judge::new(&data, &found, group);
                reports.iter_mut().for_each(|(report, shapes)| {
                    judge.rewrite(report);
                    shapes.clear();
                });
            }
            // Nothing is confirmed but what is too large to be left out.
            None => {
                let peaks = reports.iter_mut().flat_map(|(report, _)| &mut report.peaks);
                let unsure = peaks.filter(|peak| peak.amplitude_px < PLAIN_PX);
                if largest < PLAIN_PX {
                    unsure.for_each(|peak| peak.ambiguous = true);
                }
            }
        }
        reports
    }
}

/// The tones that all frames show: peaks of the windows, those of one frequency together.
fn hints(reports: &[(Report, Vec<PeakShape>)]) -> Vec<Hint> {
    let mut groups: Vec<Vec<Hint>> = Vec::new();
    for (report, _) in reports {
        let near_hz = 0.7 / f64::from(report.window_s.max(1e-3));
        for peak in &report.peaks {
            let hint = Hint {
                hz: peak.hz.into(),
                px: peak.amplitude_px.into(),
            };
            let near = |group: &Vec<Hint>| (mean(group).hz - hint.hz).abs() < near_hz;
            match groups.iter_mut().find(|group| near(group)) {
                Some(group) => group.push(hint),
                None => groups.push(vec![hint]),
            }
        }
    }
    let windows = reports.len().max(1) as f64;
    let mut hints: Vec<Hint> = groups
        .iter()
        .map(|group| {
            let all = mean(group);
            // Where a window does not show it, it is nothing.
            let px = all.px * group.len() as f64 / windows;
            Hint { px, ..all }
        })
        .collect();
    hints.sort_by(|a, b| b.px.total_cmp(&a.px));
    hints.truncate(3 * MAX_PEAKS);
    hints
}

/// Mean frequency, weighted by amplitude, and mean amplitude.
fn mean(group: &[Hint]) -> Hint {
    let px: f64 = group.iter().map(|hint| hint.px).sum();
    let hz: f64 = group.iter().map(|hint| hint.px * hint.hz).sum();
    Hint {
        hz: hz / px.max(1e-12),
        px: px / group.len().max(1) as f64,
    }
}

/// Refits the tones in each window.
struct Judge<'a> {
    data: &'a Data,
    found: &'a Found,
    group: Group,
    /// Each datum without its place's mean, which is the whole recording's.
    level: Vec<f64>,
}

impl<'a> Judge<'a> {
    fn new(data: &'a Data, found: &'a Found, group: Group) -> Self {
        let mut means: Vec<f64> = data.all.iter().map(|datum| datum.px).collect();
        let px = means.clone();
        // The mean of what the tones leave: data − model, whose mean over a place is that of the place.
        for (mean, datum) in means.iter_mut().zip(&data.all) {
            *mean -= found
                .tones
                .iter()
                .map(|tone| said(datum, tone.hz, &tone.orbit))
                .sum::<f64>();
        }
        let left = means.clone();
        take_means(data, &mut means);
        let level = px
            .iter()
            .zip(&left)
            .zip(&means)
            .map(|((px, left), off)| px - (left - off));
        Self {
            data,
            found,
            group,
            level: level.collect(),
        }
    }

    /// The key frames of a window, or the nearest one.
    fn frames(&self, from_s: f64, to_s: f64) -> std::ops::Range<usize> {
        let starts = &self.data.starts_s;
        let first = starts.partition_point(|&t| t < from_s - 1e-6);
        let end = starts.partition_point(|&t| t < to_s - 1e-6);
        if first < end {
            return first..end;
        }
        let middle = 0.5 * (from_s + to_s);
        let away = |k: &usize| (starts[*k] - middle).abs();
        let nearest = (0..starts.len()).min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map_or(0..0, |k| k..k + 1)
    }

    /// The orbits of these tones in these key frames.
    fn fit(&self, frames: &std::ops::Range<usize>, tones: &[Tone]) -> Option<Vec<Orbit>> {
        let each = if self.data.planar { 4 } else { 2 };
        let n = each * tones.len();
        let (mut normal, mut right) = (Symmetric::zeros(n), vec![0.0; n]);
        // Within what the whole recording says, give or take all of it: where few rows tell tones apart.
        for (k, tone) in tones.iter().enumerate() {
            let (px, sd) = tone.orbit.amplitude();
            let before = 1.0 / (px * px + sd * sd).max(1e-12);
            for i in 0..each {
                normal.add(k * each + i, k * each + i, before);
                right[k * each + i] += before * tone.orbit.px[i];
            }
        }
        let data = self.data.all.iter().zip(&self.level);
        for (datum, px) in data.filter(|(datum, _)| frames.contains(&datum.frame)) {
            let weight = datum.weight / self.found.scatter[datum.axis];
            let row: Vec<f64> = tones
                .iter()
                .flat_map(|tone| design(datum, tone.hz).into_iter().take(each))
                .collect();
            normal.add_outer(&row, weight);
            right
                .iter_mut()
                .zip(&row)
                .for_each(|(right, d)| *right += weight * px * d);
        }
        let factor = normal.factor()?;
        let solved = factor.solve(&right);
        let orbit = |k: usize| {
            let mut orbit = Orbit::default();
            for i in 0..each {
                orbit.px[i] = solved[k * each + i];
                let column = factor.inverse_column(k * each + i);
                orbit.covariance[i][..each].copy_from_slice(&column[k * each..(k + 1) * each]);
            }
            orbit
        };
        Some((0..tones.len()).map(orbit).collect())
    }

    /// A report with the amplitudes of the key frames.
    fn rewrite(&self, report: &mut Report) {
        let to_s = report.time_ms as f64 * 1e-3;
        let frames = self.frames(to_s - f64::from(report.window_s), to_s);
        let Some(orbits) = self.fit(&frames, &self.found.tones) else {
            return;
        };
        let resolution_hz = 1.0 / f64::from(report.window_s.max(1e-3));
        let others: Vec<Peak> = report
            .peaks
            .iter()
            .filter(|peak| {
                let near = |tone: &Tone| (tone.hz - f64::from(peak.hz)).abs() < resolution_hz;
                !self.found.tones.iter().any(near) && !self.refutes(&frames, peak)
            })
            .copied()
            .collect();
        report.peaks.clear();
        for (track, (tone, orbit)) in (1..).zip(self.found.tones.iter().zip(&orbits)) {
            let (px, sd) = orbit.amplitude();
            if px > SEEN_SD * sd {
                // There is room: fewer tones than peaks are searched for.
                let _ = report.peaks.push(self.peak(tone, orbit, track));
            }
        }
        let confirmed = others.is_empty() && !self.found.tones.is_empty();
        for peak in others {
            let _ = report.peaks.push(Peak {
                ambiguous: true,
                ..peak
            });
        }
        report
            .peaks
            .sort_unstable_by(|a, b| b.amplitude_px.total_cmp(&a.amplitude_px));
        name_harmonics(&mut report.peaks, resolution_hz as f32);
        if confirmed {
            report.warnings.remove(Warning::Compressed);
        }
        // What all frames say of the time base, of wandering and of what is left, is the codec's.
        for warning in [
            Warning::TimingContradiction,
            Warning::MoreTones,
            Warning::CameraMoves,
            Warning::HiddenNearFrameRate,
        ] {
            report.warnings.remove(warning);
        }
        report.line_time_us_fit = None;
        report.noise_px = self.row_noise_px();
    }

    /// Key frames of the window see a tone of all frames much smaller, or not at all.
    fn refutes(&self, frames: &std::ops::Range<usize>, peak: &Peak) -> bool {
        // At a multiple of their rate a tone stands still in key frames, as if it were each row's own place.
        let (hz, rate_hz) = (f64::from(peak.hz), self.data.rate_hz());
        let away_hz = (hz - (hz / rate_hz).round() * rate_hz).abs();
        if away_hz < 1.0 / self.data.span_s().max(1e-9) {
            return false;
        }
        let mut tones = self.found.tones.clone();
        let mut orbit = Orbit::default();
        orbit.px[0] = peak.amplitude_px.into();
        tones.push(Tone {
            hz: peak.hz.into(),
            orbit,
            ambiguous: true,
        });
        let Some(orbits) = self.fit(frames, &tones) else {
            return false;
        };
        let (px, sd) = orbits.last().map_or((0.0, f64::INFINITY), Orbit::amplitude);
        px + REFUTED_SD * sd < f64::from(peak.amplitude_px)
    }

    fn peak(&self, tone: &Tone, orbit: &Orbit, track: u16) -> Peak {
        // As `Group::attenuation`: below 0 where the exposure is longer than a period.
        let hz = tone.hz as f32;
        let seen = f64::from(self.group.attenuation(hz).max(0.05));
        let turned = self.group.exposed(hz) < 0.0;
        let (px, sd) = orbit.amplitude();
        let sd = sd.hypot(OWN_ERROR * px);
        let (whole_px, whole_sd) = tone.orbit.amplitude();
        // √12/2π·sd/(A·T), the bound of a frequency from samples spread evenly.
        let hz_sd = 0.55 * whole_sd / (whole_px * self.data.span_s()).max(1e-9);
        let (x, x_sd, phase) = orbit.along(0);
        let (y, y_sd, y_phase) = orbit.along(1);
        let half_turn = |phase: f64| match turned {
            true if phase > 0.0 => phase - std::f64::consts::PI,
            true => phase + std::f64::consts::PI,
            false => phase,
        };
        let of = |px: f64| (px / seen) as f32;
        let planar = self.data.planar;
        Peak {
            hz,
            hz_sd: hz_sd as f32,
            amplitude_px: of(px),
            amplitude_px_sd: of(sd),
            snr_db: (10.0 * (0.5 * (px / sd).powi(2)).max(1e-3).log10()) as f32,
            ambiguous: tone.ambiguous,
            track,
            harmonic: None,
            motion: Some(Motion {
                x_px: Some(of(x)),
                x_px_sd: Some(of(x_sd)),
                y_px: planar.then(|| of(y)),
                y_px_sd: planar.then(|| of(y_sd)),
                phase_rad: half_turn(phase) as f32,
                y_phase_rad: planar.then(|| half_turn(y_phase) as f32),
                ..Motion::STEADY
            }),
        }
    }

    /// Standard deviation of a row of a key frame along x, px.
    fn row_noise_px(&self) -> f32 {
        let of_x = self.data.all.iter().filter(|datum| datum.axis == 0);
        let (sum, n) = of_x.fold((0.0, 0.0), |(sum, n), datum| (sum + datum.weight, n + 1.0));
        let rows = f64::from(self.group.rows_per_sample());
        let variance = self.found.scatter[0] * n / f64::max(sum, 1e-9) * rows;
        variance.sqrt() as f32
    }
}

/// What a datum shows of a tone for each of its four amplitudes.
fn design(datum: &Datum, hz: f64) -> [f64; 4] {
    let (sin, cos) = (std::f64::consts::TAU * (hz * datum.t_s).fract()).sin_cos();
    match datum.axis {
        0 => [cos, sin, datum.coupling * cos, datum.coupling * sin],
        _ => [0.0, 0.0, cos, sin],
    }
}

fn said(datum: &Datum, hz: f64, orbit: &Orbit) -> f64 {
    let design = design(datum, hz);
    design.iter().zip(&orbit.px).map(|(d, px)| d * px).sum()
}

#[cfg(test)]
mod tests;
