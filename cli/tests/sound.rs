//! `rowtone displacement --format wav` from the outside: a sound moves the object, and is heard again.

mod common;

use std::path::Path;

use common::{command, file, texts, y4m};
use host_sim::{Chirp, Config, Motion, Sound};
use rowtone_lab::sound::agreement::{Agreement, agree};
use rowtone_lab::sound::sounds;
use rowtone_measure::restore::butterworth::LowPass;
use rowtone_measure::restore::long;

/// Line time, µs, and rows: 7.4 ms of every 8.3 ms are read out, 11 % are blank.
const LINE_US: f64 = 61.7;
const ROWS: u32 = 120;
const FPS: f64 = 120.0;

/// A clip of `motion` at 120 frames a second, exposed for 100 µs.
fn config(motion: Motion, frames: u32, seed: u64) -> Config {
    let mut config = Config {
        seed,
        frames,
        motion,
        ..Config::default()
    };
    config.sensor.cols = 64;
    config.sensor.rows = ROWS;
    config.sensor.fps = FPS;
    config.sensor.line_time_ps = (LINE_US * 1e6) as u32;
    config.sensor.exposure_ns = 100_000;
    config
}

/// A WAV file that moves the object by 0.5 px at its loudest.
fn moved_by(name: &str, samples: &[f64]) -> Motion {
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: sounds::RATE_HZ as u32,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let path = file(name, &[]);
    let mut writer = hound::WavWriter::create(&path, spec).unwrap();
    for value in samples {
        writer.write_sample((value * 32_000.0) as i16).unwrap();
    }
    writer.finalize().unwrap();
    Motion {
        sound: Some(Sound::read(&path, 0.5).unwrap()),
        ..Motion::default()
    }
}

/// Runs the command; the sound and its rate.
fn heard(clip: &Path, more: &[&str]) -> (Vec<f64>, f64) {
    let wav = clip.with_extension("wav");
    let line = LINE_US.to_string();
    let args = [
        "displacement",
        clip.to_str().unwrap(),
        "--line-time-us",
        &line,
        "--exposure-us",
        "100",
        "-o",
        wav.to_str().unwrap(),
    ];
    let output = command(args.into_iter().chain(more.iter().copied()))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", texts(&output).1);
    let mut reader = hound::WavReader::open(wav).unwrap();
    let samples = reader.samples::<f32>().map(|s| s.unwrap().into()).collect();
    (samples, reader.spec().sample_rate.into())
}

/// Agreement with what the object really did, below 1000 Hz.
fn agreement(motion: &Motion, (sound, rate): &(Vec<f64>, f64)) -> Agreement {
    let mut truth: Vec<f64> = (0..sound.len())
        .map(|i| motion.at(i as f64 / rate))
        .collect();
    LowPass::new(long::ORDER, 1000.0, *rate).run_both_ways(&mut truth);
    agree(&truth, sound, *rate, 0.005)
}

#[test]
fn speech_is_heard_again_without_gaps() {
    let speech = sounds::vowels();
    // The loud middle of the first two syllables.
    let motion = moved_by("speech-in.wav", &speech[..8000]);
    let clip = file("speech.y4m", &y4m(config(motion.clone(), 120, 11)));
    let sound = heard(&clip, &[]);
    // No gaps: a second is there as a whole, at the rate of two rows.
    assert_eq!(sound.1, 8104.0);
    assert!(
        sound.0.len() > 8000 && sound.0.len() <= 8104,
        "{}",
        sound.0.len()
    );
    let mean = sound.0.iter().sum::<f64>() / sound.0.len() as f64;
    assert!(mean.abs() < 1e-6, "{mean}");
    let found = agreement(&motion, &sound);
    assert!(found.snr_db > 15.0, "{found:?}");
}

#[test]
fn a_chirp_is_heard_again() {
    let motion = Motion {
        chirps: vec![Chirp {
            from_hz: 100.0,
            to_hz: 900.0,
            start_s: 0.0,
            duration_s: 1.0,
            amplitude_px: 0.5,
        }],
        ..Motion::default()
    };
    let clip = file("chirp.y4m", &y4m(config(motion.clone(), 120, 12)));
    let found = agreement(&motion, &heard(&clip, &[]));
    assert!(found.snr_db > 15.0, "{found:?}");
}
