//! A calibration, written for people.

use rowtone_calibrate::Calibration;
use rowtone_calibrate::file::RollingName;

/// The calibration for people, by a light or by a tone in the motion.
pub(super) fn text(c: &Calibration, is_tone: bool) -> String {
    let mut lines = vec![
        format!("rows               {}", c.rows),
        format!("frames used        {}", c.frames),
        format!(
            "{}              {} Hz",
            if is_tone { "tone " } else { "light" },
            with_sd(c.light_hz, c.light_hz_sd, 1.0)
        ),
        format!(
            "periods a frame    {}",
            with_sd(c.periods_per_frame, c.periods_per_frame_sd, 1.0)
        ),
        format!(
            "read-out           {} ms ({} line times)",
            with_sd(c.readout_s, c.readout_s_sd, 1e3),
            c.rows
        ),
        // What others call the read-out of so many rows: from the start of the first row to that of the last.
        format!(
            "first to last row  {} ms ({} line times)",
            with_sd(
                first_to_last(c.readout_s, c.rows),
                first_to_last(c.readout_s_sd, c.rows),
                1e3
            ),
            c.rows.saturating_sub(1)
        ),
        format!(
            "line time          {} µs",
            with_sd(c.line_time_s, c.line_time_s_sd, 1e6)
        ),
    ];
    for (name, value, sd, scale, unit) in [
        (
            "frame period    ",
            c.frame_period_s,
            c.frame_period_s_sd,
            1e3,
            "ms",
        ),
        ("blank time      ", c.blank_s, c.blank_s_sd, 1e3, "ms"),
        ("exposure        ", c.exposure_s, c.exposure_s_sd, 1e6, "µs"),
    ] {
        lines.push(match value {
            Some(value) => format!(
                "{name}   {} {unit}",
                with_sd(value, sd.unwrap_or(0.0), scale)
            ),
            None => format!("{name}   not told"),
        });
    }
    let rolling = match c.rolling {
        Some(RollingName::Down) => "down (row 0 first)",
        Some(RollingName::Up) => "up (last row first)",
        None => "not told",
    };
    lines.push(format!("rolling            {rolling}"));
    if !is_tone {
        lines.push(format!("stripe contrast    {:.1} %", 100.0 * c.contrast));
    }
    lines.join("\n") + "\n"
}

/// Of `rows` line times, all but one.
fn first_to_last(readout_s: f64, rows: u32) -> f64 {
    readout_s * f64::from(rows.saturating_sub(1)) / f64::from(rows.max(1))
}

/// `value ± sd` with as many digits as the standard deviation calls for (two of it).
fn with_sd(value: f64, sd: f64, scale: f64) -> String {
    let (value, sd) = (value * scale, sd * scale);
    if sd <= 0.0 || !sd.is_finite() {
        return format!("{value}");
    }
    let digits = (1.0 - sd.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.digits$} ± {sd:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The real frame of docs/results.md: its owner counts 1079 line times.
    #[test]
    fn both_read_outs_are_told() {
        let c = Calibration {
            rows: 1080,
            readout_s: 15.7440e-3,
            readout_s_sd: 0.6e-6,
            ..Calibration::default()
        };
        let text = text(&c, false);
        assert!(
            text.contains("read-out           15.74400 ± 0.00060 ms (1080 line times)"),
            "{text}"
        );
        assert!(
            text.contains("first to last row  15.72942 ± 0.00060 ms (1079 line times)"),
            "{text}"
        );
    }

    #[test]
    fn digits_follow_the_standard_deviation() {
        assert_eq!(with_sd(15.730_123, 0.004_2, 1.0), "15.7301 ± 0.0042");
        assert_eq!(with_sd(1000.0, 0.0, 1.0), "1000");
    }
}
