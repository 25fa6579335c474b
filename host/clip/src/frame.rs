//! One frame in memory, handed out as lines.

use std::ops::Range;

use rowtone::camera::{Line, Pixels, Timing};

use super::bytes::Bytes;
use super::{Coding, Header, Rect, Turn};

/// One frame, in buffers that are used again for a later one.
#[derive(Debug, Default)]
pub struct Frame {
    /// Number of the frame; a lost one leaves a gap.
    pub number: u32,
    /// Start of exposure of its first row, ns.
    pub start_ns: i64,
    /// How it was coded in its file; `None` in files of plain pixels.
    pub coding: Option<Coding>,
    /// As read: the marker, then the planes.
    pub(super) raw: Bytes,
    /// First byte of the luma plane in `raw`.
    luma: usize,
    width: usize,
    plane: Plane,
    turned: Vec<u8>,
    words: Vec<u16>,
    straight: Vec<u16>,
}

/// Which buffer holds the luma that is handed out.
#[derive(Clone, Copy, Debug, Default)]
enum Plane {
    #[default]
    Raw,
    Turned,
    Words,
}

impl Frame {
    /// Makes the luma plane, which starts at byte `luma` of what was read, ready to be handed out.
    /// 8-bit luma that need not be turned stays where it is.
    pub(super) fn prepare(&mut self, header: &Header, luma: usize, turn: Turn) {
        let (width, height) = (header.width, header.height);
        self.luma = luma;
        self.width = turn.size(width, height).0;
        let values = width * height;
        if header.format.bits > 8 {
            let bytes = &self.raw[luma..luma + 2 * values];
            self.straight.clear();
            self.straight.extend(
                bytes
                    .chunks_exact(2)
                    .map(|pair| u16::from_le_bytes([pair[0], pair[1]])),
            );
            match turn {
                Turn::No => std::mem::swap(&mut self.straight, &mut self.words),
                turn => turn.plane(&self.straight, width, height, &mut self.words),
            }
            self.plane = Plane::Words;
        } else if turn == Turn::No {
            self.plane = Plane::Raw;
        } else {
            let from = &self.raw[luma..luma + values];
            turn.plane(from, width, height, &mut self.turned);
            self.plane = Plane::Turned;
        }
    }

    /// The file was cut short while this frame was read: some of it is zeros in place of pixels.
    pub fn is_cut(&self) -> bool {
        self.raw.are_cut()
    }

    /// The luma plane of the (turned) picture.
    fn plane(&self) -> Pixels<'_> {
        match self.plane {
            Plane::Raw => Pixels::U8(&self.raw[self.luma..]),
            Plane::Turned => Pixels::U8(&self.turned),
            Plane::Words => Pixels::U16(&self.words),
        }
    }

    /// The luma plane of the picture as it was given, before it is turned: a byte a pixel, or a little-endian word where
    /// it has more than 8 bits; further bytes may follow.
    pub fn given(&self) -> &[u8] {
        self.raw.get(self.luma..).unwrap_or_default()
    }

    /// Row `row` of a part of the (turned) picture. The part must lie inside it.
    pub fn pixels(&self, part: &Rect, row: usize) -> Pixels<'_> {
        cut(self.plane(), row_of(part, self.width, row))
    }

    /// The lines `rows` of a part of the picture, numbered from its top. `timing` is the whole
    /// picture's: a row's time depends on where it is in the picture.
    #[inline]
    pub fn lines<'a>(
        &'a self,
        part: &'a Rect,
        timing: &'a Timing,
        rows: Range<usize>,
    ) -> impl Iterator<Item = Line<'a>> {
        // Values, so that nothing is looked up or divided anew for each line.
        let (plane, part, timing) = (self.plane(), *part, *timing);
        let (number, start_ns, width) = (self.number, self.start_ns, self.width);
        rows.map(move |row| Line {
            frame: number,
            row: row as u16,
            start_ns: start_ns + timing.start_ns((part.y + row) as u16),
            pixels: cut(plane, row_of(&part, width, row)),
        })
    }
}

/// Where a row of a part is in a plane of this width.
#[inline]
fn row_of(part: &Rect, width: usize, row: usize) -> Range<usize> {
    let start = (part.y + row) * width + part.x;
    start..start + part.width
}

#[inline]
fn cut(plane: Pixels<'_>, range: Range<usize>) -> Pixels<'_> {
    let part = plane.part(range.start, range.len());
    part.expect("a part lies inside its picture")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_part_know_their_time_in_the_picture() {
        let header = Header::parse(b"YUV4MPEG2 W3 H3 Cmono").unwrap();
        let mut frame = Frame {
            number: 7,
            start_ns: 100,
            raw: Bytes::Read(b"FRAME\nabcdefghi".to_vec()),
            ..Frame::default()
        };
        frame.prepare(&header, 6, Turn::No);
        let timing = Timing::new(10_000, 0, 3).unwrap();
        let part = "1,1,2,2".parse().unwrap();
        let lines: Vec<_> = frame.lines(&part, &timing, 0..2).collect();
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[0].pixels, Pixels::U8(b"ef"));
        assert_eq!((lines[1].row, lines[1].start_ns), (1, 120));
    }

    #[test]
    fn deep_pixels_are_little_endian_words_and_can_be_turned() {
        let header = Header::parse(b"YUV4MPEG2 W2 H1 Cmono10").unwrap();
        let mut frame = Frame {
            raw: Bytes::Read(b"FRAME\n\x01\x02\xff\x03".to_vec()),
            ..Frame::default()
        };
        frame.prepare(&header, 6, Turn::No);
        let whole = Rect::whole(2, 1);
        assert_eq!(frame.pixels(&whole, 0), Pixels::U16(&[0x201, 0x3ff]));
        frame.prepare(&header, 6, Turn::Quarter);
        assert_eq!(frame.pixels(&Rect::whole(1, 2), 1), Pixels::U16(&[0x3ff]));
    }
}
