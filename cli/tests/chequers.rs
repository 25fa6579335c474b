//! A picture that cannot be followed along its columns.

mod common;

use common::{file, on_clip, reports, texts};

const SIZE: (usize, usize) = (128, 160);
const FRAMES: usize = 90;
const FPS: f64 = 60.0;
const HZ: f64 = 83.1;
const PX: f64 = 0.3;

/// Soft chequers of three pixels that swing along the rows, as Y4M. Exposed for no time, so that the program, which is told 500 µs,
/// makes 0.3 % more of them.
fn chequers() -> Vec<u8> {
    let mut bytes = format!("YUV4MPEG2 W{} H{} F60:1 Cmono\n", SIZE.0, SIZE.1).into_bytes();
    let mut state = 7_u64;
    let mut noise = || {
        let mut sum = 0.0;
        for _ in 0..4 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            sum += (state >> 40) as f64 / (1 << 24) as f64 - 0.5;
        }
        sum * 3.0
    };
    let wave = |at: f64| (std::f64::consts::TAU * at / 6.0).sin();
    for frame in 0..FRAMES {
        bytes.extend_from_slice(b"FRAME\n");
        for y in 0..SIZE.1 {
            let t = frame as f64 / FPS + (y as f64 * 100.0 + 250.0) * 1e-6;
            let shift = PX * (std::f64::consts::TAU * HZ * t).sin();
            for x in 0..SIZE.0 {
                let light = wave(x as f64 - shift) * wave(y as f64 + 0.35);
                bytes.push((110.0 + 65.0 * light + noise()).round() as u8);
            }
        }
    }
    bytes
}

/// Read against rows that look alike, most rows were lost and nothing was told; seeds are fixed.
#[test]
fn chequers_are_measured_along_the_rows() {
    let clip = file("chequers.y4m", &chequers());
    let output = on_clip("analyze", &clip, &["--format", "json"]);
    let (stdout, stderr) = texts(&output);
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("cannot be followed along its columns"),
        "{stderr}"
    );
    for report in reports(&stdout) {
        let peaks = report["peaks"].as_array().expect("peaks");
        assert_eq!(peaks.len(), 1, "{report}");
        let value = |key: &str| peaks[0][key].as_f64().expect("a number");
        assert!((value("hz") - HZ).abs() < 0.01, "{report}");
        assert!((value("x_px") / PX - 1.0).abs() < 0.01, "{report}");
        assert!(peaks[0]["y_px"].is_null(), "{report}");
    }
}
