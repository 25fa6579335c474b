//! Shapes as NumPy's archive of arrays.
//!
//! An `.npz` is a ZIP (APPNOTE.TXT 6.3.3) of `.npy` files. What stands in it is stored, not compressed: a few
//! dozen lines, where a ZIP library would bring packages into every first build.

use std::io::{self, Write};

use crc::{CRC_32_ISO_HDLC, Crc};
use num_complex::Complex64;
use rowtone_measure::shapes::{Shape, Shapes};

use crate::output::npy;

/// The archive: `hz` (tones), `x` and `y` (tones, rows, columns; complex, not-a-number where nothing is known), `sd`,
/// `x_sd`, `y_sd`, `moves`, `tile`, `fps`, the mean picture as `picture`, and `um_per_px` where there is a scale.
///
/// # Errors
/// What writing says.
pub(super) fn write(
    to: &mut impl Write,
    shapes: &Shapes,
    um_per_px: Option<f64>,
) -> io::Result<()> {
    let all = &shapes.shapes;
    let grid = &shapes.grid;
    let place = [all.len(), grid.rows(), grid.columns()];
    let phasors = |of: &dyn Fn(&Shape) -> &[Option<Complex64>]| {
        let nothing = Complex64::new(f64::NAN, f64::NAN);
        let values = all.iter().flat_map(|shape| of(shape).to_vec());
        let parts = values
            .map(|v| v.unwrap_or(nothing))
            .flat_map(|v| [v.re, v.im]);
        parts.flat_map(f64::to_le_bytes).collect::<Vec<u8>>()
    };
    let deviations = |of: &dyn Fn(&Shape, usize) -> Option<f64>| {
        let tiles = all
            .iter()
            .flat_map(|shape| (0..grid.tiles()).map(move |tile| (shape, tile)));
        let values = tiles.map(|(shape, tile)| of(shape, tile).unwrap_or(f64::NAN));
        values.flat_map(f64::to_le_bytes).collect::<Vec<u8>>()
    };
    let number = |value: f64| value.to_le_bytes().to_vec();
    let moves = all
        .iter()
        .flat_map(|shape| shape.moves.iter().map(|&moves| u8::from(moves)));
    let picture = shapes.mean.iter().flat_map(|grey| grey.to_le_bytes());
    let mut archive = Archive::new(to);
    archive.add(
        "hz",
        "<f8",
        &place[..1],
        &all.iter().flat_map(|s| number(s.hz)).collect::<Vec<_>>(),
    )?;
    archive.add("x", "<c16", &place, &phasors(&|shape| &shape.x))?;
    archive.add("y", "<c16", &place, &phasors(&|shape| &shape.y))?;
    archive.add(
        "sd",
        "<f8",
        &place,
        &deviations(&|shape, tile| shape.sd(tile)),
    )?;
    archive.add(
        "x_sd",
        "<f8",
        &place,
        &deviations(&|shape, tile| shape.x_sd[tile]),
    )?;
    archive.add(
        "y_sd",
        "<f8",
        &place,
        &deviations(&|shape, tile| shape.y_sd[tile]),
    )?;
    archive.add("moves", "|b1", &place, &moves.collect::<Vec<_>>())?;
    archive.add("tile", "<i8", &[], &(grid.tile_px() as u64).to_le_bytes())?;
    archive.add("fps", "<f8", &[], &number(shapes.fps))?;
    let size = [grid.height(), grid.width()];
    archive.add("picture", "<f4", &size, &picture.collect::<Vec<_>>())?;
    if let Some(scale) = um_per_px {
        archive.add("um_per_px", "<f8", &[], &number(scale))?;
    }
    archive.finish()
}

/// A ZIP whose files are stored, in the making.
struct Archive<'a, W> {
    to: &'a mut W,
    /// Bytes written so far.
    at: usize,
    /// The list of files at the end.
    list: Vec<u8>,
    files: u16,
}

impl<'a, W: Write> Archive<'a, W> {
    fn new(to: &'a mut W) -> Self {
        Self {
            to,
            at: 0,
            list: Vec::new(),
            files: 0,
        }
    }

    /// Adds an array; its data are little-endian.
    fn add(&mut self, name: &str, descr: &str, shape: &[usize], data: &[u8]) -> io::Result<()> {
        let mut file = Vec::with_capacity(data.len() + 128);
        npy::write_head(&mut file, descr, shape)?;
        file.extend_from_slice(data);
        let too_large = |_| io::Error::from(io::ErrorKind::FileTooLarge);
        let size = u32::try_from(file.len()).map_err(too_large)?.to_le_bytes();
        let at = u32::try_from(self.at).map_err(too_large)?.to_le_bytes();
        let sum = Crc::<u32>::new(&CRC_32_ISO_HDLC)
            .checksum(&file)
            .to_le_bytes();
        let name = format!("{name}.npy");
        let length = (name.len() as u16).to_le_bytes();
        // Version 2.0, no flags, stored, midnight on 1 January 1980.
        let mut about = vec![20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0];
        about.extend([sum, size, size].concat());
        about.extend([length, [0, 0]].concat());
        let mut own = b"PK\x03\x04".to_vec();
        own.extend_from_slice(&about);
        own.extend_from_slice(name.as_bytes());
        self.list.extend_from_slice(b"PK\x01\x02\x14\x00");
        self.list.extend_from_slice(&about);
        // No comment, the first disk, no attributes.
        self.list.extend_from_slice(&[0; 10]);
        self.list.extend_from_slice(&at);
        self.list.extend_from_slice(name.as_bytes());
        self.files += 1;
        self.at += own.len() + file.len();
        self.to.write_all(&own)?;
        self.to.write_all(&file)
    }

    fn finish(self) -> io::Result<()> {
        let too_large = |_| io::Error::from(io::ErrorKind::FileTooLarge);
        let mut end = b"PK\x05\x06\0\0\0\0".to_vec();
        let files = self.files.to_le_bytes();
        end.extend([files, files].concat());
        end.extend((self.list.len() as u32).to_le_bytes());
        end.extend(u32::try_from(self.at).map_err(too_large)?.to_le_bytes());
        end.extend([0, 0]);
        self.to.write_all(&self.list)?;
        self.to.write_all(&end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_says_where_its_files_are_and_what_they_sum_up_to() {
        let mut bytes = Vec::new();
        let mut archive = Archive::new(&mut bytes);
        archive
            .add("one", "<f8", &[1], &1.0f64.to_le_bytes())
            .expect("memory");
        archive
            .add("two", "<f8", &[], &2.0f64.to_le_bytes())
            .expect("memory");
        archive.finish().expect("memory");
        let end = bytes.len() - 22;
        assert!(bytes[end..].starts_with(b"PK\x05\x06"));
        let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[at + k])) as usize;
        assert_eq!(u16::from_le_bytes([bytes[end + 10], bytes[end + 11]]), 2);
        let list = word(end + 16);
        assert_eq!(list + word(end + 12), end);
        let mut at = list;
        for (name, value) in [("one.npy", 1.0f64), ("two.npy", 2.0)] {
            assert!(bytes[at..].starts_with(b"PK\x01\x02"));
            let (sum, size, own) = (word(at + 16), word(at + 20), word(at + 42));
            assert!(bytes[own..].starts_with(b"PK\x03\x04"));
            assert!(bytes[own + 30..].starts_with(name.as_bytes()));
            let file = &bytes[own + 30 + name.len()..][..size];
            assert!(file.starts_with(b"\x93NUMPY") && file.ends_with(&value.to_le_bytes()));
            let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC);
            assert_eq!(crc.checksum(file) as usize, sum);
            at += 46 + name.len();
        }
        assert_eq!(at, end);
    }
}
