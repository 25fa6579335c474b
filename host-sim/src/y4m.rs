//! Frames as a Y4M stream, and their times as timecode format v2.

use std::io::{self, Write};

use rowtone_clip::{Header, PixelFormat};

use super::config::Sensor;
use super::frame::{Frame, PixelBuffer};
use super::schedule::Slot;

/// Writes the stream's header: mono, 8 bits or deeper (`mono10` and so on, little-endian words).
///
/// # Errors
/// What the writer says.
pub fn write_header(out: &mut impl Write, sensor: &Sensor) -> io::Result<()> {
    let header = Header {
        width: sensor.cols as usize,
        height: sensor.rows as usize,
        fps: Some(sensor.fps),
        unusable_rate: None,
        format: PixelFormat::luma(sensor.bits),
    };
    header.write(out)
}

/// Writes one frame.
///
/// # Errors
/// What the writer says.
pub fn write_frame(out: &mut impl Write, frame: &Frame) -> io::Result<()> {
    out.write_all(b"FRAME\n")?;
    match &frame.pixels {
        PixelBuffer::U8(p) => out.write_all(p),
        PixelBuffer::U16(p) => {
            let bytes: Vec<u8> = p.iter().flat_map(|v| v.to_le_bytes()).collect();
            out.write_all(&bytes)
        }
    }
}

/// Writes the starts of the frames that arrive, ms.
///
/// # Errors
/// What the writer says.
pub fn write_times(out: &mut impl Write, slots: impl Iterator<Item = Slot>) -> io::Result<()> {
    writeln!(out, "# timecode format v2")?;
    for slot in slots {
        let sign = if slot.start_ns < 0 { "-" } else { "" };
        let ns = slot.start_ns.unsigned_abs();
        writeln!(out, "{sign}{}.{:06}", ns / 1_000_000, ns % 1_000_000)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, Config};

    #[test]
    fn a_stream_has_the_announced_size_and_depth() {
        for bits in [8u8, 10, 12, 16] {
            let mut config = Config {
                frames: 3,
                ..Config::default()
            };
            config.sensor.bits = bits;
            let camera = Camera::new(config).expect("good");
            let mut out = Vec::new();
            write_header(&mut out, &camera.config().sensor).expect("memory");
            let tag = if bits == 8 {
                "Cmono\n".to_owned()
            } else {
                format!("Cmono{bits}\n")
            };
            let header = out.len();
            assert!(String::from_utf8_lossy(&out).ends_with(&tag));
            for frame in camera.frames() {
                write_frame(&mut out, &frame).expect("memory");
            }
            let pixel = if bits == 8 { 1 } else { 2 };
            assert_eq!(out.len() - header, 3 * (6 + 128 * 300 * pixel));
        }
    }

    #[test]
    fn times_are_milliseconds_with_all_nanoseconds() {
        let slots = [-24_085, 33_340_619].map(|start_ns| Slot {
            number: 0,
            start_ns,
            lost: false,
        });
        let mut out = Vec::new();
        write_times(&mut out, slots.into_iter()).expect("memory");
        assert_eq!(out, b"# timecode format v2\n-0.024085\n33.340619\n");
    }
}
