//! The recordings of `rowtone sweep cameras --seed 71` that stand out, filmed again with other noise (and
//! of photographs another picture): is it the recording or
//! chance? A study that prints (docs/spectrum.md has what it said): `cargo test -p rowtone-lab --test camera_again -- --ignored --nocapture`.

use host_sim::Camera;
use rowtone_lab::spectrum_scenes::cameras::Recording;
use rowtone_lab::spectrum_scenes::table::camera_kinds;

/// Kind, number, how often.
const RECORDINGS: [(usize, u64, u64); 4] = [(0, 16, 40), (0, 39, 40), (1, 14, 40), (1, 49, 150)];

#[test]
#[ignore = "takes a minute and prints"]
fn with_other_noise() {
    for (kind, number, times) in RECORDINGS {
        let kind = &camera_kinds()[kind];
        let recording = Recording::draw(&kind.ranges, 71, number).expect("a possible camera");
        let tones = &recording.truth.tones;
        // Count; frequency and amplitude over their bounds: sum of squares, sum.
        let mut sums = vec![[0.0_f64; 5]; tones.len()];
        println!("{} {number}, {times} times", kind.name);
        for noise in 0..times {
            let mut again = recording.clone();
            let mut config = recording.camera.config().clone();
            config.seed += 77 * noise;
            again.camera = Camera::new(config).expect("a camera");
            for peak in again.analyze().expect("a report").peaks {
                let hz = f64::from(peak.hz);
                let reach = 0.5 / recording.truth.window_s;
                let near = tones.iter().position(|t| (t.hz - hz).abs() < reach);
                let Some(i) = near else {
                    let sds = peak.amplitude_px / peak.amplitude_px_sd;
                    println!("  noise {noise}: {hz:.2} Hz is no tone, {sds:.1} deviations");
                    continue;
                };
                let off_hz = (hz - tones[i].hz) / tones[i].hz_bound;
                let off_px = f64::from(peak.amplitude_px) - tones[i].amplitude_px;
                let off_px = off_px / tones[i].amplitude_bound_px;
                let more = [1.0, off_hz * off_hz, off_hz, off_px * off_px, off_px];
                sums[i].iter_mut().zip(more).for_each(|(s, m)| *s += m);
            }
        }
        for (tone, [n, hz2, hz, px2, px]) in tones.iter().zip(sums) {
            println!(
                "  {:8.2} Hz {:.4} px, found {n}: frequency mean {:+.2} rms {:.2}, amplitude mean {:+.2} rms {:.2} bounds of {:.2} %",
                tone.hz,
                tone.amplitude_px,
                hz / n,
                (hz2 / n).sqrt(),
                px / n,
                (px2 / n).sqrt(),
                100.0 * tone.amplitude_bound_px / tone.amplitude_px
            );
            assert!(n >= 0.9 * times as f64);
        }
    }
}
