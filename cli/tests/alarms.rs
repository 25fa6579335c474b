//! `rowtone analyze --alarms`: rules in a file, their state in every report.

mod common;

use common::{assert_failure, config, file, on_clip, reports, texts, y4m};

/// The clips' tone is 0.1 px at 133.3 Hz.
const RULES: &str = r#"
[[alarm]]
name = "tone"
quantity = "tone"
hz = 133.3
unit = "px"
warning = 0.08
trip = 0.2
delay = 2

[[alarm]]
name = "scaled"
quantity = "velocity"
warning = 0.1
"#;

#[test]
fn a_tone_above_its_limit_is_told_in_json_and_as_text() {
    let clip = file("alarms.y4m", &y4m(config(120)));
    let rules = file("alarms.toml", RULES.as_bytes());
    let with = ["--alarms", rules.to_str().unwrap(), "--hop", "0.25"];
    let output = on_clip(
        "analyze",
        &clip,
        &[&with[..], &["--format", "json"]].concat(),
    );
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    let reports = reports(&stdout);
    let levels: Vec<_> = reports
        .iter()
        .map(|r| r["alarm_level"].as_str().unwrap())
        .collect();
    assert_eq!(&levels[..3], ["normal", "warning", "warning"], "{stdout}");
    let tone = &reports[1]["alarms"][0];
    assert!(
        (tone["value"].as_f64().unwrap() - common::PX).abs() < 0.01,
        "{tone}"
    );
    assert_eq!(
        (&tone["name"], &tone["unit"]),
        (&"tone".into(), &"px".into())
    );
    let event = &reports[1]["alarm_events"][0];
    assert_eq!(
        (&event["event"], &event["to"]),
        (&"level".into(), &"warning".into())
    );
    // Without a scale no velocity is known: no evidence, and no alarm.
    let scaled = &reports[2]["alarms"][1];
    assert!(
        scaled["value"].is_null() && scaled["level"] == "normal",
        "{scaled}"
    );
    let (text, _) = texts(&on_clip("analyze", &clip, &with));
    let told: Vec<_> = text.lines().filter(|line| line.contains("alarm")).collect();
    assert_eq!(told.len(), 1, "{text}");
    assert!(told[0].contains("px, limit 0.0800 px)"), "{text}");
}

#[test]
fn rules_that_cannot_be_are_named_with_their_line() {
    let clip = file("alarms-bad.y4m", &y4m(config(10)));
    let rules = file("alarms-bad.toml", RULES.replace("0.2", "0.02").as_bytes());
    let output = on_clip("analyze", &clip, &["--alarms", rules.to_str().unwrap()]);
    assert_failure(
        &output,
        1,
        &["alarms-bad.toml:3: alarm tone: the warning must be below the trip"],
    );
}
