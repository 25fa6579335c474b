//! Nothing is lost, whatever goes away.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::time::{Duration, Instant};

use rowtone::wire::Format;
use serialport::TTYPort;

use crate::board::{Board, line};
use crate::broker::{Broker, subscribe};
use crate::{JSON, assert_all, board_and_number, config, dir, ports, run};

/// Every board says these reports, so far apart.
fn say(ports: &mut [TTYPort], numbers: std::ops::Range<u32>, period: Duration) {
    for seq in numbers {
        for port in &mut *ports {
            port.write_all(&line(seq)).unwrap();
        }
        std::thread::sleep(period);
    }
}

/// The broker goes and comes back, and so does the gateway: every report arrives, in order.
#[test]
fn nothing_is_lost_while_the_broker_or_the_gateway_is_away() {
    const PERIOD: Duration = Duration::from_millis(20);
    let dir = dir("away");
    let Some(mut broker) = Broker::lasting(&dir) else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let (mut ports, _slaves, names) = ports(3);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let mut gateway = run(&config, &[]);
    std::thread::sleep(Duration::from_millis(500));
    say(&mut ports, 0..20, PERIOD);
    broker.stop();
    say(&mut ports, 20..40, PERIOD);
    // Killed while the broker is away: what it heard lies on disk.
    std::thread::sleep(Duration::from_millis(500));
    drop(gateway);
    gateway = run(&config, &[]);
    say(&mut ports, 40..60, PERIOD);
    assert!(broker.go());
    say(&mut ports, 60..80, PERIOD);
    let again = assert_all(&heard, 3, 80);
    println!("80 reports of 3 boards, {again} came again");
    drop((gateway, broker));
    std::fs::remove_dir_all(dir).unwrap();
}

/// `kill -9` of a broker that keeps everything in memory, so many times, while reports go through it.
fn kills(name: &str, kills: u32) {
    const PERIOD: Duration = Duration::from_millis(5);
    const EACH: u32 = 300;
    let dir = dir(name);
    let Some(mut broker) = Broker::start(&dir, "allow_anonymous true\npersistence false") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let (mut ports, _slaves, names) = ports(3);
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let gateway = run(&config, &[]);
    std::thread::sleep(Duration::from_millis(500));
    let count = EACH * (kills + 1);
    let talk = std::thread::spawn(move || {
        let start = Instant::now();
        for seq in 0..count {
            say(&mut ports, seq..seq + 1, Duration::ZERO);
            if seq % EACH == EACH - 1 {
                // The gateway is back and busy when the next kill comes.
                std::thread::sleep(Duration::from_millis(2500));
            } else {
                std::thread::sleep((PERIOD * seq).saturating_sub(start.elapsed()).min(PERIOD));
            }
        }
        ports
    });
    for kill in 0..kills {
        // In the middle of a stretch: while reports are under way.
        std::thread::sleep(PERIOD * EACH / 2);
        broker.kill();
        std::thread::sleep(Duration::from_millis(200));
        assert!(broker.go());
        let rest = PERIOD * EACH / 2 + Duration::from_millis(2300);
        if kill + 1 < kills {
            std::thread::sleep(rest);
        }
    }
    let again = assert_all(&heard, 3, count);
    println!("{count} reports of 3 boards, {kills} kills, {again} came again");
    let _ports = talk.join().unwrap();
    drop((gateway, broker));
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_broker_that_is_killed_loses_nothing() {
    kills("killed", 1);
}

#[test]
#[ignore = "takes a minute"]
fn a_broker_that_is_killed_ten_times_loses_nothing() {
    kills("killed-ten", 10);
}

/// What a board says while no gateway listens is asked for when one is back, also on a cable that
/// harms one byte in 3000 both ways.
#[test]
fn what_was_said_while_the_gateway_was_away_is_asked_for() {
    let dir = dir("asked");
    let Some(broker) = Broker::start(&dir, "allow_anonymous true") else {
        return;
    };
    let (_client, heard) = subscribe(broker.port, "plant/+/report");
    let period = Duration::from_millis(25);
    let boards = [(Format::Text, 5), (Format::Binary, 6)]
        .map(|(wire, seed)| Board::start(wire, period, 1.0 / 3000.0, seed));
    let names: Vec<String> = boards.iter().map(|board| board.port.clone()).collect();
    let config = config(&dir, &format!("port = {}", broker.port), JSON, &names);
    let gateway = run(&config, &[]);
    std::thread::sleep(Duration::from_millis(1500));
    drop(gateway);
    boards.iter().for_each(|board| board.unplug(true));
    std::thread::sleep(Duration::from_millis(500));
    boards.iter().for_each(|board| board.unplug(false));
    let gateway = run(&config, &[]);
    std::thread::sleep(Duration::from_millis(1000));
    // All up to now came, from the first on that did.
    let last = u64::from(boards.iter().map(Board::made).min().unwrap()) - 1;
    let (mut numbers, mut again) = (BTreeMap::<String, BTreeSet<u64>>::new(), 0);
    let complete = |numbers: &BTreeSet<u64>| {
        let first = *numbers.first().unwrap();
        (first..=last).all(|seq| numbers.contains(&seq))
    };
    let end = Instant::now() + Duration::from_secs(40);
    while numbers.len() < 2 || !numbers.values().all(complete) {
        let left = end.saturating_duration_since(Instant::now());
        let Ok((_, message)) = heard.recv_timeout(left) else {
            let missing: Vec<Vec<u64>> = numbers
                .values()
                .map(|numbers| (0..=last).filter(|seq| !numbers.contains(seq)).collect())
                .collect();
            panic!("not all up to {last} came: {missing:?}");
        };
        let (board, seq) = board_and_number(&message);
        again += u32::from(!numbers.entry(board).or_default().insert(seq));
    }
    for (board, numbers) in &numbers {
        let first = *numbers.first().unwrap();
        assert!(first < last / 2, "{board}: the gateway came late");
        println!("{board}: {first} to {last} all came");
    }
    let harmed: Vec<u32> = boards.iter().map(Board::harmed).collect();
    println!("{again} came again, harm was done {harmed:?} times");
    assert!(harmed.iter().all(|&harmed| harmed > 0));
    drop((gateway, broker, boards));
    std::fs::remove_dir_all(dir).unwrap();
}
