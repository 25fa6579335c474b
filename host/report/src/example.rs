//! A report to try things on.

use rowtone::report::{Peak, Report, Warning, Warnings};

/// A report with two peaks and two warnings, for tests and documentation.
pub fn example(um_per_px: Option<f32>) -> Report {
    let peak = |hz, amplitude_px| Peak {
        hz,
        hz_sd: 0.0004,
        amplitude_px,
        amplitude_px_sd: 0.0002,
        snr_db: 61.2,
        ambiguous: false,
        track: 1,
        harmonic: None,
        motion: None,
    };
    Report {
        seq: 3,
        time_ms: 2500,
        window_s: 1.0,
        fps: 60.0,
        lines: 18000,
        lost_frames: 2,
        noise_px: 0.0131,
        peaks: [peak(49.2003, 0.3998), peak(1500.0, 0.02)]
            .into_iter()
            .collect(),
        warnings: Warnings::of(Warning::LostFrames).union(Warnings::of(Warning::Occluded)),
        um_per_px,
        velocity_mm_s_rms: None,
        line_time_us_fit: None,
        noise_floor: Default::default(),
        other_px_rms: 0.0,
        broad_band: None,
    }
}
