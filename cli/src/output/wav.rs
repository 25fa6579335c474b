//! A WAV file of 32-bit floats, one channel, whose length is known beforehand: it can go into a pipe.

use std::io::{self, Write};

/// Bytes of the header.
const HEADER: u32 = 58;

/// Most samples that the format's 32-bit sizes can state.
pub const MOST_SAMPLES: usize = ((u32::MAX - HEADER) / 4) as usize;

/// What is said of more samples than that.
pub fn too_long(rate_hz: u32) -> String {
    format!(
        "a WAV file holds at most 4 GiB, which is {:.1} hours at {rate_hz} samples a second: write CSV or NPY, \
         or more rows a sample",
        MOST_SAMPLES as f64 / f64::from(rate_hz) / 3600.0
    )
}

/// Writes the file.
///
/// # Errors
/// What writing says; [`io::ErrorKind::FileTooLarge`] beyond [`MOST_SAMPLES`].
pub fn write(to: &mut impl Write, rate_hz: u32, samples: &[f32]) -> io::Result<()> {
    if samples.len() > MOST_SAMPLES {
        return Err(io::Error::new(
            io::ErrorKind::FileTooLarge,
            too_long(rate_hz),
        ));
    }
    let bytes = 4 * samples.len() as u32;
    to.write_all(b"RIFF")?;
    to.write_all(&(HEADER - 8 + bytes).to_le_bytes())?;
    to.write_all(b"WAVEfmt ")?;
    to.write_all(&18u32.to_le_bytes())?;
    // IEEE float, one channel.
    to.write_all(&3u16.to_le_bytes())?;
    to.write_all(&1u16.to_le_bytes())?;
    to.write_all(&rate_hz.to_le_bytes())?;
    to.write_all(&rate_hz.saturating_mul(4).to_le_bytes())?;
    // Bytes and bits of a sample, and no further fields.
    to.write_all(&4u16.to_le_bytes())?;
    to.write_all(&32u16.to_le_bytes())?;
    to.write_all(&0u16.to_le_bytes())?;
    to.write_all(b"fact")?;
    to.write_all(&4u32.to_le_bytes())?;
    to.write_all(&(samples.len() as u32).to_le_bytes())?;
    to.write_all(b"data")?;
    to.write_all(&bytes.to_le_bytes())?;
    for sample in samples {
        to.write_all(&sample.to_le_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_reader_reads_what_was_written() {
        let samples = [0.5, -0.25, 3.0];
        let mut bytes = Vec::new();
        write(&mut bytes, 9900, &samples).unwrap();
        assert_eq!(bytes.len(), HEADER as usize + 12);
        let mut reader = hound::WavReader::new(&bytes[..]).unwrap();
        let spec = reader.spec();
        assert_eq!((spec.sample_rate, spec.channels), (9900, 1));
        assert_eq!(spec.sample_format, hound::SampleFormat::Float);
        let read: Vec<f32> = reader.samples().map(Result::unwrap).collect();
        assert_eq!(read, samples);
    }
}
