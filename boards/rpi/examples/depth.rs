//! What it costs to look at the upper 8 bits only of 10-bit pixels.
//!
//! `cargo run --release -p rowtone-rpi --example depth`
//!
//! A textured scene moves by 0.2 px; its pixels have the noise of their light (so many electrons at full scale: the
//! full well over the gain), 3 electrons of reading noise and a black level of 64. Each row's noise is measured with
//! all 10 bits and with the upper 8, on the same frames.

use std::f64::consts::TAU;

use rowtone::camera::RawFormat;
use rowtone::pipeline::Reporter;
use rowtone_chance::{Chance, XorShift};
use rowtone_rpi::capture::simulated::{Scene, Simulated};
use rowtone_rpi::capture::{Facts, Frame, Shape, Source};
use rowtone_rpi::clock::FrameClock;
use rowtone_rpi::config::Config;
use rowtone_rpi::lines::Lines;
use rowtone_rpi::memory::Memory;
use rowtone_rpi::setup::Setup;

const WIDTH: usize = 320;
const HEIGHT: u16 = 120;
const FRAMES: u32 = 140;
const PERIOD_NS: i64 = 16_666_667;
const LINE_TIME_S: f64 = 66e-6;

/// A frame as the sensor packs it.
fn draw(scene: &Scene, frame: u32, electrons: f64, light: f64, noise: &mut XorShift) -> Vec<u8> {
    let mut bytes = Vec::new();
    for y in 0..HEIGHT {
        let time_s = f64::from(frame) * PERIOD_NS as f64 * 1e-9 + f64::from(y) * LINE_TIME_S;
        let d = scene.shift_px(time_s);
        let mut pixels = [0u16; WIDTH];
        for (x, pixel) in pixels.iter_mut().enumerate() {
            let (u, row) = (x as f64 - d, f64::from(y));
            let shape = 0.5
                + 0.2 * (TAU * u / 13.7 + 0.9 * row).sin()
                + 0.15 * (TAU * u / 29.3 - 0.31 * row).sin()
                + 0.1 * (TAU * u / 8.9 + 1.7 * row).cos();
            let mean = electrons * light * shape;
            let read =
                mean + mean.max(0.0).sqrt() * noise.normal_between() + 3.0 * noise.normal_between();
            *pixel = (64.0 + read / electrons * 959.0).round().clamp(0.0, 1023.0) as u16;
        }
        for group in pixels.chunks_exact(4) {
            let low = (0..4).fold(0, |low, i| low | (group[i] & 3) << (2 * i));
            bytes.extend(group.iter().map(|p| (p >> 2) as u8));
            bytes.push(low as u8);
        }
    }
    bytes
}

/// Noise of a row over a second of frames, px.
fn noise_px(frames: &[Vec<u8>], facts: &Facts, full_depth: bool) -> f32 {
    let text = format!("[camera]\nfull_depth = {full_depth}\nexposure_us = 1\nlearn_frames = 30");
    let config = Config::parse(&text, "example").expect("a good configuration");
    let setup = Setup::new(facts, &config, &config.settings).expect("a good setup");
    let mut memory = Memory::new(&setup);
    let (tracker, storage) = memory.lend();
    let clock = FrameClock::new(None, Some(PERIOD_NS));
    let mut lines = Lines::new(&setup, clock, tracker, storage.collected).expect("good");
    let mut reporter = Reporter::new(setup.spectrum, setup.group, storage.estimator).expect("good");
    let mut noise = f32::NAN;
    for (sequence, bytes) in (0..).zip(frames) {
        let frame = Frame {
            sequence,
            start_ns: Some(i64::from(sequence) * PERIOD_NS),
            bytes,
            intact: true,
        };
        lines.frame(&frame, &mut |collector| {
            collector.hand_over(&mut reporter);
            noise = reporter.report().noise_px;
        });
    }
    noise
}

fn main() {
    let scene = Scene::default();
    let mut facts = Simulated::new(scene.clone()).facts().clone();
    facts.shape = Shape {
        width: WIDTH as u16,
        height: HEIGHT,
        stride: RawFormat::Packed10.bytes(WIDTH),
        format: RawFormat::Packed10,
        bayer: false,
    };
    println!("electrons at full scale, light | noise of a row, px: 10 bits, upper 8 bits | more");
    for (electrons, light) in [
        (8000.0, 0.9),
        (8000.0, 0.1),
        (2000.0, 0.9),
        (2000.0, 0.1),
        (500.0, 0.9),
        (500.0, 0.1),
    ] {
        let mut noise = XorShift(0x9e37_79b9_7f4a_7c15);
        let frames: Vec<_> = (0..FRAMES)
            .map(|frame| draw(&scene, frame, electrons, light, &mut noise))
            .collect();
        let (all, upper) = (
            noise_px(&frames, &facts, true),
            noise_px(&frames, &facts, false),
        );
        println!(
            "{electrons:5} {:3.0} % | {all:.5} {upper:.5} | {:+.1} %",
            100.0 * light,
            100.0 * (upper / all - 1.0)
        );
    }
}
