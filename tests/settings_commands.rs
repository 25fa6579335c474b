//! Commands over the line: what a person or a program may type.

mod wire_common;

use proptest::prelude::*;
use rowtone::link::outbox::Outbox;
use rowtone::link::settings::command::LineReader;
use rowtone::link::settings::store::Nowhere;
use rowtone::link::settings::{Console, Region, Settings};
use rowtone::report::Report;
use rowtone::wire::{Message, Reply, SettingsOrigin, text};
use wire_common::console::LIMITS;
use wire_common::ordinary_report;

fn console() -> Console {
    wire_common::console::console(7, Settings::default(), SettingsOrigin::Defaults)
}

/// Four reports, numbers 0 to 5 seen, 2 to 5 kept, all sent.
fn full(slots: &mut [Option<Report>; 4]) -> Outbox<'_> {
    let mut outbox = Outbox::new(slots);
    for seq in 0..6 {
        outbox.push(ordinary_report(seq));
        assert_eq!(outbox.take().unwrap().seq, seq);
    }
    outbox
}

fn say(console: &mut Console, line: &str) -> Reply {
    let mut slots = [const { None }; 4];
    match console.carry_out(line, 5000, &mut full(&mut slots), &mut Nowhere) {
        Message::Reply(reply) => reply,
        other => panic!("{other:?}"),
    }
}

fn refused(line: &str) -> String {
    let mut console = console();
    let reply = say(&mut console, line);
    assert!(!reply.ok, "{line}: {reply:?}");
    assert_eq!(*console.settings(), Settings::default(), "{line}");
    reply.text.to_string()
}

#[test]
fn settings_are_set_together() {
    let mut console = console();
    let reply = say(
        &mut console,
        "set window 2 hop 2 max-peaks 16 false-alarm 1e-4 um-per-px 12.5 roi 10,20,100,200 min-hz 5 max-hz 1000 wire binary unit 9",
    );
    assert!(reply.ok, "{reply:?}");
    let settings = *console.settings();
    assert_eq!(
        (settings.window_s, settings.hop_s, settings.max_peaks),
        (2.0, 2.0, 16)
    );
    assert_eq!(
        settings.roi,
        Some(Region {
            x: 10,
            y: 20,
            width: 100,
            height: 200
        })
    );
    // What `get` says can be said to `set`.
    let said = say(&mut console, "get").text.replace('=', " ");
    assert!(say(&mut console, "defaults").ok);
    assert_eq!(*console.settings(), Settings::default());
    assert!(say(&mut console, &format!("set {said}")).ok);
    assert_eq!(*console.settings(), settings);
    assert_eq!(say(&mut console, "get roi").text, "roi=10,20,100,200");
    assert!(say(&mut console, "set roi none").ok);
}

#[test]
fn an_error_says_why_and_nothing_changes() {
    for (line, why) in [
        ("sing", "sing: no such command; try help"),
        ("set", "missing: a setting and its value"),
        ("set window", "missing: a value"),
        ("set colour 1", "colour: no such setting; try get"),
        ("set window long", "window: long is not a number of seconds"),
        ("set window NaN", "window: NaN is not a number of seconds"),
        (
            "set window 2 hop 3",
            "hop is 3 s; give 0.01 to the window's length, 2; nothing was changed",
        ),
        (
            "set max-peaks 17",
            "max-peaks is 17; give 1 to 16; nothing was changed",
        ),
        (
            "set roi 300,0,100,10",
            "roi is 300,0,100,10; keep it inside 320x240 px, at least 16 wide and 1 high; nothing was changed",
        ),
        (
            "set roi 65535,0,65535,10",
            "roi is 65535,0,65535,10; keep it inside 320x240 px, at least 16 wide and 1 high; nothing was changed",
        ),
        (
            "set min-hz 50 max-hz 20",
            "min-hz is 50, max-hz is 20; keep min-hz below max-hz; nothing was changed",
        ),
        (
            "set window 0.7 hop 0.6 max-peaks 0",
            "max-peaks is 0; give 1 to 16; nothing was changed",
        ),
        ("save now", "now: not expected here; try help"),
        (
            "save",
            "save: this board cannot keep settings; set them after every start",
        ),
        ("resend", "missing: the number of a report"),
        ("resend x", "x: not the number of a report"),
        (
            "resend 5 4",
            "range 5 to 4 runs backwards; name the lower number first",
        ),
        (
            "resend 0 1",
            "not kept: reports 2 to before 6 are; ask for those",
        ),
        (
            "$RTCMD,status*00000000",
            "line: its checksum is wrong; send it again",
        ),
    ] {
        assert_eq!(refused(line), why);
    }
}

#[test]
fn reports_are_sent_again() {
    let mut slots = [const { None }; 4];
    let mut outbox = full(&mut slots);
    let said = console().carry_out("resend 0 3", 5000, &mut outbox, &mut Nowhere);
    let Message::Reply(reply) = said else {
        panic!("{said:?}")
    };
    assert_eq!(reply.text, "resending 2 to 3");
    assert_eq!(outbox.take().unwrap().seq, 2);
    assert_eq!(outbox.take().unwrap().seq, 3);
    assert!(outbox.take().is_none());
}

#[test]
fn a_program_uses_a_checksum() {
    let mut line = String::new();
    text::encode_command("get unit", &mut line).unwrap();
    let reply = say(&mut console(), line.trim_end());
    assert_eq!(reply.text, "unit=1");
    let harmed = line.replace("unit", "roi");
    assert!(!say(&mut console(), harmed.trim_end()).ok);
}

#[test]
fn status_and_version() {
    let mut console = console();
    assert_eq!(say(&mut console, "version").text, "rowtone 1.2.3 wire 1");
    say(&mut console, "nonsense");
    let mut slots = [const { None }; 4];
    let said = console.carry_out("status", 5000, &mut full(&mut slots), &mut Nowhere);
    let Message::Status(status) = said else {
        panic!("{said:?}")
    };
    assert_eq!(
        (status.session, status.uptime_ms, status.next_seq),
        (7, 5000, 6)
    );
    assert_eq!((status.oldest_seq, status.refused_commands), (Some(2), 1));
}

#[test]
fn lines_come_out_of_bytes() {
    let mut reader = LineReader::new();
    let bytes = b"\r\n\nstatus\r\nget\n\x80\xff\n".to_vec();
    let long = [vec![b'x'; 500], b"\nversion\r".to_vec()].concat();
    let mut heard = vec![];
    for byte in [bytes, long].concat() {
        if let Some(line) = reader.push(byte) {
            heard.push(line.map(str::to_owned).map_err(|error| error.to_string()));
        }
    }
    assert_eq!(
        heard,
        [
            Ok("status".to_owned()),
            Ok("get".to_owned()),
            Err("line: not plain text; send it again".to_owned()),
            Err("line: longer than 192 characters".to_owned()),
            Ok("version".to_owned()),
        ]
    );
}

proptest! {
    /// Whatever is typed: no panic, the settings stay valid, and the answer can be sent.
    #[test]
    fn any_line(lines in proptest::collection::vec(prop_oneof![
        ".{0,200}",
        "(set|get|resend)( (window|hop|max-peaks|false-alarm|um-per-px|roi|min-hz|max-hz|wire|unit|-?[0-9.e]{1,12}|none|[0-9]{1,5},[0-9]{1,5},[0-9]{1,5},[0-9]{1,5})){0,8}",
    ], 0..20)) {
        let mut console = console();
        let mut slots = [const { None }; 4];
        let mut outbox = full(&mut slots);
        for line in lines {
            let said = console.carry_out(&line, 0, &mut outbox, &mut Nowhere);
            let mut buffer = [0; text::MAX_LINE];
            let sent = text::encode_to_slice(&said, &mut buffer).unwrap();
            prop_assert_eq!(text::decode_line(core::str::from_utf8(sent).unwrap()), Ok(said));
            prop_assert!(console.settings().check(&LIMITS).is_ok());
        }
    }

    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..1000)) {
        let mut reader = LineReader::new();
        for byte in bytes {
            let _ = reader.push(byte);
        }
    }
}
