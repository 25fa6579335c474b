//! The page of the program on its simulated camera, and what a person sees who starts it by hand.
//!
//! `ROWTONE_PROGRAM` may name another build of it, words before it included: `qemu-aarch64 … rowtone-rpi`.

mod common;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::Stdio;
use std::time::Instant;

use common::{PATIENCE, Program, command, file, start};

/// Where the program says that its page is, and its words after that.
fn address(program: &mut Program) -> (String, impl BufRead + use<>) {
    let mut said = BufReader::new(program.0.stderr.take().unwrap());
    let mut line = String::new();
    while said.read_line(&mut line).unwrap() > 0 {
        if let Some(rest) = line.split("http://").nth(1) {
            return (rest.trim_end().trim_end_matches('/').to_owned(), said);
        }
        line.clear();
    }
    panic!("it never says where its page is");
}

fn ask(address: &str, line: &str, fields: &str, body: &str) -> (u16, Vec<u8>) {
    let mut stream = TcpStream::connect(address).unwrap();
    let length = body.len();
    write!(
        stream,
        "{line} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Type: application/json\r\n\
         Content-Length: {length}\r\n{fields}\r\n{body}"
    )
    .unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let status = String::from_utf8_lossy(&answer[9..12]).parse().unwrap();
    let end = answer
        .windows(4)
        .position(|four| four == b"\r\n\r\n")
        .unwrap();
    (status, answer.split_off(end + 4))
}

/// The last report, once one says what is wanted.
fn report(address: &str, mut wanted: impl FnMut(&str) -> bool) -> String {
    let began = Instant::now();
    loop {
        let (status, body) = ask(address, "GET /api/report", "", "");
        let text = String::from_utf8(body).unwrap();
        if status == 200 && wanted(&text) {
            return text;
        }
        assert!(began.elapsed() < PATIENCE, "{text}");
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
}

#[test]
fn the_page_shows_the_camera_and_changes_what_is_measured() {
    let sections = "[measure]\nmax_peaks = 3\n[page]\nlisten = \"127.0.0.1:0\"\nclip_mib = 1\n";
    let (mut program, _ours, _theirs) = start("page", sections);
    let (address, _said) = address(&mut program);
    let shown = report(&address, |text| {
        text.contains("\"hz\":97.3") || text.contains("\"hz\":97.29")
    });
    assert!(
        shown.contains("\"roi\":[0,0,160,120],\"axes\":\"x\""),
        "{shown}"
    );
    // Somebody looks, so pictures and displacements come.
    let began = Instant::now();
    while ask(&address, "GET /api/picture.jpg", "", "").0 != 200 {
        assert!(began.elapsed() < PATIENCE);
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let (_, clip) = ask(&address, "GET /api/clip.y4m", "", "");
    assert!(clip.starts_with(b"YUV4MPEG2 W160 H120 F60000:1000 "));
    // The camera's pictures become shapes: all of it moves alike at its larger tone, by 0.4 px along the rows.
    let shapes = loop {
        let (status, body) = ask(&address, "GET /api/shapes", "", "");
        let text = String::from_utf8(body).unwrap();
        if status == 200 && text.contains("\"hz\":97.") {
            break text;
        }
        assert!(began.elapsed() < PATIENCE, "{text}");
        std::thread::sleep(std::time::Duration::from_millis(200));
    };
    let first = shapes.split("\"moves\":").nth(1).unwrap();
    let moves = first.split(']').next().unwrap();
    assert!(
        moves.contains("true") && !moves.contains("false"),
        "{shapes}"
    );
    let (status, _) = ask(
        &address,
        "PUT /api/settings",
        "",
        r#"{"window":0.5,"hop":0.25}"#,
    );
    assert_eq!(status, 401, "nobody has set a password yet");
}

#[test]
fn what_is_changed_on_the_page_holds_over_the_next_start_but_for_what_the_file_names() {
    let folder = std::env::temp_dir().join(format!("rowtone-page-{}", std::process::id()));
    let config = file(
        "kept",
        &format!(
            "[camera]\nmode = \"160x120\"\nlearn_frames = 8\n[measure]\nhop_s = 0.25\n\
             [output]\nport = \"text\"\n[service]\nrealtime_priority = 0\nstate = {:?}\n\
             [page]\nlisten = \"127.0.0.1:0\"\n",
            folder.join("settings")
        ),
    );
    let begin = || {
        let child = command()
            .args(["--simulate", "--config"])
            .arg(&config)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        Program(child.unwrap())
    };
    let known = "Authorization: Basic Om9wZW4gc2VzYW1l\r\n";
    {
        let mut program = begin();
        let (address, _said) = address(&mut program);
        report(&address, |_| true);
        let (status, _) = ask(
            &address,
            "PUT /api/password",
            "",
            r#"{"password":"open sesame"}"#,
        );
        assert_eq!(status, 200);
        let wanted = r#"{"window":0.5,"hop":0.5,"roi":[16,8,96,100],"um-per-px":50}"#;
        let (status, body) = ask(&address, "PUT /api/settings", known, wanted);
        assert_eq!(status, 200, "{}", String::from_utf8_lossy(&body));
        report(&address, |text| {
            text.contains("\"roi\":[16,8,96,100]") && text.contains("\"window_s\":0.5")
        });
        let (status, body) = ask(
            &address,
            "PUT /api/settings",
            known,
            r#"{"roi":[100,0,96,100]}"#,
        );
        let why = String::from_utf8(body).unwrap();
        assert_eq!(status, 422);
        assert!(why.contains("keep it inside 160x120 px"), "{why}");
    }
    let mut program = begin();
    let (address, said) = address(&mut program);
    let (_, settings) = ask(&address, "GET /api/settings", "", "");
    let settings = String::from_utf8(settings).unwrap();
    let began = Instant::now();
    report(&address, |text| text.contains("\"roi\":[16,8,96,100]"));
    assert!(settings.contains("\"password\":\"asked\""), "{settings}");
    drop(program);
    let said: Vec<String> = said.lines().map_while(Result::ok).collect();
    let told = |line: &str| {
        said.iter()
            .any(|said| said == &format!("rowtone-rpi: {line}"))
    };
    assert!(
        told("hop is 0.25, as the file says, and not 0.5, as was saved"),
        "{said:?}"
    );
    assert!(
        told("window is 0.5, as was saved; the file does not name it"),
        "{said:?}"
    );
    assert!(began.elapsed() < PATIENCE);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The text for people, and the simulation's truth: with the exposure simulated and corrected, what was put in comes out.
#[test]
fn people_read_lines_and_the_simulation_is_true() {
    let config = file(
        "people",
        "[output]\nport = \"text\"\n[service]\nrealtime_priority = 0\nstate = \"\"\n[page]\nlisten = \"off\"\n",
    );
    let child = command()
        .args(["--simulate", "--config"])
        .arg(&config)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut program = Program(child.unwrap());
    let said = BufReader::new(program.0.stdout.take().unwrap());
    let mut amplitudes = Vec::new();
    for line in said.lines() {
        let line = line.unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        if let [_, "Hz", "±", _, px, "px", "±", _, _, "dB", ..] = words[..] {
            amplitudes.push(px.parse::<f64>().unwrap());
        }
        if amplitudes.len() == 4 {
            break;
        }
    }
    // 0.4 px and 0.1 px, to three of their standard deviations and a thousandth.
    for pair in amplitudes.chunks(2) {
        assert!(
            (pair[0] - 0.4).abs() < 0.0005 && (pair[1] - 0.1).abs() < 0.0003,
            "{amplitudes:?}"
        );
    }
}
