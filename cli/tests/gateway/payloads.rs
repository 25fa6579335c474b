//! TLS, user and password, last will, and Sparkplug B.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use crate::board::line;
use crate::broker::{Broker, publish, subscribe};
use crate::{JSON, config, dir, ports, rowtone, run, run_logged};

/// Runs a program with these arguments in a directory; whether it did its work.
fn done(dir: &Path, program: &str, arguments: &str) -> bool {
    let mut command = Command::new(program);
    let output = command.current_dir(dir).args(arguments.split(' ')).output();
    output.is_ok_and(|output| output.status.success())
}

/// An authority, a broker's certificate from it, another authority, and a user.
fn certificates(dir: &Path) -> bool {
    std::fs::write(dir.join("for"), "subjectAltName=IP:127.0.0.1\n").unwrap();
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";
    [
        format!("req -x509 {key} -keyout ca.key -out ca.pem -days 2 -subj /CN=authority"),
        format!("req -x509 {key} -keyout no.key -out no.pem -days 2 -subj /CN=other"),
        format!("req {key} -keyout key.pem -out cert.csr -subj /CN=broker"),
        "x509 -req -in cert.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -extfile for -out cert.pem".to_owned(),
    ]
    .iter()
    .all(|arguments| done(dir, "openssl", arguments))
        && done(dir, "mosquitto_passwd", "-b -c users hall secret")
}

/// TLS with an authority of one's own, user and password; a wrong password and an authority that did
/// not sign the broker's certificate get nowhere.
#[test]
fn tls_user_and_password() {
    let dir = dir("tls");
    if !certificates(&dir) {
        eprintln!("left out: openssl or mosquitto_passwd is not there");
        return;
    }
    let place = dir.display();
    let more = format!(
        "certfile {place}/cert.pem\nkeyfile {place}/key.pem\nallow_anonymous false\npassword_file {place}/users"
    );
    let Some(broker) = Broker::start(&dir, &more) else {
        return;
    };
    let cases = [
        ("secret", "ca.pem", true),
        ("wrong", "ca.pem", false),
        ("secret", "no.pem", false),
    ];
    let cases = cases.map(|(password, authority, right)| {
        let here = dir.join(format!("{password}-{authority}"));
        std::fs::create_dir(&here).unwrap();
        let settings = format!(
            "port = {}\nuser = \"hall\"\npassword = \"{password}\"\ntls_ca = \"{place}/{authority}\"",
            broker.port
        );
        let (masters, slaves, names) = ports(1);
        let config = config(&here, &settings, JSON, &names);
        let child = rowtone(&["gateway", "--seconds", "3", "--config"])
            .arg(&config)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        (child, masters, slaves, right)
    });
    std::thread::sleep(Duration::from_millis(500));
    let cases = cases.map(|(child, mut masters, slaves, right)| {
        masters[0].write_all(&line(0)).unwrap();
        (child, masters, slaves, right)
    });
    for (child, _masters, _slaves, right) in cases {
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let errors = String::from_utf8_lossy(&output.stderr);
        let acknowledged = u8::from(right);
        let expected = format!("heard 1, acknowledged {acknowledged},");
        assert!(said.contains(&expected), "{said}{errors}");
        assert!(right || errors.contains("away"), "{errors}");
    }
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

fn next(heard: &Receiver<(String, Vec<u8>)>) -> (String, Vec<u8>) {
    heard
        .recv_timeout(Duration::from_secs(20))
        .expect("a message")
}

/// The broker says it when a gateway dies; one that ends says it itself.
#[test]
fn the_last_will() {
    let dir = dir("will");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/gateway/test/state");
    let state = || String::from_utf8(next(&heard).1).unwrap();
    let (_masters, _slaves, names) = ports(1);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let gateway = run(&config, &[]);
    assert_eq!(state(), "online");
    drop(gateway); // kill -9
    assert_eq!(state(), "offline");
    let mut gateway = run(&config, &["--seconds", "1"]);
    assert_eq!(state(), "online");
    assert_eq!(state(), "offline");
    assert!(gateway.0.wait().unwrap().success());
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}

/// A board that speaks, falls silent, speaks again and is unplugged: each is an event, and who comes later finds the last
/// of them, the last report and what Home Assistant wants to know.
#[test]
fn a_board_that_falls_silent_or_is_unplugged_is_an_event() {
    let dir = dir("silent");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (client, heard) = subscribe(broker.port, "plant/b0/state");
    let object = |bytes: &[u8]| -> serde_json::Value { serde_json::from_slice(bytes).unwrap() };
    let expect = |state: &str| {
        let said = object(&next(&heard).1);
        assert_eq!(
            (&said["board"], &said["state"]),
            (&"b0".into(), &state.into())
        );
        assert!(said["since_unix_ms"].as_u64().unwrap() > 1_700_000_000_000);
        said["why"].as_str().unwrap_or_default().to_owned()
    };
    let (mut masters, slaves, names) = ports(1);
    let json = format!("{JSON}\nretain = true\ndiscovery = \"homeassistant\"");
    let config = config(&dir, &format!("port = {}", broker.port), &json, &names);
    let text = std::fs::read_to_string(&config).unwrap() + "silent_s = 2\n";
    std::fs::write(&config, text).unwrap();
    let (gateway, log) = run_logged(&config, &[]);
    masters[0].write_all(&line(0)).unwrap();
    expect("online");
    assert_eq!(expect("silent"), "no report for 2 s");
    masters[0].write_all(&line(1)).unwrap();
    expect("online");
    drop((masters, slaves));
    assert!(!expect("unplugged").is_empty());
    drop(client);

    let (_client, heard) = subscribe(broker.port, "plant/b0/#");
    let kept: std::collections::BTreeMap<_, _> = (0..2).map(|_| next(&heard)).collect();
    assert_eq!(object(&kept["plant/b0/state"])["state"], "unplugged");
    assert_eq!(object(&kept["plant/b0/report"])["seq"], 1);
    let (_client, heard) = subscribe(broker.port, "homeassistant/#");
    // The broker goes on with what this client had asked for before.
    let mut all = std::iter::repeat_with(|| next(&heard));
    let (topic, device) = all.find(|(of, _)| !of.starts_with("plant/")).unwrap();
    assert_eq!(topic, "homeassistant/device/rowtone-test-b0/config");
    let velocity = &object(&device)["components"]["velocity"];
    assert_eq!(velocity["state_topic"], "plant/b0/report");

    // Each line has the time of day.
    let said = std::fs::read_to_string(&log).unwrap();
    assert!(said.contains("Z b0: silent: no report for 2 s"), "{said}");
    for line in said.lines() {
        let time = line
            .strip_prefix("rowtone: 20")
            .unwrap_or_else(|| panic!("{line}"));
        assert_eq!(&time[8..9], "T", "{line}");
    }
    drop((gateway, broker));
    std::fs::remove_dir_all(dir).unwrap();
}

/// One field of a protocol buffer: its number, and its value or bytes. Written after the encoding's
/// description, not with the crate that the gateway uses.
#[derive(Clone, Debug, PartialEq)]
enum Field {
    Number(u64, u64),
    Float(u64, f32),
    Bytes(u64, Vec<u8>),
}

fn fields(mut bytes: &[u8]) -> Vec<Field> {
    fn varint(bytes: &mut &[u8]) -> u64 {
        let (mut value, mut shift) = (0, 0);
        loop {
            let byte = bytes[0];
            *bytes = &bytes[1..];
            value |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte < 0x80 {
                return value;
            }
        }
    }
    let mut fields = vec![];
    while !bytes.is_empty() {
        let key = varint(&mut bytes);
        let number = key >> 3;
        fields.push(match key & 7 {
            0 => Field::Number(number, varint(&mut bytes)),
            2 => {
                let len = varint(&mut bytes) as usize;
                let (content, rest) = bytes.split_at(len);
                bytes = rest;
                Field::Bytes(number, content.to_vec())
            }
            5 => {
                let (content, rest) = bytes.split_first_chunk::<4>().unwrap();
                bytes = rest;
                Field::Float(number, f32::from_le_bytes(*content))
            }
            other => panic!("wire type {other}"),
        });
    }
    fields
}

/// The number in field 3 of a payload (`seq`), and the metrics' names with their values.
fn payload(bytes: &[u8]) -> (Option<u64>, Vec<(String, Option<Field>)>) {
    let (mut seq, mut metrics) = (None, vec![]);
    for field in fields(bytes) {
        match field {
            Field::Number(3, number) => seq = Some(number),
            Field::Bytes(2, metric) => {
                let metric = fields(&metric);
                let name = metric.iter().find_map(|field| match field {
                    Field::Bytes(1, name) => String::from_utf8(name.clone()).ok(),
                    _ => None,
                });
                let value = metric.into_iter().find(|field| {
                    let (Field::Number(n, _) | Field::Float(n, _) | Field::Bytes(n, _)) = field;
                    (10..=14).contains(n)
                });
                metrics.push((name.unwrap(), value));
            }
            _ => {}
        }
    }
    (seq, metrics)
}

/// A host of Sparkplug B sees node and board being born, their data, and their deaths.
#[test]
fn sparkplug() {
    let dir = dir("sparkplug");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "spBv1.0/#");
    let sparkplug = "format = \"sparkplug\"\ngroup = \"plant\"\nnode = \"hall-2\"";
    let (mut masters, slaves, names) = ports(2);
    let settings = format!("port = {}", broker.port);
    let gateway = run(&config(&dir, &settings, sparkplug, &names), &[]);
    let expect = |topic: &str, number: Option<u64>| {
        let (heard, bytes) = next(&heard);
        assert_eq!(heard, format!("spBv1.0/plant/{topic}"));
        let (seq, metrics) = payload(&bytes);
        assert_eq!(seq, number, "{topic}");
        metrics
    };
    let value = |metrics: &[(String, Option<Field>)], name: &str| -> Option<Field> {
        let metric = metrics.iter().find(|(of, _)| of == name);
        metric.unwrap_or_else(|| panic!("no {name}")).1.clone()
    };

    let birth = expect("NBIRTH/hall-2", Some(0));
    let born = value(&birth, "bdSeq");
    assert_eq!(
        value(&birth, "Node Control/Rebirth"),
        Some(Field::Number(14, 0))
    );
    masters[0].write_all(&line(7)).unwrap();
    let birth = expect("DBIRTH/hall-2/b0", Some(1));
    let data = expect("DDATA/hall-2/b0", Some(2));
    assert_eq!(birth, data);
    assert_eq!(value(&data, "seq"), Some(Field::Number(10, 7)));
    assert_eq!(value(&data, "time_ms"), Some(Field::Number(11, 3500)));
    assert_eq!(value(&data, "peak 2/hz"), Some(Field::Float(12, 98.4)));
    assert_eq!(value(&data, "peak 4/hz"), None);
    masters[0].write_all(&line(8)).unwrap();
    expect("DDATA/hall-2/b0", Some(3));

    // A host that has missed the births asks for them: a metric of this name, type 11, true.
    let name = b"Node Control/Rebirth";
    let metric = [&[0x0a, name.len() as u8], &name[..], &[0x20, 11, 0x70, 1]].concat();
    let command = [&[0x12, metric.len() as u8], &metric[..]].concat();
    let to = "spBv1.0/plant/NCMD/hall-2";
    publish(broker.port, to, &command);
    assert_eq!(next(&heard).0, to);
    assert_eq!(
        value(&expect("NBIRTH/hall-2", Some(0)), "bdSeq"),
        born,
        "the same connection"
    );
    masters[0].write_all(&line(9)).unwrap();
    expect("DBIRTH/hall-2/b0", Some(1));
    expect("DDATA/hall-2/b0", Some(2));

    // The board's cable is pulled; the other board, of which nothing was heard, is not mentioned.
    drop((masters, slaves));
    expect("DDEATH/hall-2/b0", Some(3));
    drop(gateway); // kill -9
    let death = expect("NDEATH/hall-2", None);
    assert_eq!(value(&death, "bdSeq"), born);
    // Another gateway's births are told from those of the first.
    let (_masters, _slaves, names) = ports(2);
    let _gateway = run(&config(&dir, &settings, sparkplug, &names), &[]);
    let birth = expect("NBIRTH/hall-2", Some(0));
    let Some(Field::Number(field, number)) = born else {
        panic!("{born:?}");
    };
    let next = Some(Field::Number(field, (number + 1) % 256));
    assert_eq!(value(&birth, "bdSeq"), next);
    drop(broker);
    std::fs::remove_dir_all(dir).unwrap();
}
