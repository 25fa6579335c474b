//! The last seconds as a clip, and what is known of it.

use serde_json::{Value, json};

use crate::frames::{Layout, Shot};
use crate::live::Live;

/// Frame rate where the camera does not say, Hz.
const USUAL_FPS: f64 = 60.0;

/// The last frames as a Y4M file of grey values, with all bits that the camera gave; `None` where none are kept.
pub fn y4m(live: &Live) -> Option<Vec<u8>> {
    let mut clip: Option<(Layout, Vec<u8>)> = None;
    let fps = live.about().fps;
    live.frames.last(|shot| {
        let (layout, bytes) = clip.get_or_insert_with(|| (shot.layout, header(&shot.layout, fps)));
        if *layout == shot.layout {
            frame(shot, bytes);
        }
    });
    clip.map(|(_, bytes)| bytes)
}

fn header(layout: &Layout, fps: Option<f64>) -> Vec<u8> {
    let thousandths = (fps.unwrap_or(USUAL_FPS) * 1000.0).round().max(1.0) as u64;
    let depth = match layout.format.bits() {
        8 => String::new(),
        bits => bits.to_string(),
    };
    let Layout { width, height, .. } = layout;
    format!("YUV4MPEG2 W{width} H{height} F{thousandths}:1000 Ip A1:1 Cmono{depth}\n").into_bytes()
}

fn frame(shot: &Shot, bytes: &mut Vec<u8>) {
    bytes.extend(b"FRAME\n");
    for row in 0..usize::from(shot.layout.height) {
        shot.full_row(row, bytes);
    }
}

/// What is known of that clip: camera, settings as `settings`, and each frame's number and start of exposure.
pub fn json(live: &Live, settings: Value) -> Value {
    let (mut numbers, mut starts_ns) = (Vec::new(), Vec::new());
    live.frames.last(|shot| {
        numbers.push(shot.frame);
        starts_ns.push(shot.start_ns);
    });
    let about = live.about();
    json!({
        "source": about.name,
        "line_time_us": about.line_time_us,
        "exposure_us": about.exposure_us,
        "fps": about.fps,
        "settings": settings,
        "frames": numbers,
        "start_ns": starts_ns,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::About;
    use rowtone::camera::RawFormat;

    #[test]
    fn a_clip_has_the_bits_that_the_camera_gave() {
        let live = Live::default();
        assert_eq!(y4m(&live), None);
        live.describe(About {
            fps: Some(50.0),
            ..About::default()
        });
        let layout = Layout {
            width: 4,
            height: 1,
            stride: 5,
            format: RawFormat::Packed10,
            bayer: false,
        };
        for frame in 1..=2 {
            live.frames
                .keep(frame, 0, layout, &[0x40, 0x80, 0xc0, 0xff, 0b11_00_00_01]);
        }
        let clip = y4m(&live).unwrap();
        let head = b"YUV4MPEG2 W4 H1 F50000:1000 Ip A1:1 Cmono10\n";
        assert!(clip.starts_with(head));
        let first = [0x101_u16, 0x200, 0x300, 0x3ff]
            .map(u16::to_le_bytes)
            .concat();
        let one = [&b"FRAME\n"[..], &first].concat();
        assert_eq!(clip[head.len()..], [&one[..], &one[..]].concat());
        assert_eq!(json(&live, Value::Null)["frames"], json!([1, 2]));
    }
}
