//! The reports's answer beside the truth.

use rowtone::pipeline::ReportSide;
use rowtone::report::{Peak, Report};
use rowtone::spectrum::Config;

use super::scene::{Ranges, Scene, TrueTone, Truth};
use rowtone_memory::SpectrumMemory;

/// A tone whose frequency or amplitude is so many bounds off has gone wrong.
const FAR_OFF: f64 = 4.0;

/// Counts and errors of many scenes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// Scenes.
    pub scenes: usize,
    /// True tones.
    pub tones: usize,
    /// Those found within half of 1/window.
    pub found: usize,
    /// Scenes with a peak that is no tone.
    pub scenes_with_false: usize,
    /// Peaks that are no tone.
    pub false_peaks: usize,
    /// Those of them a multiple of the frame rate away from a tone.
    pub ghosts: usize,
    /// What went wrong, in words, a line a scene.
    pub failures: Vec<String>,
    hz_over_bound: f64,
    amplitude_over_bound: f64,
    hz_over_sd: f64,
    amplitude_over_sd: f64,
}

impl Score {
    /// Draws and scores `count` scenes.
    pub fn of(ranges: &Ranges, seed: u64, count: u64) -> Self {
        let mut score = Self::default();
        for number in 0..count {
            let scene = Scene::draw(ranges, seed, number);
            score.add(number, &scene.truth, &analyze(&scene));
        }
        score
    }

    /// Adds the report of scene `number`.
    pub fn add(&mut self, number: u64, scene: &Truth, report: &Report) {
        let (found, strays) = (self.found, self.false_peaks);
        let furthest = self.count(scene, report);
        let missed = self.found - found < scene.tones.len();
        if missed || self.false_peaks > strays || furthest > FAR_OFF {
            let what = describe(number, scene, report);
            self.failures
                .push(format!("{what}; at most {furthest:.1} bounds off"));
        }
    }

    /// Gives how far off the tones are at most, in bounds.
    fn count(&mut self, scene: &Truth, report: &Report) -> f64 {
        let mut furthest: f64 = 0.0;
        self.scenes += 1;
        self.tones += scene.tones.len();
        let reach = 0.5 / scene.window_s;
        let mut matched = vec![false; report.peaks.len()];
        for tone in &scene.tones {
            let near = |p: &Peak| (f64::from(p.hz) - tone.hz).abs();
            let nearest = report
                .peaks
                .iter()
                .enumerate()
                .filter(|(i, p)| !matched[*i] && near(p) < reach)
                .min_by(|a, b| near(a.1).total_cmp(&near(b.1)));
            let Some((i, peak)) = nearest else { continue };
            matched[i] = true;
            self.found += 1;
            let hz = f64::from(peak.hz) - tone.hz;
            let amplitude = f64::from(peak.amplitude_px) - tone.amplitude_px;
            self.hz_over_bound += (hz / tone.hz_bound).powi(2);
            self.amplitude_over_bound += (amplitude / tone.amplitude_bound_px).powi(2);
            self.hz_over_sd += (hz / f64::from(peak.hz_sd)).powi(2);
            self.amplitude_over_sd += (amplitude / f64::from(peak.amplitude_px_sd)).powi(2);
            let off = [hz / tone.hz_bound, amplitude / tone.amplitude_bound_px];
            furthest = furthest.max(off[0].abs()).max(off[1].abs());
        }
        let strays: Vec<f64> = report
            .peaks
            .iter()
            .zip(&matched)
            .filter(|(_, m)| !**m)
            .map(|(p, _)| f64::from(p.hz))
            .collect();
        self.false_peaks += strays.len();
        self.scenes_with_false += usize::from(!strays.is_empty());
        for hz in strays {
            let ghost = scene.tones.iter().any(|tone| {
                let k = (hz - tone.hz) / scene.fps;
                (k - k.round()).abs() * scene.fps < 2.0 * reach && k.round() != 0.0
            });
            self.ghosts += usize::from(ghost);
        }
        furthest
    }

    /// Share of the tones found.
    pub fn found_share(&self) -> f64 {
        self.found as f64 / self.tones.max(1) as f64
    }

    /// Share of the scenes with a peak that is no tone.
    pub fn false_share(&self) -> f64 {
        self.scenes_with_false as f64 / self.scenes.max(1) as f64
    }

    /// Errors of found tones, rms: frequency and amplitude over their bounds, then over their stated deviations.
    pub fn errors(&self) -> [f64; 4] {
        let n = self.found.max(1) as f64;
        [
            self.hz_over_bound,
            self.amplitude_over_bound,
            self.hz_over_sd,
            self.amplitude_over_sd,
        ]
        .map(|sum| (sum / n).sqrt())
    }
}

/// A scene and what was made of it.
fn describe(number: u64, scene: &Truth, report: &Report) -> String {
    let tone = |t: &TrueTone| {
        let over = t.amplitude_px / t.amplitude_bound_px;
        format!("{:.3} Hz {:.5} px ({over:.0})", t.hz, t.amplitude_px)
    };
    let peak = |p: &Peak| format!("{:.3} Hz {:.5} px", p.hz, p.amplitude_px);
    let list = |items: Vec<String>| items.join(", ");
    format!(
        "scene {number}, {:.2} fps, {:.2} s; true: {}; found: {}",
        scene.fps,
        scene.window_s,
        list(scene.tones.iter().map(tone).collect()),
        list(report.peaks.iter().map(peak).collect()),
    )
}

/// The report of a scene's only window.
///
/// # Panics
/// When the scene has no samples.
pub fn analyze(scene: &Scene) -> Report {
    let config = Config {
        window_ns: (scene.truth.window_s * 2e9) as i64,
        ..Config::default()
    };
    let mut memory = SpectrumMemory::new(scene.group, scene.truth.window_s, scene.truth.fps);
    let mut reports =
        ReportSide::new(config, scene.group, memory.lend()).expect("the memory fits the scene");
    for sample in &scene.samples {
        reports.push(*sample);
    }
    reports.finish().expect("a scene has samples")
}
