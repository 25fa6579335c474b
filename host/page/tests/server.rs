//! The server over real sockets: what it gives, whom it refuses, and that nobody makes it stand still.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rowtone::camera::RawFormat;
use rowtone::link::settings::{Key, Limits, Settings};
use rowtone_page::control::{Access, Control, Keeper};
use rowtone_page::frames::Layout;
use rowtone_page::guard::Names;
use rowtone_page::live::Live;
use rowtone_page::server::{MAX_CONNECTIONS, Server};
use rowtone_page::site::Site;
use serde_json::Value;

/// Settings in memory.
#[derive(Default)]
struct Desk(Mutex<Option<Settings>>);

impl Control for Desk {
    fn settings(&self) -> Settings {
        self.0.lock().unwrap().unwrap_or_default()
    }
    fn limits(&self) -> Limits {
        Limits {
            width: 64,
            height: 48,
            min_width: 16,
            max_window_s: 60.0,
        }
    }
    fn keys(&self) -> &[Key] {
        &[Key::Window, Key::Hop, Key::Roi]
    }
    fn is_live(&self) -> bool {
        true
    }
    fn change(&self, settings: Settings) -> Result<(), String> {
        *self.0.lock().unwrap() = Some(settings);
        Ok(())
    }
}

fn start(access: Access) -> (Server, Arc<Live>) {
    let live = Arc::new(Live::default());
    let desk = Arc::new(Desk::default());
    let site = Site::new(Arc::clone(&live), desk, access, Names::default());
    let server = Server::start(([127, 0, 0, 1], 0).into(), Arc::new(site)).expect("a free port");
    (server, live)
}

#[cfg(target_os = "linux")]
#[test]
fn it_gives_signs_of_life_though_nobody_connects() {
    let live = Arc::new(Live::default());
    let desk = Arc::new(Desk::default());
    let site = Site::new(live, desk, Access::Open, Names::default());
    let (tell, told) = std::sync::mpsc::channel();
    let alive = move || {
        let _ = tell.send(());
    };
    let _server = Server::start_watched(([127, 0, 0, 1], 0).into(), Arc::new(site), alive).unwrap();
    for _ in 0..2 {
        told.recv_timeout(Duration::from_secs(10))
            .expect("a sign of life");
    }
}

/// Sends bytes, and returns all that comes until the other end closes.
fn talk(to: SocketAddr, bytes: &[u8]) -> String {
    let mut stream = TcpStream::connect(to).expect("it listens");
    stream
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    stream.write_all(bytes).expect("it reads");
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// Status and body of a request with these header fields.
fn ask(to: SocketAddr, line: &str, fields: &str, body: &str) -> (u16, String) {
    let length = body.len();
    let text = format!(
        "{line} HTTP/1.1\r\nHost: {to}\r\nConnection: close\r\nContent-Length: {length}\r\n{fields}\r\n{body}"
    );
    let answer = talk(to, text.as_bytes());
    let status = answer.get(9..12).and_then(|s| s.parse().ok()).unwrap_or(0);
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    (status, body.to_owned())
}

const JSON: &str = "Content-Type: application/json\r\n";

fn get(to: SocketAddr, path: &str) -> (u16, String) {
    ask(to, &format!("GET {path}"), "", "")
}

fn show_something(live: &Live) {
    let report = rowtone_report::example(None);
    live.report(&report, rowtone_report::json::report(&report));
    let layout = Layout {
        width: 64,
        height: 48,
        stride: 64,
        format: RawFormat::Raw8,
        bayer: false,
    };
    live.frames.keep(1, 0, layout, &[90; 64 * 48]);
}

#[test]
fn every_address_gives_what_docs_say() {
    let (server, live) = start(Access::Open);
    let to = server.address();
    let (status, body) = get(to, "/api/report");
    assert_eq!(status, 503, "no report yet");
    assert!(body.contains("\"error\""), "{body}");
    assert_eq!(get(to, "/api/picture.jpg").0, 503);
    show_something(&live);
    let (status, body) = get(to, "/api/report");
    let report: Value = serde_json::from_str(&body).expect("JSON");
    assert_eq!((status, report["seq"].as_u64()), (200, Some(3)));
    let (status, body) = get(to, "/api/reports?after=0");
    let list: Value = serde_json::from_str(&body).expect("JSON");
    assert_eq!((status, list["id"].as_u64()), (200, Some(1)));
    assert_eq!(list["reports"][0], report);
    for (path, begins) in [
        ("/", "<!doctype html>"),
        ("/api/state", "{"),
        ("/api/motion", "{\"frame\":"),
        ("/api/settings", "{"),
        ("/api/reports.csv", "unix_s,seq,t_s"),
        ("/api/clip.y4m", "YUV4MPEG2 W64 H48"),
        ("/api/clip.json", "{"),
        ("/metrics", "# HELP rowtone_reports_total"),
    ] {
        let (status, body) = get(to, path);
        assert_eq!(status, 200, "{path}");
        assert!(
            body.to_lowercase().starts_with(&begins.to_lowercase()),
            "{path}: {body:.80}"
        );
    }
    assert_eq!(get(to, "/api/picture.jpg").0, 200);
    assert_eq!(get(to, "/api/nothing").0, 404);
    assert_eq!(ask(to, "POST /api/settings", "", "").0, 405);
    assert_eq!(ask(to, "HEAD /", "", ""), (200, String::new()));
}

#[test]
fn events_follow_the_reports() {
    let (server, live) = start(Access::Open);
    let to = server.address();
    let mut stream = TcpStream::connect(to).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    write!(
        stream,
        "GET /api/reports HTTP/1.1\r\nHost: {to}\r\nAccept: text/event-stream\r\n\r\n"
    )
    .unwrap();
    show_something(&live);
    live.restart();
    show_something(&live);
    live.reports.close();
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("it ends");
    assert!(text.contains("text/event-stream"), "{text}");
    // The first may have been forgotten before it was sent.
    assert!(
        text.contains("event: report\nid: 1-2\ndata: {\"seq\":3,"),
        "{text}"
    );
}

/// Of a camera whose reports come faster than that, the state comes once a second all the same; and whoever listens
/// looks, so that pictures are kept.
#[test]
fn the_state_comes_among_many_reports() {
    let (server, live) = start(Access::Open);
    let to = server.address();
    let mut stream = TcpStream::connect(to).unwrap();
    write!(stream, "GET /api/reports HTTP/1.1\r\nHost: {to}\r\n\r\n").unwrap();
    let report = rowtone_report::example(None);
    for _ in 0..25 {
        live.report(&report, rowtone_report::json::report(&report));
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(live.frames.is_wanted());
    live.reports.close();
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("it ends");
    let states = text.matches("event: state").count();
    assert!((2..=4).contains(&states), "{states}");
    assert_eq!(text.matches("event: report").count(), 25);
}

#[test]
fn changes_ask_for_the_password_and_for_our_own_page() {
    let (server, _live) = start(Access::Password(Keeper::default()));
    let to = server.address();
    let put = |path: &str, fields: &str, body: &str| ask(to, &format!("PUT {path}"), fields, body);
    let window = r#"{"window":0.4,"hop":0.2}"#;
    assert_eq!(put("/api/settings", JSON, window).0, 401, "none is set yet");
    assert_eq!(put("/api/password", JSON, r#"{"password":"short"}"#).0, 422);
    assert_eq!(
        put("/api/password", JSON, r#"{"password":"open sesame"}"#).0,
        200
    );
    assert_eq!(put("/api/settings", JSON, window).0, 401, "it is not given");
    let known = format!("{JSON}Authorization: Basic Om9wZW4gc2VzYW1l\r\n");
    let (status, body) = put("/api/settings", &known, window);
    assert_eq!(status, 200, "{body}");
    let settings: Value = serde_json::from_str(&body).unwrap();
    assert_eq!(settings["settings"]["window"], 0.4);
    // Nobody sets another one without knowing it.
    assert_eq!(
        put("/api/password", JSON, r#"{"password":"mine from now"}"#).0,
        401
    );
    for (fields, status) in [
        (format!("{known}Origin: http://evil.com\r\n"), 403),
        (format!("{known}Sec-Fetch-Site: cross-site\r\n"), 403),
        (known.replace("application/json", "text/plain"), 415),
        (known.replace("Om9w", "Om9x"), 401),
    ] {
        assert_eq!(put("/api/settings", &fields, window).0, status, "{fields}");
    }
    let (status, body) = put("/api/settings", &known, r#"{"window":99}"#);
    assert_eq!(status, 422);
    assert!(
        body.contains("give 0.05 to 60") && body.contains("\"key\":\"window\""),
        "{body}"
    );
    // After some wrong guesses not even the right one is looked at.
    let wrong = known.replace("Om9w", "Om9x");
    for _ in 0..5 {
        put("/api/settings", &wrong, window);
    }
    assert_eq!(put("/api/settings", &known, window).0, 429);
    assert_eq!(get(to, "/api/settings").0, 200, "reading stays open");
}

#[test]
fn a_strangers_name_is_refused_for_reading_too() {
    let (server, _live) = start(Access::Open);
    let answer = talk(
        server.address(),
        b"GET / HTTP/1.1\r\nHost: evil.com\r\n\r\n",
    );
    assert!(answer.starts_with("HTTP/1.1 403 "), "{answer}");
    let answer = talk(server.address(), b"\x16\x03\x01\x02\x00nonsense\r\n\r\n");
    assert!(answer.starts_with("HTTP/1.1 400 "), "{answer}");
}

/// A clip that is not taken holds its place, and no second one piles up in memory behind it.
#[test]
fn one_clip_is_taken_at_a_time() {
    let (server, live) = start(Access::Open);
    let to = server.address();
    let layout = Layout {
        width: 2000,
        height: 1500,
        stride: 2000,
        format: RawFormat::Raw8,
        bayer: false,
    };
    let bytes = vec![90; 2000 * 1500];
    for frame in 0..8 {
        live.frames.keep(frame, 0, layout, &bytes);
    }
    let mut deaf = TcpStream::connect(to).unwrap();
    write!(deaf, "GET /api/clip.y4m HTTP/1.1\r\nHost: {to}\r\n\r\n").unwrap();
    // Its answer has begun.
    assert_eq!(deaf.read(&mut [0; 1]).unwrap(), 1);
    assert_eq!(get(to, "/api/clip.y4m").0, 503);
    assert_eq!(get(to, "/api/state").0, 200);
    drop(deaf);
    let deadline = Instant::now() + Duration::from_secs(10);
    while get(to, "/api/clip.y4m").0 != 200 {
        assert!(Instant::now() < deadline, "its place is never free again");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A thousand connections that say nothing, and viewers that do not read: whoever measures goes on, and whoever asks in
/// earnest is served once the idle ones have run out of time.
#[test]
fn neither_crowds_nor_the_slow_stop_it() {
    let (server, live) = start(Access::Open);
    let to = server.address();
    show_something(&live);
    let crowd: Vec<TcpStream> = (0..1000)
        .filter_map(|_| TcpStream::connect(to).ok())
        .collect();
    assert!(crowd.len() > MAX_CONNECTIONS, "{}", crowd.len());
    let began = Instant::now();
    let report = rowtone_report::example(None);
    for _ in 0..1000 {
        live.report(&report, "{}".to_owned());
    }
    assert!(
        began.elapsed() < Duration::from_secs(1),
        "{:?}",
        began.elapsed()
    );
    let deadline = Instant::now() + Duration::from_secs(20);
    loop {
        let (status, _) = get(to, "/api/report");
        if status == 200 {
            break;
        }
        // Turned away with a word, or reset where its request came after that.
        assert!(matches!(status, 503 | 0), "{status}");
        assert!(Instant::now() < deadline, "it never recovers");
        std::thread::sleep(Duration::from_millis(200));
    }
    drop(crowd);
}
