//! What ffmpeg says of the pictures that it decodes: lines of its filter `showinfo`, and its errors.
//!
//! With `-loglevel level+info` every line names its level, and those of the filter look like this:
//!
//! ```text
//! [Parsed_showinfo_0 @ 0x55e9] [info] config in time_base: 1/600, frame_rate: 30000/1001
//! [Parsed_showinfo_0 @ 0x55e9] [info] n:   0 pts:      0 pts_time:0 ... s:568x320 i:P iskey:1 type:I
//! ```
//!
//! Lines of side data may stand between them; keys are looked for by name, since versions of ffmpeg
//! differ in which there are.

use super::Ratio;

/// How a picture was coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// By itself (I).
    Intra,
    /// Predicted from pictures before it (P).
    Predicted,
    /// Predicted from pictures before and after it (B).
    Bidirectional,
    /// In another way, or not known.
    Other,
}

/// What `showinfo` says of one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Presentation time in units of the time base, where there is one.
    pub pts: Option<i64>,
    /// Columns and rows.
    pub size: (usize, usize),
    /// It is a key frame: decoding can start here.
    pub key: bool,
    /// How it was coded.
    pub kind: FrameKind,
}

/// A line of ffmpeg's standard error, understood.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// The unit of the times that follow, s.
    TimeBase(Ratio),
    /// A picture was decoded and follows on standard output.
    Frame(Shown),
    /// A warning is not kept; an error is, without its context.
    Error(String),
    /// Something else.
    Nothing,
}

/// Understands a line of ffmpeg's standard error, without its line feed.
///
/// ```
/// use rowtone_clip::ffmpeg::showinfo::{Said, understand};
/// let line = "[Parsed_showinfo_0 @ 0x1] [info] n: 7 pts: 3003 s:64x48 i:P iskey:0 type:B";
/// let Said::Frame(frame) = understand(line) else { panic!() };
/// assert_eq!((frame.pts, frame.size), (Some(3003), (64, 48)));
/// ```
pub fn understand(line: &str) -> Said {
    let (context, level, text) = parts(line);
    match level {
        "error" | "fatal" | "panic" => Said::Error(text.to_owned()),
        "info" if context.starts_with("Parsed_showinfo") => filter(text),
        _ => Said::Nothing,
    }
}

/// The context, the level and the rest of a line; empty where it has none.
fn parts(line: &str) -> (&str, &str, &str) {
    let Some((first, after)) = bracket(line) else {
        return ("", "", line);
    };
    match bracket(after) {
        Some((level, text)) if is_level(level) => (first, level, text),
        _ if is_level(first) => ("", first, after),
        _ => (first, "", after),
    }
}

/// What stands in the brackets at the start, and what follows them.
fn bracket(text: &str) -> Option<(&str, &str)> {
    let (inside, after) = text.trim_start().strip_prefix('[')?.split_once(']')?;
    Some((inside, after.trim_start()))
}

fn is_level(text: &str) -> bool {
    [
        "panic", "fatal", "error", "warning", "info", "verbose", "debug",
    ]
    .contains(&text)
}

/// What the filter says.
fn filter(text: &str) -> Said {
    if let Some(config) = text.strip_prefix("config in ") {
        let base =
            value(config, "time_base:").and_then(|word| word.trim_end_matches(',').parse().ok());
        return base.map_or(Said::Nothing, Said::TimeBase);
    }
    if !text.starts_with("n:") {
        return Said::Nothing;
    }
    let Some(size) = value(text, "s:").and_then(size) else {
        return Said::Nothing;
    };
    Said::Frame(Shown {
        pts: value(text, "pts:").and_then(|word| word.parse().ok()),
        size,
        key: value(text, "iskey:") == Some("1"),
        kind: match value(text, "type:") {
            Some("I") => FrameKind::Intra,
            Some("P") => FrameKind::Predicted,
            Some("B") => FrameKind::Bidirectional,
            _ => FrameKind::Other,
        },
    })
}

/// The word behind a key, which may stand beside the key or after blanks.
fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let mut words = text.split_ascii_whitespace();
    while let Some(word) = words.next() {
        if let Some(value) = word.strip_prefix(key) {
            return if value.is_empty() {
                words.next()
            } else {
                Some(value)
            };
        }
    }
    None
}

/// `568x320`.
fn size(word: &str) -> Option<(usize, usize)> {
    let (width, height) = word.split_once('x')?;
    Some((width.parse().ok()?, height.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn lines_of_several_versions() {
        let base = "[Parsed_showinfo_0 @ 0x55e9cc47a4c0] [info] config in time_base: 1/600, frame_rate: 30000/1001";
        assert_eq!(
            understand(base),
            Said::TimeBase(Ratio {
                numerator: 1,
                denominator: 600
            })
        );
        let shown = |pts, kind| Shown {
            pts,
            size: (568, 320),
            key: true,
            kind,
        };
        for (line, frame) in [
            (
                "[Parsed_showinfo_0 @ 0x5] [info] n:   0 pts:      0 pts_time:0       pos:    17282 fmt:yuv420p sar:0/1 s:568x320 i:P iskey:1 type:I ",
                shown(Some(0), FrameKind::Intra),
            ),
            (
                "[Parsed_showinfo_0 @ 0x5] [info] n:  12 pts:  -1024 pts_time:-0.06 duration:    512 duration_time:0.03 fmt:yuv420p cl:left sar:1/1 s:568x320 i:P iskey:1 type:B checksum:0 plane_checksum:[0 0 0]",
                shown(Some(-1024), FrameKind::Bidirectional),
            ),
            (
                "[Parsed_showinfo_0 @ 0x5] [info] n: 3 pts:NOPTS pts_time:NOPTS fmt:gray s:568x320 i:P iskey:1 type:?",
                shown(None, FrameKind::Other),
            ),
        ] {
            assert_eq!(understand(line), Said::Frame(frame), "{line}");
        }
    }

    #[test]
    fn errors_lose_their_context_and_the_rest_is_nothing() {
        for (line, said) in [
            (
                "[mov @ 0x1] [error] moov atom not found",
                "moov atom not found",
            ),
            ("[error] clip.mp4: Invalid data", "clip.mp4: Invalid data"),
            ("[fatal] Error splitting", "Error splitting"),
        ] {
            assert_eq!(understand(line), Said::Error(said.to_owned()));
        }
        for line in [
            "",
            "[info]   Stream #0:1: Video: h264 n: 1 pts: 2 s:4x4",
            "[Parsed_showinfo_0 @ 0x5] [info] color_range:tv color_space:bt709",
            "[Parsed_showinfo_0 @ 0x5] [info]   side data - n: 1",
            "[Parsed_showinfo_0 @ 0x5] [info] n: 1 pts: 2 s:4",
            "[Parsed_showinfo_0 @ 0x5] [info] config out time_base: 0/0, frame_rate: 0/0",
            "[Parsed_showinfo_0 @ 0x5] [info] config in time_base: 0/0, frame_rate: 0/0",
        ] {
            assert_eq!(understand(line), Said::Nothing, "{line}");
        }
    }

    proptest! {
        #[test]
        fn any_line_is_understood_or_nothing(line in "\\PC*") {
            let _ = understand(&line);
        }

        #[test]
        fn every_frame_comes_back(
            pts in proptest::option::of(any::<i64>()),
            width in 1_usize..70_000,
            height in 1_usize..70_000,
            key: bool,
            kind in 0_usize..4,
            blanks in 0_usize..8,
        ) {
            let kinds = [FrameKind::Intra, FrameKind::Predicted, FrameKind::Bidirectional, FrameKind::Other];
            let blank = " ".repeat(blanks);
            let pts_word = pts.map_or("NOPTS".to_owned(), |pts| pts.to_string());
            let line = format!(
                "[Parsed_showinfo_0 @ 0x5] [info] n:{blank}1 pts:{blank}{pts_word} pts_time:1 fmt:gray s:{width}x{height} \
                 i:P iskey:{} type:{} ",
                u8::from(key),
                ["I", "P", "B", "S"][kind],
            );
            let frame = Shown { pts, size: (width, height), key, kind: kinds[kind] };
            prop_assert_eq!(understand(&line), Said::Frame(frame));
        }
    }
}
