//! Alarms of boards' machines, over a real broker.

use std::io::Write;
use std::time::Duration;

use crate::board::line;
use crate::broker::{Broker, publish, subscribe};
use crate::{JSON, config, dir, ports, run};

/// The board's tones have 0.4 px.
const RULES: &str = r#"
[[alarm]]
name = "tone"
quantity = "tone"
hz = 49.2
unit = "px"
warning = 0.3
delay = 2
latch = true
"#;

/// Each change is said, acknowledged by a message, and kept by the broker for whoever comes later.
#[test]
fn an_alarm_is_told_and_acknowledged() {
    let dir = dir("alarm");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (client, heard) = subscribe(broker.port, "plant/b0/alarm");
    let next = || -> serde_json::Value {
        let (_, payload) = heard
            .recv_timeout(Duration::from_secs(20))
            .expect("a message");
        serde_json::from_slice(&payload).unwrap()
    };
    let (mut masters, _slaves, names) = ports(1);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let rules = dir.join("rules.toml");
    std::fs::write(&rules, RULES).unwrap();
    let text = std::fs::read_to_string(&config).unwrap();
    std::fs::write(&config, format!("{text}alarms = {rules:?}\n")).unwrap();
    let gateway = run(&config, &[]);
    masters[0].write_all(&line(0)).unwrap();
    assert_eq!(next()["alarm_level"], "normal");
    masters[0].write_all(&line(1)).unwrap();
    let said = next();
    assert_eq!(said["board"], "b0");
    let alarm = &said["alarms"][0];
    assert_eq!(
        (&alarm["name"], &alarm["level"]),
        (&"tone".into(), &"warning".into())
    );
    assert_eq!(said["alarm_events"][0]["to"], "warning");
    publish(broker.port, "plant/b0/alarm/acknowledge", b"tone");
    let said = next();
    assert_eq!(said["alarm_events"][0]["event"], "acknowledged");
    assert_eq!(said["alarms"][0]["acknowledged"], true);
    drop(client);

    let (_client, heard) = subscribe(broker.port, "plant/b0/alarm");
    let (_, kept) = heard.recv_timeout(Duration::from_secs(20)).expect("kept");
    let kept: serde_json::Value = serde_json::from_slice(&kept).unwrap();
    assert_eq!(kept["alarm_level"], "warning");
    drop((gateway, broker));
    std::fs::remove_dir_all(dir).unwrap();
}
