extern crate std;
use super::super::ReportSide;
use super::*;
use crate::camera::Timing;
use crate::report::Report;
use crate::spectrum::StaticStorage;
use std::boxed::Box;
use std::vec::Vec;

/// The reports of `frames` frames at 60 fps whose starts are `early_ns(frame)` too early.
fn reports(frames: u32, early_ns: fn(u32) -> i64) -> Vec<Report> {
    let group = Group::new(Timing::new(1_000_000_000, 0, 8).unwrap(), 2).unwrap();
    let mut storage = Box::new(StaticStorage::<1024, 128, 8, 2048, 4>::new());
    let config = Config::default();
    let mut report_side = ReportSide::new(config, group, storage.lend()).unwrap();
    let mut reports = Vec::new();
    for frame in 0..frames {
        let start_ns = i64::from(frame) * 1_000_000_000 / 60 - early_ns(frame);
        for slot in 0..group.slots() {
            let complete = report_side.push(Sample {
                frame,
                slot,
                curvature: Curvature::default(),
                time_ns: start_ns + group.middle_ns(slot),
                shift_px: 0.01 * ((frame * 7 + u32::from(slot) * 3) % 11) as f32,
                information_per_px2: 1e4,
                spread: Spread::default(),
                vertical: None,
            });
            if complete {
                reports.extend(report_side.report());
            }
        }
    }
    reports.extend(report_side.finish());
    reports
}

#[test]
fn a_second_holds_sixty_frames_whatever_their_starts_round_to() {
    let early: [fn(u32) -> i64; 5] = [
        |_| 0,
        |frame| i64::from(frame),
        |frame| -i64::from(frame),
        |frame| i64::from(frame % 3) * 2000,
        |frame| i64::from(frame == 60) * 2000,
    ];
    for (case, early_ns) in early.into_iter().enumerate() {
        let long = reports(121, early_ns);
        assert!(long.len() >= 3, "{}", long.len());
        for report in long {
            assert_eq!(report.lines, 60 * 8, "case {case}, window {}", report.seq);
        }
        assert_eq!(reports(60, early_ns)[0].lines, 60 * 8, "case {case}");
    }
}
/// The windows of a second, two a second, that warn of a hand which covered all of frames 75 to 94: those that saw it,
/// though no sample of these frames came.
#[test]
fn frames_without_samples_are_told_of_by_every_window_over_them() {
    let group = Group::new(Timing::new(1_000_000_000, 0, 8).unwrap(), 2).unwrap();
    let mut storage = Box::new(StaticStorage::<1024, 128, 8, 2048, 4>::new());
    let mut reports = ReportSide::new(Config::default(), group, storage.lend()).unwrap();
    let mut occluded = Vec::new();
    for frame in 0..241 {
        let covered = (75..95).contains(&frame);
        let start_ns = i64::from(frame) * 1_000_000_000 / 60;
        for slot in 0..group.slots() {
            let sample = Sample {
                frame,
                slot,
                curvature: Curvature::default(),
                time_ns: start_ns + group.middle_ns(slot),
                shift_px: 0.01 * ((frame * 7 + u32::from(slot) * 3) % 11) as f32,
                information_per_px2: 1e4,
                spread: Spread::default(),
                vertical: None,
            };
            let last = slot + 1 == group.slots();
            let tally = Tally {
                frames: last.into(),
                rows: if last { 8 } else { 0 },
                occluded: if last && covered { 8 } else { 0 },
                ..Tally::NONE
            };
            let reading = Reading {
                sample: (!covered).then_some(sample),
                tally,
                frame,
            };
            if reports.push(reading) {
                occluded.extend(reports.report());
            }
        }
    }
    assert!(occluded.iter().all(|r| r.lost_frames == 0));
    let said = occluded
        .iter()
        .map(|r| (r.time_ms, r.warnings.contains(Warning::Occluded)));
    let said: Vec<_> = said.collect();
    // Frames 75 to 94 are from 1.25 s to 1.58 s; the third window begins at 1 s, the fourth at 1.5 s.
    let expected = [
        (1000, false),
        (1500, true),
        (2000, true),
        (2500, true),
        (3000, false),
    ];
    assert_eq!(said[..5], expected);
}
