use rowtone::report::{Report, Warning, Warnings};

use super::{MOST_TONES, Summary};
use crate::example;

/// A window of 1 s that ends at 1 + seq/2 s and has these tones: Hz, px, track.
fn window(seq: u32, tones: &[(f32, f32, u16)]) -> Report {
    let mut report = example(None);
    report.seq = seq;
    report.time_ms = 1000 + 500 * u64::from(seq);
    report.warnings = Warnings::NONE;
    let peak = report.peaks[0];
    report.peaks = tones
        .iter()
        .map(|&(hz, amplitude_px, track)| {
            let mut peak = peak;
            (peak.hz, peak.amplitude_px, peak.track) = (hz, amplitude_px, track);
            peak
        })
        .collect();
    report
}

#[test]
fn what_persists_comes_first_however_small() {
    let mut summary = Summary::default();
    for seq in 0..5 {
        let mut tones = vec![(131.7, 0.01, 1)];
        if seq == 2 {
            tones.insert(0, (77.0, 0.5, 2));
        }
        summary.take(&window(seq, &tones));
    }
    let tones = summary.tones();
    let brief: Vec<_> = tones.iter().map(|t| (t.hz.round(), t.windows)).collect();
    assert_eq!(brief, [(132.0, 5), (77.0, 1)]);
    assert_eq!((tones[1].from_s, tones[1].to_s), (1.0, 2.0));
    let text = summary.text(None);
    assert!(text.contains("3.00 s, 5 windows"), "{text}");
    assert!(
        text.contains("in all 5 windows") && text.contains("in 1 of 5 windows, 1.00 to 2.00 s")
    );
}

#[test]
fn a_mean_knows_its_spread_and_that_windows_overlap() {
    let mut summary = Summary::default();
    let hz = [100.0, 100.002, 99.998, 100.001, 99.999_f32];
    for (seq, hz) in (0..).zip(hz) {
        summary.take(&window(seq, &[(hz, 0.1 + (hz - 100.0) * 5.0, 1)]));
    }
    let tone = summary.tones()[0];
    let spread = 0.002_5_f64.sqrt() * 1e-3_f64.sqrt();
    assert!((tone.hz - 100.0).abs() < 1e-5, "{tone:?}");
    // Deviations 0, 2, -2, 1, -1 mHz: √(10/4) mHz between windows.
    assert!((tone.hz_spread - spread).abs() < 2e-5, "{tone:?}");
    assert!((tone.amplitude_px_spread - 5.0 * spread).abs() < 1e-4);
    // Five windows of 1 s cover 3 s: as good as three.
    let three = spread / 3f64.sqrt();
    assert!((tone.hz_sd / three - 1.0).abs() < 0.02, "{tone:?}");
}

#[test]
fn two_tones_nearer_than_the_resolution_stay_two() {
    let mut summary = Summary::default();
    for seq in 0..4 {
        summary.take(&window(seq, &[(100.0, 0.2, 1), (100.4, 0.1, 2)]));
    }
    let found: Vec<_> = summary
        .tones()
        .iter()
        .map(|t| (t.windows, t.amplitude_px))
        .collect();
    assert_eq!(found.len(), 2);
    assert!(found.iter().all(|(windows, _)| *windows == 4), "{found:?}");
    assert!((found[0].1 - 0.2).abs() < 1e-6 && (found[1].1 - 0.1).abs() < 1e-6);
}

#[test]
fn a_tone_that_is_lost_and_found_is_one_and_a_run_up_too() {
    let mut summary = Summary::default();
    for seq in 0..12 {
        // The run-up keeps its track; the other was given a new number after a gap.
        let mut tones = vec![(60.0 + 1.5 * seq as f32, 0.2, 1)];
        if !(3..9).contains(&seq) {
            tones.push((210.0, 0.1, if seq < 3 { 2 } else { 3 }));
        }
        summary.take(&window(seq, &tones));
    }
    let found: Vec<_> = summary.tones().iter().map(|t| t.windows).collect();
    assert_eq!(found, [12, 6]);
}

#[test]
fn doubt_is_counted_and_sinks() {
    let mut summary = Summary::default();
    for seq in 0..4 {
        let mut report = window(seq, &[(300.0, 0.2, 1), (50.0, 0.1, 2)]);
        report.peaks[0].ambiguous = seq != 1;
        report.warnings.insert_if(seq == 3, Warning::Occluded);
        summary.take(&report);
    }
    let tones = summary.tones();
    assert_eq!(tones[0].ambiguous_windows, 0);
    assert_eq!((tones[1].windows, tones[1].ambiguous_windows), (4, 3));
    assert!(tones[1].doubtful());
    let text = summary.text(None);
    assert!(
        text.contains("ambiguous in 3") && text.contains("passed through"),
        "{text}"
    );
}

#[test]
fn the_object_is_told_from_a_window_and_the_page_names_its_keys() {
    let page = include_str!("../../../../docs/json.md");
    let mut summary = Summary::default();
    let mut report = example(Some(10.0));
    report.peaks[0].harmonic = Some(1);
    summary.take(&report);
    let limits = "0.5,2.8,7.1".parse().unwrap();
    let json = summary.json(Some(&limits));
    let object: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(object["summary"], true);
    assert_eq!(object["zone"], "B");
    let peak = &object["peaks"][0];
    assert_eq!(peak["amplitude_um"], 3.998);
    let keys = object
        .as_object()
        .unwrap()
        .keys()
        .chain(peak.as_object().unwrap().keys());
    for key in keys {
        assert!(
            page.contains(&format!("`{key}`")),
            "{key} is not on the page"
        );
    }
}

#[test]
fn nothing_measured_and_nonsense_are_taken_without_a_fuss() {
    let empty = Summary::default();
    assert!(empty.text(None).contains("no vibration"));
    assert!(serde_json::from_str::<serde_json::Value>(&empty.json(None)).is_ok());
    let mut summary = Summary::default();
    for seq in 0..400 {
        let mut report = window(
            seq,
            &[(f32::NAN, f32::INFINITY, 1), (3.0 * seq as f32, 0.1, 2)],
        );
        report.window_s = [0.0, f32::NAN, 1.0][seq as usize % 3];
        summary.take(&report);
    }
    assert!(summary.tones().len() <= MOST_TONES);
    assert!(serde_json::from_str::<serde_json::Value>(&summary.json(None)).is_ok());
    assert!(!summary.text(None).is_empty());
}
