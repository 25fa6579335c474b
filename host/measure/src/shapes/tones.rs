//! Which tones there are, and which of them can be told apart.

use rowtone::report::Warnings;

use super::Wanted;
use super::error::{Alike, Hidden, RecordingError, ShapesError};
use crate::MeasureError;
use crate::analysis::{Analysis, Event, Plan, Settings};
use crate::tracking::Shifts;
use rowtone_clip::{Camera, Feed};

/// A tone that is seen in fewer of the windows than this share is not followed.
const SEEN: f64 = 0.3;
/// Windows of a long recording in which tones are looked for.
const LOOKS: f64 = 8.0;
/// Tones whose distance from each other, and from each other's images, is less than this over the recording's length cannot be
/// told apart.
const APART: f64 = 1.5;
/// A tone this near a multiple of half the frame rate, over the recording's length, is not known.
const FROM_ZERO: f64 = 2.0;
/// Below this the exposure leaves too little of a tone.
const LEAST_GAIN: f64 = 0.2;
/// A tone of less than this share of another one that it cannot be told from is left out of it.
const BESIDE: f64 = 0.25;
/// Most tones fitted together.
const MOST: usize = 16;

/// A tone that `rowtone analyze` would report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Mean frequency over the windows, Hz.
    pub hz: f64,
    /// Mean amplitude, px.
    pub amplitude_px: f64,
}

/// What the first reading found.
#[derive(Debug)]
pub(super) struct Findings {
    tones: Vec<Found>,
    warnings: Warnings,
    notes: Vec<String>,
    nothing: Option<MeasureError>,
}

impl Findings {
    /// Tones that need not be looked for.
    pub(super) fn known(tones: Vec<Found>, notes: Vec<String>) -> Self {
        Self {
            nothing: None,
            warnings: Warnings::NONE,
            tones,
            notes,
        }
    }
}

/// Looks for tones, window by window, in [`LOOKS`] windows of the recording or in all that do not overlap: what a window
/// costs is most of what the shapes cost.
///
/// # Errors
/// [`ShapesError`] of the input.
pub(super) fn find(
    mut feed: Feed,
    wanted: &Wanted,
    step: &mut impl FnMut(),
) -> Result<Findings, ShapesError> {
    let seconds = feed
        .frames
        .map_or(0.0, |frames| frames as f64 / feed.camera.fps);
    let settings = Settings {
        window_s: wanted.window_s,
        hop_s: wanted.window_s.max(seconds / LOOKS),
        ..Settings::default()
    };
    let plan = Plan::new(&feed.camera, &settings)?;
    let notes = std::mem::take(&mut feed.notes);
    let shifts = Shifts::start(feed, Some(plan.groups()))?;
    let mut memory = plan.memory();
    let mut analysis = Analysis::new(shifts, &plan, &mut memory)?;
    let (mut peaks, mut windows, mut warnings) = (Vec::new(), 0u32, Warnings::NONE);
    analysis.run(|event| {
        match event {
            Event::Frame(_) => step(),
            Event::Report(report, _) => {
                windows += 1;
                warnings = warnings.union(report.warnings);
                let sure = report.peaks.iter().filter(|peak| !peak.ambiguous);
                peaks.extend(sure.map(|p| [p.hz, p.hz_sd, p.amplitude_px].map(f64::from)));
            }
            _ => {}
        }
        Ok::<(), ShapesError>(())
    })?;
    Ok(Findings {
        tones: merged(peaks, windows, wanted.window_s),
        warnings,
        notes,
        nothing: (windows == 0).then(|| analysis.nothing_measured()),
    })
}

/// Peaks of all windows, \[Hz, its deviation, px\], as tones: the largest first.
fn merged(mut peaks: Vec<[f64; 3]>, windows: u32, window_s: f64) -> Vec<Found> {
    peaks.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let same = |a: &[f64; 3], b: &[f64; 3]| b[0] - a[0] < 0.5 / window_s;
    let least = (SEEN * f64::from(windows)).ceil() as usize;
    let mut tones: Vec<Found> = peaks
        .chunk_by(same)
        .filter(|seen| seen.len() >= least)
        .map(|seen| {
            let weight = |p: &[f64; 3]| 1.0 / (p[1] * p[1]).max(1e-12);
            let all: f64 = seen.iter().map(weight).sum();
            Found {
                hz: seen.iter().map(|p| weight(p) * p[0]).sum::<f64>() / all,
                amplitude_px: seen.iter().map(|p| p[2]).sum::<f64>() / seen.len() as f64,
            }
        })
        .collect();
    tones.sort_by(|a, b| b.amplitude_px.total_cmp(&a.amplitude_px));
    tones
}

/// The tones that are fitted.
#[derive(Clone, Debug)]
pub(super) struct Tones {
    /// Those whose shapes are wanted.
    pub(super) wanted: Vec<f64>,
    /// Others that are there.
    others: Vec<f64>,
    /// What wanders slowly; the first is 0, what stands still.
    pub(super) slow: Vec<f64>,
    /// What the user should know.
    pub(super) notes: Vec<String>,
}

impl Tones {
    /// Those asked for, or all that were found; `seconds` is the recording's length.
    ///
    /// # Errors
    /// [`ShapesError`] where a frequency asked for cannot be told from another or is not known, and where nothing is left to
    /// measure.
    pub(super) fn choose(
        name: &str,
        wanted: &Wanted,
        found: Findings,
        camera: &Camera,
        seconds: f64,
    ) -> Result<Self, ShapesError> {
        let judge = Judge {
            fps: camera.fps,
            apart_hz: APART / seconds,
            hidden_hz: FROM_ZERO / seconds,
            exposure_s: f64::from(camera.timing.exposure_ns()) * 1e-9,
            global: camera.timing.is_global_shutter(),
        };
        let mut notes = found.notes;
        let warnings: Vec<&str> = found.warnings.names().collect();
        if !warnings.is_empty() {
            notes.push(format!("warnings: {}", warnings.join(", ")));
        }
        let chosen = if wanted.hz.is_empty() {
            if let Some(failure) = found.nothing {
                return Err(failure.into());
            }
            judge.tell_apart(name, &found.tones, wanted.most, &mut notes)?
        } else {
            judge.check(name, &wanted.hz, &found.tones)?;
            wanted.hz.clone()
        };
        let mut others: Vec<f64> = Vec::new();
        for tone in &found.tones {
            let known = |hz: &f64| judge.collide(*hz, tone.hz) || (hz - tone.hz).abs() < 1.0;
            let alone = !chosen.iter().any(known) && !others.iter().any(known);
            if alone && judge.hidden(tone.hz).is_none() && chosen.len() + others.len() < MOST {
                others.push(tone.hz);
            }
        }
        Ok(Self {
            wanted: chosen,
            others,
            slow: [0.0, 0.5, 1.0].map(|turns| turns / seconds).to_vec(),
            notes,
        })
    }

    /// All frequencies, Hz: the slow ones, those wanted, the others.
    pub(super) fn hz(&self) -> Vec<f64> {
        let all = self.slow.iter().chain(&self.wanted).chain(&self.others);
        all.copied().collect()
    }

    /// Where those wanted are among [`Tones::hz`].
    pub(super) fn wanted_at(&self) -> std::ops::Range<usize> {
        self.slow.len()..self.slow.len() + self.wanted.len()
    }

    /// Where all that are no slow ones are.
    pub(super) fn tones_at(&self) -> std::ops::Range<usize> {
        self.slow.len()..self.slow.len() + self.wanted.len() + self.others.len()
    }

    /// Sets all frequencies.
    pub(super) fn set(&mut self, hz: &[f64]) {
        let mut from = hz.iter().skip(self.slow.len());
        for hz in self.wanted.iter_mut().chain(&mut self.others) {
            if let Some(&better) = from.next() {
                *hz = better;
            }
        }
    }
}

/// What tells tones apart.
struct Judge {
    fps: f64,
    apart_hz: f64,
    hidden_hz: f64,
    exposure_s: f64,
    global: bool,
}

impl Judge {
    /// How far a frequency is from the nearest multiple of the frame rate, Hz.
    fn off_multiple(&self, hz: f64) -> f64 {
        (hz - (hz / self.fps).round() * self.fps).abs()
    }

    /// No row can tell these two apart.
    fn collide(&self, a: f64, b: f64) -> bool {
        self.off_multiple(a - b).min(self.off_multiple(a + b)) < self.apart_hz
    }

    /// Why a tone of `hz` cannot be measured.
    fn hidden(&self, hz: f64) -> Option<Hidden> {
        let (fps, exposure_s) = (self.fps, self.exposure_s);
        if self.global && hz > 0.5 * fps {
            return Some(Hidden::Global { hz, fps });
        }
        if self.off_multiple(2.0 * hz) < 2.0 * self.hidden_hz {
            return Some(Hidden::Still { hz, fps });
        }
        let gain = exposure_gain(hz, exposure_s).abs();
        (gain < LEAST_GAIN).then_some(Hidden::Exposure {
            hz,
            exposure_s,
            gain,
        })
    }

    /// Whether frequencies that were asked for can be had.
    fn check(&self, name: &str, hz: &[f64], found: &[Found]) -> Result<(), ShapesError> {
        for (k, &hz_k) in hz.iter().enumerate() {
            if let Some(why) = self.hidden(hz_k) {
                return Err(ShapesError::Hidden(why));
            }
            if let Some(&other) = hz[..k].iter().find(|&&other| self.collide(hz_k, other)) {
                return Err(ShapesError::Alike(self.alike(other, hz_k)));
            }
            // Both are there, and the sum of both would be shown.
            let is_it = |f: &&Found| (f.hz - hz_k).abs() < 1.0;
            let seen = found.iter().find(is_it);
            let beside = found.iter().find(|f| !is_it(f) && self.collide(f.hz, hz_k));
            if let (Some(seen), Some(beside)) = (seen, beside)
                && beside.amplitude_px > BESIDE * seen.amplitude_px
            {
                let both = RecordingError::Alike(self.alike(hz_k, beside.hz));
                return Err(ShapesError::recording(name, both));
            }
        }
        Ok(())
    }

    fn alike(&self, hz: f64, other_hz: f64) -> Alike {
        Alike {
            hz,
            other_hz,
            fps: self.fps,
        }
    }

    /// Of the tones found, those that can be measured.
    fn tell_apart(
        &self,
        name: &str,
        found: &[Found],
        most: usize,
        notes: &mut Vec<String>,
    ) -> Result<Vec<f64>, ShapesError> {
        let mut chosen: Vec<f64> = Vec::new();
        let mut refused: Vec<f64> = Vec::new();
        let mut last = None;
        for (k, tone) in found.iter().enumerate() {
            let alike = |f: &&Found| self.collide(f.hz, tone.hz);
            let why = if let Some(why) = self.hidden(tone.hz) {
                why.to_string()
            } else if let Some(stronger) = found[..k].iter().find(alike) {
                if tone.amplitude_px > BESIDE * stronger.amplitude_px {
                    refused.push(stronger.hz);
                }
                self.alike(stronger.hz, tone.hz).to_string()
            } else {
                chosen.push(tone.hz);
                continue;
            };
            notes.push(format!("left out: {why}"));
            last = Some(why);
        }
        chosen.retain(|hz| !refused.contains(hz));
        chosen.truncate(most);
        let why = match last {
            _ if !chosen.is_empty() => return Ok(chosen),
            Some(why) => RecordingError::LeftOut(why),
            None => RecordingError::NoTone,
        };
        Err(ShapesError::recording(name, why))
    }
}

/// By how much an exposure averages a tone: sin(πfT)/(πfT).
pub(super) fn exposure_gain(hz: f64, exposure_s: f64) -> f64 {
    let angle = std::f64::consts::PI * hz * exposure_s;
    if angle.abs() < 1e-6 {
        1.0
    } else {
        angle.sin() / angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge() -> Judge {
        Judge {
            fps: 60.0,
            apart_hz: 0.15,
            hidden_hz: 0.2,
            exposure_s: 1e-3,
            global: false,
        }
    }

    #[test]
    fn tones_a_multiple_of_the_frame_rate_apart_are_refused_together() {
        let judge = judge();
        for (a, b, alike) in [
            (131.7, 71.7, true),
            (131.7, 48.3, true),
            (131.7, 131.75, true),
            (131.7, 72.1, false),
            (131.7, 417.0, false),
        ] {
            assert_eq!(judge.check("clip", &[a, b], &[]).is_err(), alike, "{a} {b}");
        }
        let found = |b_px| {
            [(131.7, 0.05), (71.7, b_px)].map(|(hz, amplitude_px)| Found { hz, amplitude_px })
        };
        let mut notes = Vec::new();
        let chosen = judge.tell_apart("clip", &found(0.002), 8, &mut notes);
        assert_eq!((chosen.ok(), notes.len()), (Some(vec![131.7]), 1));
        let failure = judge
            .tell_apart("clip", &found(0.04), 8, &mut notes)
            .expect_err("both");
        assert!(
            failure.to_string().contains("cannot be told apart"),
            "{failure}"
        );
        assert!(judge.check("clip", &[131.7], &found(0.04)).is_err());
        assert!(judge.check("clip", &[131.7], &found(0.002)).is_ok());
    }

    #[test]
    fn what_every_frame_sees_alike_is_refused() {
        let judge = judge();
        for (hz, known) in [
            (120.1, false),
            (90.0, false),
            (119.0, true),
            (950.0, false),
            (17.0, true),
        ] {
            assert_eq!(judge.hidden(hz).is_none(), known, "{hz}");
        }
        let global = Judge {
            global: true,
            ..judge
        };
        assert!(global.hidden(31.0).is_some() && global.hidden(29.0).is_none());
    }

    #[test]
    fn peaks_of_several_windows_are_one_tone_and_a_stray_one_none() {
        let mut peaks: Vec<[f64; 3]> = (0..10)
            .map(|k| [131.7 + 0.001 * f64::from(k % 3), 0.002, 0.05])
            .collect();
        peaks.push([200.0, 0.1, 0.3]);
        peaks.extend([[50.0, 0.01, 0.2]; 4]);
        let tones = merged(peaks, 10, 1.0);
        assert_eq!(tones.len(), 2);
        assert!((tones[0].hz - 50.0).abs() < 1e-9 && (tones[1].hz - 131.701).abs() < 2e-3);
    }
}
