//! Arrays as NumPy writes them: format version 1.0 of NEP 1.

use std::io::{self, Write};

/// Bytes before the header's text: magic, version and length.
const BEFORE: usize = 10;
/// The data start at a multiple of so many bytes.
const ALIGNED: usize = 64;

/// Writes what stands before the data of an array: magic, version, and a Python dictionary that is padded so that
/// the data are aligned. `descr` is NumPy's name of an element (`<f8`); the last place of `shape` runs fastest.
///
/// # Errors
/// What writing says.
pub(crate) fn write_head(to: &mut impl Write, descr: &str, shape: &[usize]) -> io::Result<()> {
    let sides: String = shape.iter().map(|side| format!("{side}, ")).collect();
    // A tuple of one keeps its comma.
    let sides = match shape.len() {
        1 => sides.trim_end(),
        _ => sides.trim_end_matches(", "),
    };
    let mut head = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({sides}), }}");
    let padding = ALIGNED - (BEFORE + head.len() + 1) % ALIGNED;
    head.extend(std::iter::repeat_n(' ', padding % ALIGNED));
    head.push('\n');
    to.write_all(b"\x93NUMPY\x01\x00")?;
    to.write_all(&(head.len() as u16).to_le_bytes())?;
    to.write_all(head.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_data_are_aligned_and_tuples_are_those_of_python() {
        for (shape, written) in [
            (&[][..], "()"),
            (&[7], "(7,)"),
            (&[7, 2], "(7, 2)"),
            (&[1, 2, 3], "(1, 2, 3)"),
        ] {
            let mut bytes = Vec::new();
            write_head(&mut bytes, "<c16", shape).expect("memory");
            assert_eq!(bytes.len() % ALIGNED, 0);
            let length = u16::from_le_bytes([bytes[8], bytes[9]]);
            assert_eq!(usize::from(length) + BEFORE, bytes.len());
            let text = String::from_utf8_lossy(&bytes[BEFORE..]);
            assert!(text.contains(&format!("'shape': {written}, ")), "{text}");
        }
    }
}
