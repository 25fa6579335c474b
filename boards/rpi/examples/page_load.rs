//! What viewers of the page cost the line path: a camera that does not wait, and a crowd before its page.
//!
//!     cargo run --release -p rowtone-rpi --example page_load -- [SECONDS=600] [VIEWERS=5] [IDLE=1000]
//!
//! A simulated camera delivers 52 000 lines a second (640x433 px at 120 frames/s, drawn beforehand) and has four buffers:
//! what is not taken in time is lost, and counted. VIEWERS watch as browsers do (events, a picture five times a second,
//! displacements, state); a tenth of them is killed and comes again every second, one reads nothing at all; IDLE
//! connections are held open. Printed: lines lost, how long a frame took, and the page's share of a processor. Exit
//! status 1 where a line was lost that is not lost without viewers, or the share is above 10 %.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rowtone::camera::RawFormat;
use rowtone_page::live::Live;
use rowtone_rpi::capture::simulated::Scene;
use rowtone_rpi::capture::{CameraError, Facts, Frame, Shape, Source};
use rowtone_rpi::config::Config;
use rowtone_rpi::page;
use rowtone_rpi::run;
use rowtone_rpi::shared::Shared;

const WIDTH: u16 = 640;
const HEIGHT: u16 = 433;
const FPS: i64 = 120;
/// Frames that are drawn, and shown again and again: all tones have whole periods in them.
const DRAWN: u32 = 60;
/// Buffers of the camera.
const BUFFERS: i64 = 4;

/// A camera that goes on whether its frames are taken or not.
struct Relentless {
    facts: Facts,
    frames: Arc<Vec<Vec<u8>>>,
    began: Instant,
    next: i64,
    lost: Arc<AtomicU64>,
    taken: Arc<AtomicU64>,
}

const PERIOD_NS: i64 = 1_000_000_000 / FPS;

impl Source for Relentless {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn next(&mut self, _: Duration, take: &mut dyn FnMut(Frame<'_>)) -> Result<(), CameraError> {
        let now_ns = self.began.elapsed().as_nanos() as i64;
        let due_ns = (self.next + 1) * PERIOD_NS;
        if due_ns > now_ns {
            std::thread::sleep(Duration::from_nanos((due_ns - now_ns) as u64));
        } else if now_ns - due_ns > BUFFERS * PERIOD_NS {
            // All buffers were full: what came since is gone.
            let behind = (now_ns - due_ns) / PERIOD_NS - BUFFERS + 1;
            self.lost.fetch_add(behind as u64, Ordering::Relaxed);
            self.next += behind;
        }
        let drawn = &self.frames[(self.next % i64::from(DRAWN)) as usize];
        take(Frame {
            sequence: self.next as u32,
            start_ns: Some(self.next * PERIOD_NS),
            bytes: drawn,
            intact: true,
        });
        self.taken.fetch_add(1, Ordering::Relaxed);
        self.next += 1;
        Ok(())
    }

    fn set_frame_period(&mut self, _: i64) {}
}

fn draw() -> Vec<Vec<u8>> {
    let scene = Scene {
        width: WIDTH,
        height: HEIGHT,
        line_time_s: 18e-6,
        // 97.3 Hz and 211.7 Hz have no whole periods in half a second; 96 and 212 have.
        tones: vec![
            rowtone_rpi::capture::simulated::Tone { hz: 96.0, px: 0.4 },
            rowtone_rpi::capture::simulated::Tone { hz: 212.0, px: 0.1 },
        ],
        ..Scene::default()
    };
    (0..DRAWN)
        .map(|k| {
            let mut bytes = Vec::new();
            scene.draw(i64::from(k) * PERIOD_NS, k, &mut bytes);
            bytes
        })
        .collect()
}

/// One request on a connection that stays open; `false` where it broke.
fn ask(stream: &mut TcpStream, to: SocketAddr, path: &str, buffer: &mut [u8]) -> bool {
    if write!(stream, "GET {path} HTTP/1.1\r\nHost: {to}\r\n\r\n").is_err() {
        return false;
    }
    // Whatever came is thrown away: what it costs to make is measured here, not what a browser does with it.
    stream
        .set_read_timeout(Some(Duration::from_millis(30)))
        .is_ok()
        && loop {
            match stream.read(buffer) {
                Ok(0) => break false,
                Ok(_) => {}
                Err(_) => break true,
            }
        }
}

/// Watches as the page does, until told to stop; one that is killed often comes again.
fn watch(to: SocketAddr, stop: &AtomicBool, killed_every: Option<Duration>, answers: &AtomicU64) {
    let mut buffer = vec![0; 1 << 16];
    while !stop.load(Ordering::Relaxed) {
        let began = Instant::now();
        let (Ok(mut events), Ok(mut pictures)) = (TcpStream::connect(to), TcpStream::connect(to))
        else {
            std::thread::sleep(Duration::from_millis(100));
            continue;
        };
        let _ = write!(
            events,
            "GET /api/reports HTTP/1.1\r\nHost: {to}\r\nAccept: text/event-stream\r\n\r\n"
        );
        let _ = events.set_read_timeout(Some(Duration::from_millis(5)));
        let mut round = 0_u32;
        while !stop.load(Ordering::Relaxed)
            && killed_every.is_none_or(|every| began.elapsed() < every)
        {
            let _ = events.read(&mut buffer);
            let path = if round % 4 == 3 {
                "/api/motion"
            } else {
                "/api/picture.jpg"
            };
            if !ask(&mut pictures, to, path, &mut buffer) {
                break;
            }
            answers.fetch_add(1, Ordering::Relaxed);
            round += 1;
            std::thread::sleep(Duration::from_millis(165));
        }
    }
}

/// Processor time of the threads of this name, s.
fn cpu_s(name: &str) -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task")
        .into_iter()
        .flatten()
        .flatten();
    let ticks: u64 = tasks
        .filter_map(|task| std::fs::read_to_string(task.path().join("stat")).ok())
        .filter_map(|stat| {
            let (head, rest) = stat.rsplit_once(')')?;
            let thread = head.split_once('(')?.1;
            let words: Vec<&str> = rest.split_whitespace().collect();
            let ticks = words.get(11)?.parse::<u64>().ok()? + words.get(12)?.parse::<u64>().ok()?;
            (thread == name).then_some(ticks)
        })
        .sum();
    ticks as f64 / 100.0
}

/// Runs the service for so long before so many viewers; frames taken and lost, and what the page took of a processor.
fn measure(
    frames: &Arc<Vec<Vec<u8>>>,
    run_for: Duration,
    viewers: u32,
    idle: u32,
) -> (u64, u64, f64, u64) {
    let mut config = Config::defaults();
    config.page.listen = Some(([127, 0, 0, 1], 0).into());
    config.service.state = std::path::PathBuf::new();
    config.service.realtime_priority = Some(50);
    config.output.port = "/dev/null".to_owned();
    let live = Arc::new(Live::new(config.page.clip_bytes));
    let shared = Arc::new(Shared::new(config.settings).with_page(live));
    let server = page::serve(&config, &shared)
        .expect("a free port")
        .expect("it is wanted");
    let to = server.address();
    let (lost, taken) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let (stop, answers) = (AtomicBool::new(false), AtomicU64::new(0));
    let mut page_s = 0.0;
    std::thread::scope(|scope| {
        let (shared, config) = (&shared, &config);
        let (camera_lost, camera_taken) = (Arc::clone(&lost), Arc::clone(&taken));
        let camera_frames = Arc::clone(frames);
        scope.spawn(move || {
            let facts = Facts {
                id: "relentless".to_owned(),
                shape: Shape {
                    width: WIDTH,
                    height: HEIGHT,
                    stride: WIDTH.into(),
                    format: RawFormat::Raw8,
                    bayer: false,
                },
                line_time: Some((18e-6, "the example")),
                frame_period_ns: Some(PERIOD_NS),
                shortest_frame_s: None,
                reasons: String::new(),
            };
            let outcome = run::run(config, shared, &mut |_| {
                Ok(Box::new(Relentless {
                    facts: facts.clone(),
                    frames: Arc::clone(&camera_frames),
                    began: Instant::now(),
                    next: 0,
                    lost: Arc::clone(&camera_lost),
                    taken: Arc::clone(&camera_taken),
                }))
            });
            outcome.expect("settings that can be used");
        });
        let watchers = (0..viewers).map(|k| {
            let killed_every = (k == 0).then(|| Duration::from_secs(1));
            let (stop, answers) = (&stop, &answers);
            scope.spawn(move || watch(to, stop, killed_every, answers))
        });
        let watchers: Vec<_> = watchers.collect();
        // Reads nothing of what it asks for.
        let deaf = (viewers > 0)
            .then(|| TcpStream::connect(to).ok())
            .flatten()
            .map(|mut stream| {
                let _ = write!(stream, "GET /api/clip.y4m HTTP/1.1\r\nHost: {to}\r\n\r\n");
                stream
            });
        let mut held: Vec<TcpStream> = Vec::new();
        let began = Instant::now();
        let mut last_s = cpu_s("viewer") + cpu_s("page");
        while began.elapsed() < run_for {
            // Those that were turned away come again.
            held.retain(|stream| {
                let _ = stream.set_nonblocking(true);
                (&mut &*stream).read(&mut [0; 256]).is_err()
            });
            while held.len() < idle as usize {
                match TcpStream::connect(to) {
                    Ok(stream) => held.push(stream),
                    Err(_) => break,
                }
            }
            std::thread::sleep(Duration::from_secs(1));
            // Threads that end take their time with them, so it is added up as it grows.
            let now_s = cpu_s("viewer") + cpu_s("page");
            page_s += (now_s - last_s).max(0.0);
            last_s = now_s;
        }
        stop.store(true, Ordering::Relaxed);
        shared.stop.store(true, Ordering::Relaxed);
        drop(deaf);
        watchers
            .into_iter()
            .for_each(|watcher| watcher.join().expect("it does not panic"));
    });
    drop(server);
    let load = |count: &AtomicU64| count.load(Ordering::Relaxed);
    (
        load(&taken),
        load(&lost),
        page_s / run_for.as_secs_f64(),
        load(&answers),
    )
}

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1).map(|text| text.parse::<u32>());
    let mut next = |usual: u32| args.next().map_or(usual, |given| given.unwrap_or(usual));
    let (seconds, viewers, idle) = (next(600), next(5), next(1000));
    let frames = Arc::new(draw());
    let run_for = Duration::from_secs(seconds.into());
    println!(
        "camera {WIDTH}x{HEIGHT} at {FPS} frames/s, {} lines/s",
        i64::from(HEIGHT) * FPS
    );
    let mut bad = false;
    for (who, viewers, idle) in [
        ("nobody", 0, 0),
        ("viewers", viewers, 0),
        ("viewers and idle", viewers, idle),
    ] {
        let (taken, lost, share, answers) = measure(&frames, run_for, viewers, idle);
        println!(
            "{who} ({viewers} viewers, {idle} idle connections), {seconds} s: {} lines taken, {} lost; \
             the page: {:.1} % of a processor, {answers} answers to viewers",
            taken * u64::from(HEIGHT),
            lost * u64::from(HEIGHT),
            100.0 * share
        );
        bad |= lost > 0 || share > 0.1;
    }
    ExitCode::from(u8::from(bad))
}
