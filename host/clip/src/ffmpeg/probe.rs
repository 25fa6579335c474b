//! What a video file holds, as ffprobe says it: no picture is decoded.

use std::path::Path;

use serde::Deserialize;

use super::programs;
use super::{Error, Ratio};

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// ffmpeg's name of the codec: `h264`, `hevc`, `mjpeg`, `prores`, ...
    pub codec: String,
    /// ffmpeg's names of the file's format, comma-separated: `mov,mp4,m4a,3gp,3g2,mj2`.
    pub format: String,
    /// Columns of the stored picture, at least 1.
    pub width: u16,
    /// Rows of the stored picture, at least 1.
    pub height: u16,
    /// ffmpeg's name of the pixel format: `yuv420p10le`.
    pub pixel_format: String,
    /// Values use the whole range; `None` where the file does not say.
    pub full_range: Option<bool>,
    /// By how much a player turns the picture clockwise, degrees: 0, 90, 180 or 270. It is only said: the
    /// stored rows are the sensor's.
    pub rotation_deg: u16,
    /// Usual frame rate by the file's own count, Hz.
    pub fps: Option<f64>,
    /// Unit of the frames' times, s, where the file holds times.
    pub time_base: Option<Ratio>,
    /// Presentation time of every frame that is shown, in order, ns; empty where one of them has none.
    pub times_ns: Vec<i64>,
    /// Frames that are shown.
    pub frames: u64,
    /// Those of them that are key frames.
    pub key_frames: u64,
    /// Bytes that code them.
    pub bytes: u64,
}

/// A codec that has so few bits a pixel cannot keep a sensor's noise, nor what moves by less than it.
const SPARSE_BITS: f64 = 0.03;

impl Probe {
    /// The file holds times that a recorder wrote. Formats that only string pictures together have none,
    /// and ffmpeg invents 25 frames a second.
    pub fn has_times(&self) -> bool {
        let invented = |format: &str| {
            [
                "h264",
                "hevc",
                "vvc",
                "obu",
                "mjpeg",
                "mpegvideo",
                "m4v",
                "vc1",
                "rawvideo",
                "image2",
            ]
            .contains(&format)
                || format.ends_with("_pipe")
        };
        !self.format.split(',').any(invented)
    }

    /// Pictures are coded by means of others, which takes small motions away.
    pub fn is_predicted(&self) -> bool {
        self.key_frames < self.frames
    }

    /// They are, and by so few bits that small motions cannot all be there.
    pub fn is_sparse(&self) -> bool {
        let pixels = f64::from(self.width) * f64::from(self.height) * self.frames as f64;
        self.is_predicted() && self.bytes > 0 && 8.0 * (self.bytes as f64) < SPARSE_BITS * pixels
    }
}

/// Asks ffprobe what `path` holds.
///
/// # Errors
/// [`Error`] for a file without a video that can be measured, and when ffprobe is not there or gives up.
pub fn probe(path: &Path) -> Result<Probe, Error> {
    parse(&programs::ffprobe(path)?)
}

/// ffprobe's answer.
#[derive(Deserialize)]
struct Answer {
    #[serde(default)]
    packets: Vec<Packet>,
    #[serde(default)]
    streams: Vec<Stream>,
    #[serde(default)]
    format: Format,
}

#[derive(Deserialize)]
struct Packet {
    pts: Option<i64>,
    #[serde(default)]
    flags: String,
    /// Bytes, as text.
    size: Option<String>,
}

#[derive(Deserialize)]
struct Stream {
    codec_name: Option<String>,
    #[serde(default)]
    width: u64,
    #[serde(default)]
    height: u64,
    pix_fmt: Option<String>,
    color_range: Option<String>,
    field_order: Option<String>,
    time_base: Option<String>,
    avg_frame_rate: Option<String>,
    r_frame_rate: Option<String>,
    #[serde(default)]
    tags: Tags,
    #[serde(default)]
    side_data_list: Vec<SideData>,
}

#[derive(Default, Deserialize)]
struct Tags {
    rotate: Option<String>,
}

#[derive(Deserialize)]
struct SideData {
    rotation: Option<f64>,
}

#[derive(Default, Deserialize)]
struct Format {
    #[serde(default)]
    format_name: String,
}

/// Understands ffprobe's answer, JSON with `packets`, `streams` and `format`.
///
/// # Errors
/// [`Error`] for an answer that is none, or that tells of no video that can be measured.
pub fn parse(json: &[u8]) -> Result<Probe, Error> {
    let answer: Answer = serde_json::from_slice(json)
        .map_err(|error| Error::Garbled(format!("ffprobe: {error}")))?;
    let stream = answer.streams.into_iter().next().ok_or(Error::NoVideo)?;
    let side = |side: u64| u16::try_from(side).ok().filter(|&side| side > 0);
    let (Some(width), Some(height)) = (side(stream.width), side(stream.height)) else {
        return Err(Error::Size(stream.width, stream.height));
    };
    if let Some(order) = stream.field_order.as_deref()
        && ["tt", "bb", "tb", "bt"].contains(&order)
    {
        return Err(Error::Interlaced(order.to_owned()));
    }
    let time_base: Option<Ratio> = stream
        .time_base
        .as_deref()
        .and_then(|text| text.parse().ok());
    // D: decoded, but outside of what the file's edit list shows.
    let shown: Vec<&Packet> = answer
        .packets
        .iter()
        .filter(|packet| !packet.flags.contains('D'))
        .collect();
    let rate = |text: &Option<String>| {
        text.as_deref()
            .and_then(|text| text.parse::<Ratio>().ok())
            .map(Ratio::value)
    };
    Ok(Probe {
        codec: stream.codec_name.unwrap_or_default(),
        format: answer.format.format_name,
        width,
        height,
        pixel_format: stream.pix_fmt.unwrap_or_default(),
        full_range: match stream.color_range.as_deref() {
            Some("pc" | "jpeg") => Some(true),
            Some("tv" | "mpeg") => Some(false),
            _ => None,
        },
        rotation_deg: rotation(&stream.side_data_list, &stream.tags),
        fps: rate(&stream.avg_frame_rate).or(rate(&stream.r_frame_rate)),
        times_ns: times(&shown, time_base).unwrap_or_default(),
        time_base,
        frames: shown.len() as u64,
        key_frames: shown
            .iter()
            .filter(|packet| packet.flags.contains('K'))
            .count() as u64,
        bytes: shown
            .iter()
            .filter_map(|packet| packet.size.as_deref()?.parse::<u64>().ok())
            .fold(0, u64::saturating_add),
    })
}

/// The times of the packets in order of time.
fn times(shown: &[&Packet], time_base: Option<Ratio>) -> Option<Vec<i64>> {
    let time_base = time_base?;
    let mut times: Vec<i64> = shown
        .iter()
        .map(|packet| time_base.times_in_ns(packet.pts?))
        .collect::<Option<_>>()?;
    times.sort_unstable();
    Some(times)
}

/// Degrees clockwise: ffprobe's side data count the other way, its tag does not.
fn rotation(side_data: &[SideData], tags: &Tags) -> u16 {
    let anticlockwise = side_data.iter().find_map(|data| data.rotation);
    let tag = || {
        tags.rotate
            .as_deref()
            .and_then(|text| text.parse::<f64>().ok())
    };
    let clockwise = anticlockwise
        .map(|degrees| -degrees)
        .or_else(tag)
        .unwrap_or(0.0);
    ((clockwise / 90.0).round().rem_euclid(4.0) as u16) * 90
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// What ffprobe says of a phone's clip that was filmed upright, shortened.
    const PHONE: &str = r#"{
        "packets": [
            {"pts": 0, "size": "40900", "flags": "K__"}, {"pts": 60, "size": "900", "flags": "__"},
            {"pts": 20, "flags": "___"},
            {"pts": 40, "flags": "_D"}, {"pts": -20, "flags": "KD"}
        ],
        "programs": [],
        "streams": [{
            "codec_name": "h264", "width": 568, "height": 320, "pix_fmt": "yuv420p", "color_range": "tv",
            "field_order": "progressive", "r_frame_rate": "30000/1001", "avg_frame_rate": "19800/661",
            "time_base": "1/600", "tags": {"rotate": "90"}, "side_data_list": [{"rotation": -90}]
        }],
        "format": {"format_name": "mov,mp4,m4a,3gp,3g2,mj2"}
    }"#;

    #[test]
    fn a_phone_s_clip() {
        let probe = parse(PHONE.as_bytes()).unwrap();
        assert_eq!(
            (probe.width, probe.height, probe.rotation_deg),
            (568, 320, 90)
        );
        assert_eq!(
            (probe.codec.as_str(), probe.pixel_format.as_str()),
            ("h264", "yuv420p")
        );
        assert_eq!(probe.full_range, Some(false));
        assert_eq!((probe.bytes, probe.is_sparse()), (41_800, false));
        let fewer = Probe {
            bytes: 2000,
            ..probe.clone()
        };
        assert!(fewer.is_sparse());
        assert_eq!((probe.frames, probe.key_frames), (3, 1));
        assert_eq!(probe.times_ns, [0, 33_333_333, 100_000_000]);
        assert!((probe.fps.unwrap() - 29.9546).abs() < 1e-4);
        assert!(probe.has_times() && probe.is_predicted());
    }

    #[test]
    fn what_cannot_be_measured_is_refused() {
        let refusal = |json: &str| parse(json.as_bytes()).unwrap_err().to_string();
        assert!(refusal("{}").contains("no video"));
        assert!(refusal("no JSON").contains("not understood"));
        assert!(refusal(r#"{"streams":[{"width":70000,"height":2}]}"#).contains("70000x2"));
        assert!(refusal(r#"{"streams":[{"width":2,"height":0}]}"#).contains("2x0"));
        let fields = r#"{"streams":[{"width":2,"height":2,"field_order":"tb"}]}"#;
        assert!(refusal(fields).contains("interlaced (tb)"));
    }

    #[test]
    fn a_packet_without_a_time_leaves_the_times_to_the_decoder() {
        let json = PHONE.replace(r#""pts": 60, "#, "");
        let probe = parse(json.as_bytes()).unwrap();
        assert!(probe.times_ns.is_empty());
        assert_eq!(probe.frames, 3);
    }

    #[test]
    fn bare_streams_and_pictures_hold_no_times() {
        for (format, has) in [
            ("h264", false),
            ("mjpeg", false),
            ("png_pipe", false),
            ("image2", false),
            ("matroska,webm", true),
            ("avi", true),
            ("mpegts", true),
        ] {
            let json = PHONE.replace("mov,mp4,m4a,3gp,3g2,mj2", format);
            assert_eq!(parse(json.as_bytes()).unwrap().has_times(), has, "{format}");
        }
    }

    #[test]
    fn rotation_is_told_clockwise() {
        let tags = Tags {
            rotate: Some("270".to_owned()),
        };
        assert_eq!(rotation(&[], &tags), 270);
        let side = |rotation| {
            [
                SideData { rotation: None },
                SideData {
                    rotation: Some(rotation),
                },
            ]
        };
        for (given, clockwise) in [
            (-90.0, 90),
            (90.0, 270),
            (180.0, 180),
            (-180.0, 180),
            (-0.0, 0),
            (f64::NAN, 0),
        ] {
            assert_eq!(rotation(&side(given), &tags), clockwise, "{given}");
        }
    }

    proptest! {
        #[test]
        fn any_answer_is_understood_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let _ = parse(&bytes);
        }

        #[test]
        fn times_are_exact_to_half_a_nanosecond(count in -(1_i64 << 40)..1 << 40, denominator in 1_u32..=10_000_000) {
            let base = Ratio { numerator: 1, denominator };
            let exact = count as f64 * 1e9 / f64::from(denominator);
            match base.times_in_ns(count) {
                Some(ns) => prop_assert!((ns as f64 - exact).abs() <= 0.5 + exact.abs() * 1e-15),
                None => prop_assert!(exact.abs() > 4e18),
            }
        }
    }
}
