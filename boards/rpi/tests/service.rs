//! The service on a simulated camera: faults, reopening, settings over the line, a clean stop, memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Read;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rowtone::report::{Report, Warning};
use rowtone::wire::{Message, text};
use rowtone_rpi::capture::simulated::{Scene, Simulated, Tone};
use rowtone_rpi::capture::{CameraError, Source};
use rowtone_rpi::clock::FrameClock;
use rowtone_rpi::config::Config;
use rowtone_rpi::lines::Lines;
use rowtone_rpi::memory::Memory;
use rowtone_rpi::run;
use rowtone_rpi::setup::Setup;
use rowtone_rpi::shared::Shared;

/// Counts the allocations of the thread that asks.
struct Counting;

thread_local! {
    static COUNT: AtomicU64 = const { AtomicU64::new(0) };
}

fn allocations() -> u64 {
    COUNT.with(|count| count.load(Ordering::Relaxed))
}

// SAFETY: passes everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.fetch_add(1, Ordering::Relaxed));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn scene() -> Scene {
    Scene {
        width: 160,
        height: 120,
        line_time_s: 130e-6,
        paced: false,
        ..Scene::default()
    }
}

/// A pseudo-terminal pair: our end, and the name of the other.
fn terminal() -> (serialport::TTYPort, serialport::TTYPort, String) {
    use serialport::SerialPort;
    let (mut ours, theirs) = serialport::TTYPort::pair().unwrap();
    ours.set_timeout(Duration::from_millis(20)).unwrap();
    let name = theirs.name().unwrap();
    (ours, theirs, name)
}

fn config(port: &str, extra: &str) -> Config {
    let text = format!(
        "[camera]\nlearn_frames = 8\nexposure_us = 1\n{extra}\n[output]\nport = \"{port}\"\n\
         [service]\nrealtime_priority = 0\nstate = \"/nonexistent/state\"\n"
    );
    Config::parse(&text, "test").unwrap()
}

/// Reads messages until `enough` says so, or 60 s.
fn listen(port: &mut impl Read, mut enough: impl FnMut(&Message) -> bool) -> Vec<Message> {
    let began = Instant::now();
    let mut decoder = text::Decoder::<{ text::MAX_LINE }>::new();
    let mut heard = Vec::new();
    let mut bytes = [0; 512];
    while began.elapsed() < Duration::from_secs(60) {
        let count = port.read(&mut bytes).unwrap_or(0);
        for message in bytes[..count].iter().filter_map(|&b| decoder.push(b)) {
            let message = message.expect("every line is intact");
            let done = enough(&message);
            heard.push(message);
            if done {
                return heard;
            }
        }
    }
    panic!("not heard within 60 s; so far: {heard:?}");
}

fn reports(messages: &[Message]) -> Vec<Report> {
    messages
        .iter()
        .filter_map(|message| match message {
            Message::Report { report, .. } => Some(report.clone()),
            _ => None,
        })
        .collect()
}

fn is_right(report: &Report) -> bool {
    let near = |hz: f32, px: f32| {
        report
            .peaks
            .iter()
            .any(|p| (p.hz - hz).abs() < 0.2 && (p.amplitude_px - px).abs() < 0.1 * px)
    };
    near(97.3, 0.4) && near(211.7, 0.1)
}

#[test]
fn a_camera_that_fails_is_opened_anew_and_nothing_stops() {
    let (mut ours, _theirs, name) = terminal();
    let config = config(&name, "");
    let shared = Shared::new(config.settings);
    let opened = Mutex::new(0);
    let mut open = |_: &Config| -> Result<Box<dyn Source>, CameraError> {
        let mut opened = opened.lock().unwrap();
        *opened += 1;
        if *opened == 1 {
            return Err(CameraError::Missing {
                wanted: None,
                found: Vec::new(),
            });
        }
        Ok(Box::new(Simulated::new(Scene {
            frames: Some(200),
            lose_every: Some(50),
            spoil_every: Some(77),
            ..scene()
        })))
    };
    let heard = std::thread::scope(|scope| {
        let listener = scope.spawn(|| {
            let mut sessions = 0;
            let mut last = 0;
            let heard = listen(&mut ours, |message| {
                if let Message::Report { report, .. } = message {
                    sessions += u32::from(report.time_ms > last + 1400);
                    last = report.time_ms;
                    return report.seq >= 9;
                }
                false
            });
            shared.stop.store(true, Ordering::Relaxed);
            heard
        });
        run::run(&config, &shared, &mut open).unwrap();
        listener.join().unwrap()
    });
    assert!(
        *opened.lock().unwrap() >= 3,
        "missing, then at least two openings"
    );
    let reports = reports(&heard);
    for pair in reports.windows(2) {
        assert_eq!(pair[1].seq, pair[0].seq + 1);
    }
    let lossy = |r: &&Report| r.warnings.contains(Warning::LostFrames);
    assert!(reports.iter().any(|r| lossy(&r)), "lost frames are said");
    for report in reports.iter().filter(|r| r.window_s > 0.9) {
        assert!(is_right(report), "{report:?}");
    }
}

/// Opens like [`a_camera_that_fails_is_opened_anew_and_nothing_stops`]'s, but the camera is there and falls silent.
#[test]
fn a_camera_that_falls_silent_is_opened_anew() {
    let (mut ours, _theirs, name) = terminal();
    let mut config = config(&name, "");
    config.service.silence_s = 0.3;
    let shared = Shared::new(config.settings);
    let opened = Mutex::new(Vec::new());
    let mut open = |_: &Config| -> Result<Box<dyn Source>, CameraError> {
        opened.lock().unwrap().push(Instant::now());
        Ok(Box::new(Simulated::new(Scene {
            stuck_after: Some(150),
            ..scene()
        })))
    };
    let heard = std::thread::scope(|scope| {
        let listener = scope.spawn(|| {
            let heard = listen(
                &mut ours,
                |m| matches!(m, Message::Report { report, .. } if report.seq >= 5),
            );
            shared.stop.store(true, Ordering::Relaxed);
            heard
        });
        run::run(&config, &shared, &mut open).unwrap();
        listener.join().unwrap()
    });
    let opened = opened.into_inner().unwrap();
    assert!(opened.len() >= 2, "{opened:?}");
    for pair in opened.windows(2) {
        // Silence first, then the shortest wait: it had worked in between.
        assert!(
            pair[1] - pair[0] >= Duration::from_millis(800),
            "{opened:?}"
        );
    }
    let full = |r: &&Report| r.window_s > 0.9;
    assert!(reports(&heard).iter().filter(full).all(is_right));
}

#[test]
fn a_camera_that_never_works_is_tried_at_longer_and_longer_intervals() {
    let config = config("/nonexistent/port", "");
    let shared = Shared::new(config.settings);
    let mut opened = Vec::new();
    let mut open = |_: &Config| -> Result<Box<dyn Source>, CameraError> {
        opened.push(Instant::now());
        shared.stop.store(opened.len() == 4, Ordering::Relaxed);
        Err(CameraError::Refused("it is in use".to_owned()))
    };
    run::run(&config, &shared, &mut open).unwrap();
    let waits: Vec<_> = opened
        .windows(2)
        .map(|w| (w[1] - w[0]).as_secs_f64())
        .collect();
    for (wait, least) in waits.iter().zip([0.5, 1.0, 2.0]) {
        assert!(*wait >= least, "{waits:?}");
    }
    assert_eq!(opened.len(), 4);
}

/// At one frame rate a tone at its double stands still in the picture; at two it moves.
#[test]
fn two_frame_rates_show_what_hides_at_a_multiple_of_one() {
    let hears = |two: bool| {
        let (mut ours, _theirs, name) = terminal();
        let config = config(&name, &format!("two_frame_rates = {two}"));
        let shared = Shared::new(config.settings);
        let mut open = |_: &Config| -> Result<Box<dyn Source>, CameraError> {
            let scene = scene();
            let hidden = Tone {
                hz: 2e9 / scene.frame_period_ns as f64,
                px: 0.3,
            };
            let tones = vec![hidden, Tone { hz: 97.3, px: 0.4 }];
            Ok(Box::new(Simulated::new(Scene { tones, ..scene })))
        };
        std::thread::scope(|scope| {
            let service = scope.spawn(|| run::run(&config, &shared, &mut open).unwrap());
            let heard = listen(
                &mut ours,
                |m| matches!(m, Message::Report { report, .. } if report.seq >= 5),
            );
            shared.stop.store(true, Ordering::Relaxed);
            service.join().unwrap();
            reports(&heard).pop().unwrap()
        })
    };
    let px_at = |report: &Report, hz: f32| {
        let near = report.peaks.iter().find(|p| (p.hz - hz).abs() < 0.2);
        near.map(|p| p.amplitude_px)
    };
    let (one, two) = (hears(false), hears(true));
    assert_eq!(px_at(&one, 120.0), None, "{one:?}");
    let found = px_at(&two, 120.0).expect("the hidden tone");
    assert!((found - 0.3).abs() < 0.03, "{two:?}");
    for report in [&one, &two] {
        let found = px_at(report, 97.3).expect("the other tone");
        assert!((found - 0.4).abs() < 0.04, "{report:?}");
        assert_eq!(report.lost_frames, 0, "{report:?}");
    }
}

#[test]
fn settings_over_the_line_change_what_is_measured_and_the_last_report_is_sent() {
    use std::io::Write;
    let (mut ours, _theirs, name) = terminal();
    let config = config(&name, "");
    let shared = Shared::new(config.settings);
    let mut open = |_: &Config| -> Result<Box<dyn Source>, CameraError> {
        Ok(Box::new(Simulated::new(Scene {
            paced: true,
            ..scene()
        })))
    };
    std::thread::scope(|scope| {
        let service = scope.spawn(|| run::run(&config, &shared, &mut open).unwrap());
        listen(&mut ours, |m| matches!(m, Message::Report { .. }));
        ours.write_all(b"set window 0.5 hop 0.25 max-peaks 1\n")
            .unwrap();
        let heard = listen(
            &mut ours,
            |m| matches!(m, Message::Report { report, .. } if report.window_s < 0.6),
        );
        assert!(
            heard
                .iter()
                .any(|m| matches!(m, Message::Reply(reply) if reply.ok))
        );
        let last = reports(&heard).pop().unwrap();
        assert_eq!(last.peaks.len(), 1);
        ours.write_all(b"set roi 10,10,151,10\n").unwrap();
        let heard = listen(&mut ours, |m| matches!(m, Message::Reply(_)));
        let Some(Message::Reply(reply)) = heard.last() else {
            panic!("{heard:?}");
        };
        assert!(!reply.ok && reply.text.contains("160"), "{reply:?}");
        std::thread::sleep(Duration::from_millis(200));
        shared.stop.store(true, Ordering::Relaxed);
        let after = listen(&mut ours, |m| matches!(m, Message::Report { .. }));
        assert!(!reports(&after).is_empty());
        service.join().unwrap();
    });
}

#[test]
fn the_line_path_allocates_nothing_once_it_runs() {
    let config = config("-", "");
    let scene = scene();
    let mut source = Simulated::new(scene);
    let setup = Setup::new(source.facts(), &config, &config.settings).unwrap();
    let mut memory = Memory::new(&setup);
    let (tracker, storage) = memory.lend();
    let clock = FrameClock::new(None, source.facts().frame_period_ns);
    let mut lines = Lines::new(&setup, clock, tracker, storage.collected).unwrap();
    let mut reporter =
        rowtone::pipeline::Reporter::new(setup.spectrum, setup.group, storage.estimator).unwrap();
    // The camera draws its first frame into new memory.
    source.next(Duration::ZERO, &mut |_| {}).unwrap();
    let before = allocations();
    let mut right = 0;
    for _ in 0..300 {
        let frame = source.next(Duration::ZERO, &mut |frame| {
            lines.frame(&frame, &mut |collector| {
                collector.hand_over(&mut reporter);
                right += u32::from(is_right(&reporter.report()));
            });
        });
        frame.unwrap();
    }
    assert_eq!(allocations(), before);
    assert!(right >= 5, "{right}");
}
