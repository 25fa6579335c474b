//! `rowtone_clip::ffmpeg`: any bytes as ffprobe's answer and as lines of ffmpeg's standard error; and any steps
//! as frame times.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowtone_clip::ffmpeg::showinfo::{Said, understand};
use rowtone_clip::ffmpeg::{Luma, probe};
use rowtone_clip::grid::{Rounding, rounding};
use rowtone_clip::{Clock, Stamped, Times};

/// What is understood is a video that can be measured, and its times make a clock that runs forward.
fn answer(bytes: &[u8]) {
    let Ok(found) = probe::parse(bytes) else { return };
    assert!(found.width > 0 && found.height > 0);
    assert!(found.key_frames <= found.frames);
    assert!([0, 90, 180, 270].contains(&found.rotation_deg));
    assert!(found.times_ns.windows(2).all(|pair| pair[0] <= pair[1]));
    assert!((8..=16).contains(&Luma::of(&found.pixel_format).bits));
    run_clock(&found.times_ns, found.fps);
}

fn run_clock(times_ns: &[i64], fps: Option<f64>) {
    let Some(stamped) = Stamped::new(times_ns.to_vec(), fps, None) else { return };
    let mut clock = Clock::Stamped(stamped);
    let mut last = None;
    for (index, &stamp) in (0..).zip(times_ns) {
        let Some((number, _)) = clock.frame(index, Some(stamp)) else { panic!("a stamp without a time") };
        assert!(last.is_none_or(|last| last < number || number == u32::MAX));
        last = Some(number);
    }
}

/// Frame times of any steps, some of them a millisecond's multiples.
fn steps(bytes: &[u8]) {
    let unit = if bytes.first().is_some_and(|b| b & 1 == 0) { 1_000_000 } else { 1 };
    let times: Vec<i64> = bytes
        .chunks_exact(4)
        .scan(0_i64, |time, step| {
            *time += (1 + i64::from(u32::from_le_bytes([step[0], step[1], step[2], 0]))) * unit;
            Some(*time)
        })
        .collect();
    if let Rounding::Grid(grid, places) = rounding(&times) {
        assert!(grid.period_ns > 0.0 && places.len() == times.len());
        assert!(places.windows(2).all(|pair| pair[0] < pair[1]));
    }
    if let Some(times) = Times::new(times.clone(), None) {
        assert!(times.fps() > 0.0);
    }
    run_clock(&times, None);
}

fuzz_target!(|data: &[u8]| {
    answer(data);
    steps(data);
    for line in String::from_utf8_lossy(data).lines() {
        if let Said::TimeBase(base) = understand(line) {
            assert!(base.value() > 0.0);
        }
    }
});
