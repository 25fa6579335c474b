//! The line engine's table of figures, on a smaller grid than `rowtone sweep lines` prints, kept as it is.
//!
//! A changed digit is a changed engine: look at it with the full table, then keep the new one. The digits are
//! few, so that another machine's rounding does not show.

use rowtone_lab::line_scenes::case::{Case, hard, long_exposure, small_motion};
use rowtone_lab::line_scenes::measure::measure;

/// Presets with a long and a short line time, every scene.
fn small() -> Vec<Case> {
    let mut cases = small_motion(11, 16, 10);
    cases.retain(|c| ["ov5647", "imx708", "hm01b0"].contains(&c.name.split(' ').next().unwrap()));
    cases
}

/// Large and fast motion, and a hand, on half of the picture's columns and 0.4 s.
fn large() -> Vec<Case> {
    let wanted = [
        "1003 Hz +",
        "50.3 Hz, stripes",
        "12 px stripes",
        "30 px",
        "hand",
    ];
    let mut cases = hard(11);
    cases.retain(|c| wanted.iter().any(|wanted| c.name.contains(wanted)));
    for case in &mut cases {
        case.config.sensor.cols = 128;
        if !case.name.contains("hand") {
            case.config.frames = 44;
        }
        case.peaks = false;
    }
    cases
}

/// Exposed while the picture moves by several pixels, the same.
fn exposed() -> Vec<Case> {
    let wanted = ["0.5 ms: 4 px at 463 Hz", "1 ms: 4 px at 301.7 Hz"];
    let mut cases = long_exposure(11);
    cases.retain(|c| wanted.iter().any(|wanted| c.name.contains(wanted)));
    for case in &mut cases {
        case.config.sensor.cols = 128;
        case.config.frames = 84;
        case.peaks = false;
    }
    cases
}

#[test]
fn the_small_table_is_as_it_was() {
    let mut table = String::new();
    for case in small().iter().chain(&large()).chain(&exposed()) {
        let f = measure(case).expect("a case that can be measured");
        table += &format!(
            "{:<32} {:>4.1} of the bound, amplitude {:+.0} %, {:.0} % blank, {:.0} % disturbed\n",
            case.name,
            f.to_bound,
            // No sign of nothing.
            (100.0 * f.amplitude_error).round() + 0.0,
            100.0 * f.no_texture,
            100.0 * f.disturbed,
        );
    }
    assert_eq!(table, include_str!("line_sweep.txt"), "now:\n{table}");
}

/// 8 px peak to peak on stripes of 10 px: more than the motion tells which stripe it is, sometimes.
#[test]
fn stripes_are_read_right_or_it_is_told() {
    let (mut right, mut told) = (0, 0);
    for seed in [1, 81, 83] {
        let mut cases = hard(seed);
        cases.retain(|c| c.name.contains("10 px stripes"));
        for case in &cases {
            let f = measure(case).expect("a case that can be measured");
            let is_right = f.amplitude_error.abs() < 0.01 && f.invented.is_some_and(|i| i < 0.01);
            assert!(is_right || f.slips_told, "{seed}: {f:?}");
            right += u32::from(is_right && !f.slips_told);
            told += u32::from(f.slips_told);
        }
    }
    assert!(right > 0 && told > 0, "{right} right, {told} told");
}
