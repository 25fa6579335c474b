//! What Home Assistant is told of a board, so that it makes its sensors by itself: MQTT device discovery (Home Assistant
//! 2024.11 and newer, <https://www.home-assistant.io/integrations/mqtt/#device-discovery-payload>).

use serde_json::{Value, json};

use super::config::Board;

/// Where a board's messages are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Topics<'a> {
    /// First part of all topics.
    pub(super) topic: &'a str,
    pub(super) client_id: &'a str,
}

/// What stands in a name of Home Assistant: letters, digits, `_` and `-`; anything else by its number.
fn id(text: &str) -> String {
    let mut id = String::new();
    for c in text.chars() {
        if c.is_ascii_alphanumeric() || c == '-' {
            id.push(c);
        } else {
            id += &format!("_{:x}_", u32::from(c));
        }
    }
    id
}

/// The topic under the prefix, and the payload.
pub(super) fn device(prefix: &str, topics: Topics<'_>, board: &Board) -> (String, String) {
    let Topics { topic, client_id } = topics;
    let name = &board.name;
    let device = format!("rowtone-{}-{}", id(client_id), id(name));
    let report = format!("{topic}/{name}/report");
    let state = format!("{topic}/{name}/state");
    let sensor = |key: &str, name: &str, value: &str, more: Value| {
        let mut sensor = json!({
            "platform": "sensor",
            "unique_id": format!("{device}-{key}"),
            "name": name,
            "state_topic": report,
            "value_template": format!("{{{{ {value} }}}}"),
        });
        if let (Some(sensor), Value::Object(more)) = (sensor.as_object_mut(), more) {
            sensor.extend(more);
        }
        (key.to_owned(), sensor)
    };
    let measured = |unit: &str, decimals: u8| json!({"unit_of_measurement": unit, "state_class": "measurement", "suggested_display_precision": decimals});
    let mut speed = measured("mm/s", 2);
    speed["device_class"] = "speed".into();
    let mut hz = measured("Hz", 2);
    hz["device_class"] = "frequency".into();
    let peak = |key: &str| format!("value_json.peaks[0].{key} if value_json.peaks else none");
    let mut components: serde_json::Map<String, Value> = [
        sensor(
            "velocity",
            "Velocity",
            "value_json.velocity_mm_s_rms | default(none)",
            speed,
        ),
        sensor("hz", "Strongest tone", &peak("hz"), hz),
        sensor(
            "amplitude",
            "Amplitude of the strongest tone",
            &peak("amplitude_px"),
            measured("px", 4),
        ),
        sensor(
            "warnings",
            "Warnings",
            "value_json.warnings | join(', ')",
            json!({"entity_category": "diagnostic"}),
        ),
    ]
    .into_iter()
    .collect();
    if board.zone_limits.is_some() {
        let options = json!({"device_class": "enum", "options": ["A", "B", "C", "D"]});
        components.extend([sensor(
            "zone",
            "Zone",
            "value_json.zone | default(none)",
            options,
        )]);
    }
    let gateway = format!("{topic}/gateway/{client_id}/state");
    if board.alarms.is_some() {
        components.insert(
            "alarm".to_owned(),
            json!({
                "platform": "sensor",
                "unique_id": format!("{device}-alarm"),
                "name": "Alarm",
                "state_topic": format!("{topic}/{name}/alarm"),
                "value_template": "{{ value_json.alarm_level }}",
                "device_class": "enum",
                "options": ["normal", "warning", "trip"],
            }),
        );
    }
    components.insert(
        "state".to_owned(),
        json!({
            "platform": "sensor",
            "unique_id": format!("{device}-state"),
            "name": "Board",
            "state_topic": state,
            "value_template": "{{ value_json.state }}",
            "availability": [{"topic": gateway}],
            "device_class": "enum",
            "options": ["online", "silent", "unplugged"],
            "entity_category": "diagnostic",
        }),
    );
    let payload = json!({
        "device": {"identifiers": [device], "name": name, "manufacturer": "rowtone"},
        "origin": {"name": "rowtone gateway", "sw_version": env!("CARGO_PKG_VERSION")},
        "availability_mode": "all",
        "availability": [
            {"topic": gateway},
            {"topic": state, "value_template": "{{ value_json.state }}"},
        ],
        "components": components,
    });
    (
        format!("{prefix}/device/{device}/config"),
        payload.to_string(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_a_device_with_sensors_of_their_own() {
        let board = Board {
            name: "press.3".to_owned(),
            port: "/dev/ttyUSB0".parse().unwrap(),
            silent_s: 30,
            zone_limits: Some("1.4,2.8,4.5".parse().unwrap()),
            alarms: None,
        };
        let topics = Topics {
            topic: "plant/vibration",
            client_id: "hall 2",
        };
        let (topic, payload) = device("homeassistant", topics, &board);
        assert_eq!(
            topic,
            "homeassistant/device/rowtone-hall_20_2-press_2e_3/config"
        );
        let payload: Value = serde_json::from_str(&payload).unwrap();
        // What the schema of a device's discovery asks for.
        assert!(
            payload["device"]["identifiers"][0].is_string()
                && payload["origin"]["name"].is_string()
        );
        let components = payload["components"].as_object().unwrap();
        assert_eq!(components.len(), 6);
        let mut ids = std::collections::BTreeSet::new();
        for component in components.values() {
            assert!(ids.insert(component["unique_id"].as_str().unwrap()));
            assert_eq!(component["platform"], "sensor");
            let of = component["state_topic"].as_str().unwrap();
            assert!(of.starts_with("plant/vibration/press.3/"), "{of}");
            let template = component["value_template"].as_str().unwrap();
            assert!(
                template.starts_with("{{ value_json.") && template.ends_with(" }}"),
                "{template}"
            );
        }
        assert_eq!(
            payload["availability"][0]["topic"],
            "plant/vibration/gateway/hall 2/state"
        );
    }
}
