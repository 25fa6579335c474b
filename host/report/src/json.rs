//! Reports as JSON Lines: one object a line, keys and units as `docs/` and `rowtone analyze --help` say.

use rowtone::report::{Motion, Peak, PeakShape, Report, ShapeRow};
use serde::Serialize;

use super::broad::{BroadBandObject, velocity_mm_s};
use super::zone::ZoneLimits;
use super::{band_velocity, velocity_mm_s_rms};

#[derive(Serialize)]
struct ReportObject {
    seq: u32,
    t_s: f64,
    window_s: f32,
    fps: f32,
    lines: u32,
    lost_frames: u16,
    noise_px: f32,
    #[serde(flatten)]
    place: Option<Place>,
    /// `null` where a recording was measured without a scale; a wire's report without one has no such key.
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_mm_s_rms: Option<Option<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zone: Option<char>,
    /// Where the noise could hide so much that it would be in a worse one.
    #[serde(skip_serializing_if = "Option::is_none")]
    zone_at_most: Option<char>,
    /// `null` where a recording was measured and the camera cannot know.
    #[serde(skip_serializing_if = "Option::is_none")]
    broad_band: Option<Option<BroadBandObject>>,
    peaks: Vec<PeakObject>,
    #[serde(skip_serializing_if = "Option::is_none")]
    timing: Option<TimingObject>,
    #[serde(skip_serializing_if = "Option::is_none")]
    noise_floor: Option<Vec<[f32; 2]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    other_px_rms: Option<f32>,
    warnings: Vec<&'static str>,
}

#[derive(Serialize)]
struct PeakObject {
    hz: f32,
    hz_sd: f32,
    amplitude_px: f32,
    amplitude_px_sd: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    amplitude_um: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_mm_s_rms: Option<f32>,
    snr_db: f32,
    ambiguous: bool,
    track: u16,
    #[serde(skip_serializing_if = "Option::is_none")]
    harmonic: Option<u8>,
    #[serde(flatten)]
    motion: Option<MotionObject>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shape: Option<Vec<RowObject>>,
}

/// What only those know who measured: it is on no wire of version 1.
#[derive(Serialize)]
struct MotionObject {
    x_px: Option<f32>,
    x_px_sd: Option<f32>,
    y_px: Option<f32>,
    y_px_sd: Option<f32>,
    phase_rad: f32,
    y_phase_rad: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    across_rad: Option<f32>,
    rigid: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    decay_s: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    hz_per_s: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    modulation: Option<ModulationObject>,
    #[serde(skip_serializing_if = "Option::is_none")]
    spread_hz: Option<f32>,
}

/// How a tone swings: `of` is `amplitude` or `phase`.
#[derive(Serialize)]
struct ModulationObject {
    hz: f32,
    depth: f32,
    of: &'static str,
}

impl MotionObject {
    fn new(motion: &Motion) -> Self {
        Self {
            x_px: motion.x_px,
            x_px_sd: motion.x_px_sd,
            y_px: motion.y_px,
            y_px_sd: motion.y_px_sd,
            phase_rad: motion.phase_rad,
            y_phase_rad: motion.y_phase_rad,
            across_rad: motion.across_rad,
            rigid: motion.rigid,
            decay_s: motion.decay_s,
            hz_per_s: motion.hz_per_s,
            modulation: motion.modulation.map(|m| ModulationObject {
                hz: m.hz,
                depth: m.depth,
                of: if m.of_phase { "phase" } else { "amplitude" },
            }),
            spread_hz: motion.spread_hz,
        }
    }
}

#[derive(Serialize)]
struct RowObject {
    row: u16,
    x_px: Option<f32>,
    x_phase_rad: Option<f32>,
    y_px: Option<f32>,
    y_phase_rad: Option<f32>,
}

impl RowObject {
    /// A row of a peak of which so much is known along either axis.
    fn new(row: &ShapeRow, motion: Option<&Motion>) -> Self {
        let known = |axis: fn(&Motion) -> Option<f32>| motion.is_some_and(|m| axis(m).is_some());
        let (x, y) = (known(|m| m.x_px), known(|m| m.y_px));
        Self {
            row: row.row,
            x_px: x.then_some(row.x_px),
            x_phase_rad: x.then_some(row.x_phase_rad),
            y_px: y.then_some(row.y_px),
            y_phase_rad: y.then_some(row.y_phase_rad),
        }
    }
}

/// What of the picture was measured.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Place {
    /// The part: x, y, width and height in the picture as given, before it is turned.
    pub roi: [usize; 4],
    /// `x` or `xy`.
    pub axes: &'static str,
}

#[derive(Serialize)]
struct TimingObject {
    line_time_us_fit: Option<f32>,
}

impl PeakObject {
    fn new(peak: &Peak, um_per_px: Option<f32>, shapes: &[PeakShape]) -> Self {
        let shape = shapes.iter().find(|s| s.hz == peak.hz);
        let motion = peak.motion.as_ref();
        let amplitude_um = um_per_px.map(|scale| peak.amplitude_px * scale);
        Self {
            hz: peak.hz,
            hz_sd: peak.hz_sd,
            amplitude_px: peak.amplitude_px,
            amplitude_px_sd: peak.amplitude_px_sd,
            amplitude_um,
            velocity_mm_s_rms: amplitude_um
                .map(|um| velocity_mm_s_rms(peak.hz.into(), um.into()) as f32),
            snr_db: peak.snr_db,
            ambiguous: peak.ambiguous,
            track: peak.track,
            harmonic: peak.harmonic,
            motion: motion.map(MotionObject::new),
            shape: shape.map(|s| s.rows.iter().map(|r| RowObject::new(r, motion)).collect()),
        }
    }
}

/// One report as a JSON object, without a line feed.
pub fn report(report: &Report) -> String {
    zoned(report, None)
}

/// A JSON object with the keys of another at its end.
///
/// ```
/// let more = std::collections::BTreeMap::from([("b", 2)]);
/// assert_eq!(rowtone_report::json::extended(r#"{"a":1}"#.to_owned(), &more), r#"{"a":1,"b":2}"#);
/// ```
pub fn extended(mut object: String, more: &impl Serialize) -> String {
    // Numbers, strings and lists of them always serialise.
    let more = serde_json::to_string(more).unwrap_or_default();
    if let Some(more) = more.strip_prefix('{')
        && object.pop() == Some('}')
    {
        object.push(',');
        object.push_str(more);
    }
    object
}

/// The same, with the machine's zone where the limits are given and there is a scale.
pub fn zoned(report: &Report, limits: Option<&ZoneLimits>) -> String {
    to_string(report, &[], limits, None)
}

/// The same of a recording that was measured here: with what of the picture was measured, the shapes of those peaks that are
/// not rigid, and what the motion says of the time base.
pub fn measured(
    report: &Report,
    shapes: &[PeakShape],
    place: Place,
    limits: Option<&ZoneLimits>,
) -> String {
    let timing = TimingObject {
        line_time_us_fit: report.line_time_us_fit,
    };
    to_string(report, shapes, limits, Some((place, timing)))
}

fn to_string(
    report: &Report,
    shapes: &[PeakShape],
    limits: Option<&ZoneLimits>,
    here: Option<(Place, TimingObject)>,
) -> String {
    let (place, timing) = here.unzip();
    let velocity = band_velocity(report);
    let zone = limits.zip(velocity).map(|(limits, v)| limits.zone(v));
    let at_most = velocity_mm_s(report).map(|v| f64::from(v.at_most));
    let at_most = limits.zip(at_most).map(|(limits, v)| limits.zone(v));
    let object = ReportObject {
        seq: report.seq,
        t_s: report.time_ms as f64 / 1000.0,
        window_s: report.window_s,
        fps: report.fps,
        lines: report.lines,
        lost_frames: report.lost_frames,
        noise_px: report.noise_px,
        place,
        velocity_mm_s_rms: (place.is_some() || velocity.is_some())
            .then(|| velocity.map(|v| v as f32)),
        zone,
        zone_at_most: at_most.filter(|at_most| zone.is_some_and(|zone| zone != *at_most)),
        broad_band: (place.is_some() || report.broad_band.is_some()).then(|| {
            let known = report.broad_band.as_ref();
            known.map(|broad| BroadBandObject::new(broad, report.um_per_px))
        }),
        peaks: report
            .peaks
            .iter()
            .map(|peak| PeakObject::new(peak, report.um_per_px, shapes))
            .collect(),
        noise_floor: timing.is_some().then(|| {
            let points = report.noise_floor.iter();
            points.map(|p| [p.to_hz, p.px_per_sqrt_hz]).collect()
        }),
        other_px_rms: timing.as_ref().map(|_| report.other_px_rms),
        timing,
        warnings: report.warnings.names().collect(),
    };
    // Numbers, strings and lists of them always serialise; a number that is not finite becomes null.
    serde_json::to_string(&object).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::Place;
    use crate::example;
    use rowtone::report::{FloorPoint, Modulation, Motion, PeakShape, ShapeRow, Warning};

    const PAGE: &str = include_str!("../../../docs/json.md");

    #[test]
    fn the_page_names_every_warning_with_its_bit() {
        let (_, table) = PAGE.split_once("## Warnings").unwrap();
        for (bit, warning) in Warning::ALL.into_iter().enumerate() {
            let word = format!("`{}`", warning.name());
            let row = table.lines().find(|line| {
                line.starts_with("| `")
                    && line.split(" | ").next().is_some_and(|c| c.contains(&word))
            });
            let bits = row.and_then(|row| row.split(" | ").nth(1)).unwrap_or("");
            assert!(
                bits.split(", ").any(|b| b == bit.to_string()),
                "{word} has no row with bit {bit}: {row:?}"
            );
        }
    }

    /// Every key of an object and of those within it.
    fn keys(value: &serde_json::Value, found: &mut Vec<String>) {
        match value {
            serde_json::Value::Object(fields) => {
                for (key, value) in fields {
                    found.push(key.clone());
                    keys(value, found);
                }
            }
            serde_json::Value::Array(values) => values.iter().for_each(|v| keys(v, found)),
            _ => {}
        }
    }

    #[test]
    fn the_page_names_every_key() {
        let mut report = example(Some(100.0));
        report.noise_floor.push(FloorPoint::default()).unwrap();
        report.peaks[0].motion = Some(Motion {
            x_px: Some(0.3),
            x_px_sd: Some(0.001),
            y_px: Some(0.1),
            y_px_sd: Some(0.001),
            phase_rad: 0.3,
            y_phase_rad: Some(0.2),
            across_rad: Some(0.1),
            rigid: false,
            decay_s: Some(0.1),
            hz_per_s: Some(2.0),
            modulation: Some(Modulation {
                hz: 3.0,
                depth: 0.2,
                of_phase: false,
            }),
            spread_hz: Some(0.4),
        });
        report.peaks[0].harmonic = Some(1);
        let place = Place {
            roi: [0; 4],
            axes: "xy",
        };
        let shape = PeakShape {
            hz: report.peaks[0].hz,
            rows: [ShapeRow::default()].into_iter().collect(),
        };
        let json = super::measured(&report, &[shape], place, None);
        let mut found = Vec::new();
        keys(&serde_json::from_str(&json).unwrap(), &mut found);
        assert!(found.len() > 30, "{found:?}");
        for key in found {
            assert!(
                PAGE.contains(&format!("`{key}`")),
                "{key} is not on the page"
            );
        }
    }

    #[test]
    fn the_keys_are_the_contract() {
        assert_eq!(
            super::report(&example(None)),
            concat!(
                r#"{"seq":3,"t_s":2.5,"window_s":1.0,"fps":60.0,"lines":18000,"lost_frames":2,"#,
                r#""noise_px":0.0131,"peaks":[{"hz":49.2003,"hz_sd":0.0004,"amplitude_px":0.3998,"#,
                r#""amplitude_px_sd":0.0002,"snr_db":61.2,"ambiguous":false,"track":1},{"hz":1500.0,"#,
                r#""hz_sd":0.0004,"amplitude_px":0.02,"amplitude_px_sd":0.0002,"snr_db":61.2,"#,
                r#""ambiguous":false,"track":1}],"warnings":["lost_frames","occluded"]}"#
            )
        );
    }

    #[test]
    fn what_was_measured_here_has_its_motion_and_its_shape() {
        let mut report = example(None);
        report.peaks.truncate(1);
        let floor = FloorPoint {
            to_hz: 400.0,
            px_per_sqrt_hz: 0.001,
        };
        report.noise_floor = [floor].into_iter().collect();
        report.peaks[0].motion = Some(Motion {
            x_px: Some(0.3998),
            x_px_sd: Some(0.0002),
            phase_rad: 0.31,
            rigid: false,
            ..Motion::STEADY
        });
        let row = ShapeRow {
            row: 7,
            x_px: 0.25,
            x_phase_rad: -1.5,
            ..ShapeRow::default()
        };
        let shape = PeakShape {
            hz: report.peaks[0].hz,
            rows: [row].into_iter().collect(),
        };
        let place = Place {
            roi: [4, 0, 120, 300],
            axes: "x",
        };
        let text = super::measured(&report, &[shape], place, None);
        assert!(text.contains(
            r#""noise_px":0.0131,"roi":[4,0,120,300],"axes":"x","velocity_mm_s_rms":null,"broad_band":null,"peaks""#
        ));
        assert!(
            text.contains(concat!(
                r#""x_px":0.3998,"x_px_sd":0.0002,"y_px":null,"y_px_sd":null,"phase_rad":0.31,"#,
                r#""y_phase_rad":null,"rigid":false,"shape":[{"row":7,"x_px":0.25,"#,
                r#""x_phase_rad":-1.5,"y_px":null,"y_phase_rad":null}]}],"#,
                r#""timing":{"line_time_us_fit":null},"noise_floor":[[400.0,0.001]],"other_px_rms":0.0"#
            )),
            "{text}"
        );
    }

    #[test]
    fn a_scale_adds_micrometres_and_velocities() {
        let text = super::report(&example(Some(100.0)));
        let object: serde_json::Value = serde_json::from_str(&text).unwrap();
        let close = |value: &serde_json::Value, want: f64| {
            let value = value.as_f64().unwrap();
            assert!((value / want - 1.0).abs() < 1e-3, "{value} for {want}");
        };
        close(&object["peaks"][0]["amplitude_um"], 39.98);
        close(&object["peaks"][0]["velocity_mm_s_rms"], 8.7395);
        close(&object["velocity_mm_s_rms"], 8.7395);
        assert!(object.get("zone").is_none());
        let limits = "2.3,4.5,7.1".parse().unwrap();
        let text = super::zoned(&example(Some(100.0)), Some(&limits));
        assert!(text.contains(r#""zone":"D""#), "{text}");
        assert!(!super::zoned(&example(None), Some(&limits)).contains("zone"));
    }
}
