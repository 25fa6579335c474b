//! The load of a plant.

use std::io::Write;
use std::time::{Duration, Instant};

use crate::board::line;
use crate::broker::{Broker, subscribe};
use crate::{JSON, assert_all, config, dir, ports, run};

/// What a process used of processor and memory so far.
struct Use {
    cpu_s: f64,
    /// Most resident memory, MB.
    peak_mb: f64,
}

impl Use {
    fn of(pid: u32) -> Self {
        let read = |what| std::fs::read_to_string(format!("/proc/{pid}/{what}")).unwrap();
        let stat = read("stat");
        let fields: Vec<&str> = stat.rsplit(") ").next().unwrap().split(' ').collect();
        // 100 ticks a second on every usual Linux.
        let ticks = |at: usize| fields[at].parse::<f64>().unwrap() / 100.0;
        let status = read("status");
        let peak = status.lines().find(|line| line.starts_with("VmHWM:"));
        let kb: f64 = peak
            .and_then(|line| line.split_whitespace().nth(1)?.parse().ok())
            .unwrap();
        Self {
            cpu_s: ticks(11) + ticks(12),
            peak_mb: kb / 1024.0,
        }
    }
}

/// 200 boards at 2 reports a second each for a minute.
#[test]
#[ignore = "takes a minute"]
fn two_hundred_boards() {
    const BOARDS: usize = 200;
    const REPORTS: u32 = 120;
    let dir = dir("load");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let (mut ports, _slaves, names) = ports(BOARDS);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let gateway = run(&config, &[]);
    std::thread::sleep(Duration::from_secs(2));
    let pids = [gateway.0.id(), broker.id()];
    let before = pids.map(Use::of);
    let start = Instant::now();
    let talk = std::thread::spawn(move || {
        let step = Duration::from_millis(500) / BOARDS as u32;
        let mut late = Duration::ZERO;
        for seq in 0..REPORTS {
            let line = line(seq);
            for (number, port) in ports.iter_mut().enumerate() {
                port.write_all(&line).unwrap();
                // Spread over the half second, as boards are.
                let at = step * (seq * BOARDS as u32 + number as u32);
                late = late.max(start.elapsed().saturating_sub(at));
                std::thread::sleep(at.saturating_sub(start.elapsed()));
            }
        }
        (ports, late)
    });
    let again = assert_all(&heard, BOARDS, REPORTS);
    let seconds = start.elapsed().as_secs_f64();
    let after = pids.map(Use::of);
    let (_ports, late) = talk.join().unwrap();
    println!(
        "{BOARDS} boards, {} reports in {seconds:.1} s, none lost, in order, {again} came again \
         (the boards were late by up to {:.0} ms)",
        BOARDS * REPORTS as usize,
        late.as_secs_f64() * 1e3
    );
    for (name, (before, after)) in ["gateway", "mosquitto"]
        .iter()
        .zip(before.iter().zip(&after))
    {
        println!(
            "{name}: {:.1} % of one core, {:.1} MB at most",
            100.0 * (after.cpu_s - before.cpu_s) / seconds,
            after.peak_mb
        );
    }
    drop((gateway, broker));
    std::fs::remove_dir_all(dir).unwrap();
}
