//! `rowtone trend`: what was kept, as CSV.

mod common;

use common::{assert_failure, command, texts};
use rowtone::report::Report;
use rowtone_trend::Trend;

#[test]
fn what_was_kept_comes_out_as_csv() {
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("trend");
    let _ = std::fs::remove_dir_all(&dir);
    let mut trend = Trend::open(&dir).unwrap();
    for n in 0..250 {
        let report = Report {
            um_per_px: Some(10.0),
            velocity_mm_s_rms: Some(2.5),
            ..Report::EMPTY
        };
        trend.push(&report, 500 * n).unwrap();
    }
    let said = |of| {
        let output = command(["trend", dir.to_str().unwrap(), "--of", of])
            .output()
            .unwrap();
        assert!(output.status.success());
        texts(&output).0
    };
    let heading =
        "unix_ms,windows,velocity_mm_s_rms,velocity_mm_s_rms_most,tone_hz,tone_px,warnings\n";
    let minutes = format!("{heading}59500,120,2.5,2.5,,,\n119500,120,2.5,2.5,,,\n");
    assert_eq!(said("minutes"), minutes);
    assert_eq!(said("windows").lines().count(), 251);
    assert_eq!(said("hours"), heading);
    let nowhere = command(["trend", "/nowhere"]).output().unwrap();
    assert_failure(&nowhere, 1, &["/nowhere: "]);
    let wrong = command(["trend", "/nowhere", "--of", "days"])
        .output()
        .unwrap();
    assert_eq!(wrong.status.code(), Some(2));
}
