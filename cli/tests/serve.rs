//! `rowtone serve` as a user starts it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A page that is served, until it is dropped.
struct Page {
    child: Child,
    address: String,
}

impl Page {
    fn start(args: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_rowtone"))
            .arg("serve")
            .args(args)
            .args(["--listen", "127.0.0.1:0"])
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut line = String::new();
        let errors = child.stderr.take().expect("piped");
        BufReader::new(errors).read_line(&mut line).expect("a line");
        let address = line
            .split("http://")
            .nth(1)
            .and_then(|rest| rest.split('/').next());
        Self {
            address: address
                .unwrap_or_else(|| panic!("no address in {line:?}"))
                .to_owned(),
            child,
        }
    }

    fn ask(&self, line: &str, body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        stream
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        write!(
            stream,
            "{line} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\n\r\n{body}",
            self.address,
            body.len()
        )
        .expect("it reads");
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let status = answer.get(9..12).and_then(|s| s.parse().ok()).unwrap_or(0);
        (
            status,
            answer
                .split_once("\r\n\r\n")
                .map_or("", |(_, body)| body)
                .to_owned(),
        )
    }

    /// The last report once the recording has been read to its end.
    fn last_report(&self) -> Value {
        let deadline = Instant::now() + Duration::from_secs(60);
        loop {
            assert!(Instant::now() < deadline, "the recording never ends");
            let (_, state) = self.ask("GET /api/state", "");
            let state: Value = serde_json::from_str(&state).expect("JSON");
            if state["phase"] == "ended" {
                let (status, report) = self.ask("GET /api/report", "");
                // It may have begun anew just now.
                if status == 200 {
                    return serde_json::from_str(&report).expect("JSON");
                }
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn clip(name: &str) -> String {
    let path =
        std::env::temp_dir().join(format!("rowtone-serve-{}-{name}.y4m", std::process::id()));
    let path = path.to_str().expect("a plain path").to_owned();
    let made = Command::new(env!("CARGO_BIN_EXE_rowtone"))
        .args([
            "simulate",
            "--seconds",
            "2",
            "--tone",
            "83.3:0.2",
            "--seed",
            "3",
            "-o",
            &path,
        ])
        .stderr(Stdio::null())
        .status();
    assert!(made.expect("it runs").success());
    path
}

const CAMERA: [&str; 4] = ["--line-time-us", "40", "--exposure-us", "500"];

#[test]
fn the_last_report_is_that_of_analyze_and_stays() {
    let path = clip("same");
    let page = Page::start(&[&[path.as_str()][..], &CAMERA].concat());
    let served = page.last_report();
    let analyzed = Command::new(env!("CARGO_BIN_EXE_rowtone"))
        .args(["analyze", &path, "--format", "json"])
        .args(CAMERA)
        .output()
        .expect("it runs");
    let lines = String::from_utf8(analyzed.stdout).expect("text");
    let last: Value = serde_json::from_str(lines.lines().last().expect("a report")).expect("JSON");
    assert_eq!(served, last);
    assert!(
        (served["peaks"][0]["hz"].as_f64().unwrap() - 83.3).abs() < 0.01,
        "{served}"
    );
    let (status, picture) = page.ask("GET /api/picture.jpg", "");
    assert_eq!((status, picture.is_empty()), (200, false));
    std::fs::remove_file(&path).expect("it is there");
}

#[test]
fn another_part_is_measured_and_a_wrong_one_refused() {
    let path = clip("part");
    let page = Page::start(&[&[path.as_str()][..], &CAMERA].concat());
    let all = page.last_report();
    assert_eq!(all["roi"], serde_json::json!([0, 0, 128, 300]));
    let (status, why) = page.ask("PUT /api/settings", r#"{"roi":[100,0,60,300]}"#);
    assert_eq!(status, 422);
    assert!(why.contains("keep it inside 128x300 px"), "{why}");
    assert_eq!(
        page.ask(
            "PUT /api/settings",
            r#"{"roi":[32,10,64,200],"um-per-px":50}"#
        )
        .0,
        200
    );
    let deadline = Instant::now() + Duration::from_secs(60);
    let part = loop {
        let report = page.last_report();
        if report["roi"] != all["roi"] {
            break report;
        }
        assert!(
            Instant::now() < deadline,
            "the other part is never measured"
        );
    };
    assert_eq!(part["roi"], serde_json::json!([32, 10, 64, 200]));
    assert!(
        part["peaks"][0]["amplitude_um"].as_f64().is_some(),
        "{part}"
    );
    assert!(
        part["noise_px"].as_f64() > all["noise_px"].as_f64(),
        "{part}"
    );
    std::fs::remove_file(&path).expect("it is there");
}

#[cfg(unix)]
#[test]
fn it_ends_in_order_when_asked_and_with_status_1_for_what_is_no_video() {
    let path = clip("end");
    let mut page = Page::start(&[&[path.as_str()][..], &CAMERA].concat());
    page.last_report();
    let pid = nix::unistd::Pid::from_raw(page.child.id() as i32);
    nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGTERM).expect("it runs");
    assert!(page.child.wait().expect("it ends").success());
    std::fs::remove_file(&path).expect("it is there");
    let refused = Command::new(env!("CARGO_BIN_EXE_rowtone"))
        .args([
            "serve",
            "/nowhere.y4m",
            "--line-time-us",
            "40",
            "--listen",
            "127.0.0.1:0",
        ])
        .output()
        .expect("it runs");
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).starts_with("rowtone: /nowhere.y4m: "));
}

/// `analyze --report`: the same page as one file, with the reports in it.
#[test]
fn a_still_page_holds_what_analyze_printed() {
    let path = clip("still");
    let page = path.replace(".y4m", ".html");
    let analyzed = Command::new(env!("CARGO_BIN_EXE_rowtone"))
        .args(["analyze", &path, "--format", "json", "--report", &page])
        .args(CAMERA)
        .output()
        .expect("it runs");
    assert!(analyzed.status.success());
    let html = std::fs::read_to_string(&page).expect("the page");
    let from = html.find("const STILL = ").expect("what was measured") + 14;
    let end = html[from..].find(";\n").expect("its end");
    let all: Value = serde_json::from_str(&html[from..from + end]).expect("JSON");
    let printed: Vec<Value> = String::from_utf8(analyzed.stdout)
        .expect("text")
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(all["reports"], Value::from(printed));
    assert!(
        all["picture"]
            .as_str()
            .is_some_and(|p| p.starts_with("data:image/jpeg;base64,/9j/"))
    );
    let refused = Command::new(env!("CARGO_BIN_EXE_rowtone"))
        .args(["analyze", &path, "--report", "page.pdf"])
        .args(CAMERA)
        .output()
        .expect("it runs");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("ends with .html"));
    std::fs::remove_file(&path).expect("it is there");
    std::fs::remove_file(&page).expect("it is there");
}
