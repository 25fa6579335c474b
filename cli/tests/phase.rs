//! `rowtone analyze --reference`: phases between two parts of one picture.

mod common;

use common::{command, reports, texts};

/// The upper half moves by 0.2·sin(wt + 1.2), the lower one by 0.3·sin(wt) more: 0.4161 px at 0.4652 rad and 0.2 px at
/// 1.2 rad. A row's noise is a tenth of 0.2 px or less: 20 dB.
#[test]
fn the_phase_between_two_parts_is_right_within_a_degree() {
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let clip = dir.join("phase.y4m");
    let clip = clip.to_str().unwrap();
    let scene = [
        "simulate",
        "-o",
        clip,
        "--size",
        "96x240",
        "--line-time-us",
        "60",
        "--exposure-us",
        "300",
        "--seconds",
        "2",
        "--tone",
        "97.3:0.2:1.2",
        "--mode",
        "97.3:0.3@0,120,96,120",
        "--seed",
        "5",
    ];
    let made = command(scene).output().unwrap();
    assert!(made.status.success(), "{}", texts(&made).1);
    let analyze = |format| {
        let args = [
            "analyze",
            clip,
            "--line-time-us",
            "60",
            "--exposure-us",
            "300",
            "--roi",
            "0,130,96,110",
            "--reference",
            "0,0,96,110",
            "--format",
            format,
        ];
        let output = command(args).output().unwrap();
        let (stdout, stderr) = texts(&output);
        assert!(output.status.success(), "{stderr}");
        stdout
    };
    let (re, im) = (0.3 + 0.2 * 1.2_f64.cos(), 0.2 * 1.2_f64.sin());
    let (phase, ratio) = (im.atan2(re) - 1.2, re.hypot(im) / 0.2);
    let reports = reports(&analyze("json"));
    assert!(reports.len() >= 3);
    for report in &reports {
        let tone = &report["reference"][0];
        let of = |key: &str| {
            tone[key]
                .as_f64()
                .unwrap_or_else(|| panic!("{key}: {report}"))
        };
        let off = of("phase_rad") - phase;
        assert!(off.to_degrees().abs() < 1.0, "{off} rad: {tone}");
        // Six deviations: by chance in less than one of 10⁸ windows, were they normal.
        assert!(off.abs() < 6.0 * of("phase_rad_sd"), "{off} rad: {tone}");
        assert!((of("ratio") / ratio - 1.0).abs() < 0.01, "{tone}");
    }
    let text = analyze("text");
    assert!(
        text.contains("behind the reference along x, 2.08"),
        "{text}"
    );
}
