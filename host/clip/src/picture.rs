//! Single pictures: PNG and JPEG files as grey values.

use std::fmt;
use std::io::{BufRead, Cursor, Seek};
use std::path::Path;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Most bytes that a PNG may ask for while it is read, so that a header that lies costs no memory.
const MOST_BYTES: usize = 512 << 20;
/// First bytes of a PNG and of a JPEG.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
const JPEG: &[u8] = &[0xff, 0xd8, 0xff];
/// Red, green and blue in luma, ten-thousandths (Rec. ITU-R BT.709).
const LUMA: [u32; 3] = [2126, 7152, 722];

/// A picture in shades of grey, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grey {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// From 0 to 65535, the range of 8-bit pictures stretched to that.
    pub values: Vec<u16>,
}

/// Why a picture cannot be read.
#[derive(Debug)]
pub enum PictureError {
    /// The file cannot be read.
    Io(std::io::Error),
    /// It is neither PNG nor JPEG.
    Unknown,
    /// What the PNG's decoder says.
    Png(png::DecodingError),
    /// What the JPEG's decoder says.
    Jpeg(zune_jpeg::errors::DecodeErrors),
}

impl fmt::Display for PictureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(error) => error.fmt(f),
            Self::Unknown => f.write_str("it is neither PNG nor JPEG"),
            Self::Png(error) => write!(f, "PNG: {error}"),
            // Its Display is its Debug, which may have several lines.
            Self::Jpeg(error) => write!(f, "JPEG: {error}"),
        }
    }
}

impl std::error::Error for PictureError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io(error) => Some(error),
            Self::Unknown => None,
            Self::Png(error) => Some(error),
            Self::Jpeg(error) => Some(error),
        }
    }
}

/// Reads a PNG or JPEG file; its first bytes say which it is, not its name. Of a JPEG the luma it holds is taken, of a
/// coloured PNG the luma after BT.709; transparency is left out.
///
/// # Errors
/// [`PictureError`].
pub fn read(path: &Path) -> Result<Grey, PictureError> {
    decode(&std::fs::read(path).map_err(PictureError::Io)?)
}

/// As [`read`], of the file's bytes.
///
/// # Errors
/// [`PictureError`].
pub fn decode(bytes: &[u8]) -> Result<Grey, PictureError> {
    if bytes.starts_with(PNG) {
        decode_png(Cursor::new(bytes)).map_err(PictureError::Png)
    } else if bytes.starts_with(JPEG) {
        decode_jpeg(bytes).map_err(PictureError::Jpeg)
    } else {
        Err(PictureError::Unknown)
    }
}

/// Grey of samples that are `channels` a pixel: grey, grey and alpha, colours, colours and alpha.
fn grey(samples: impl Iterator<Item = u16>, channels: usize, width: usize, height: usize) -> Grey {
    let mut values = Vec::with_capacity(width * height);
    let mut pixel = [0; 4];
    for (k, sample) in samples.enumerate() {
        let channel = k % channels;
        pixel[channel.min(3)] = u32::from(sample);
        if channel + 1 == channels {
            values.push(match channels {
                1 | 2 => pixel[0] as u16,
                _ => {
                    (pixel
                        .iter()
                        .zip(LUMA)
                        .map(|(v, part)| v * part)
                        .sum::<u32>()
                        / 10_000) as u16
                }
            });
        }
    }
    values.resize(width * height, 0);
    Grey {
        width,
        height,
        values,
    }
}

/// An 8-bit value in the range of 16 bits.
fn stretched(value: u8) -> u16 {
    257 * u16::from(value)
}

fn decode_png(from: impl BufRead + Seek) -> Result<Grey, png::DecodingError> {
    let mut decoder = png::Decoder::new_with_limits(from, png::Limits { bytes: MOST_BYTES });
    // Palettes become colours, fewer bits than 8 become 8.
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info()?;
    let Some(size) = reader
        .output_buffer_size()
        .filter(|&size| size <= MOST_BYTES)
    else {
        return Err(png::DecodingError::LimitsExceeded);
    };
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes)?;
    let (width, height) = (info.width as usize, info.height as usize);
    let channels = info.color_type.samples();
    Ok(match info.bit_depth {
        png::BitDepth::Sixteen => {
            let pairs = bytes
                .chunks_exact(2)
                .map(|p| u16::from_be_bytes([p[0], p[1]]));
            grey(pairs, channels, width, height)
        }
        _ => grey(bytes.into_iter().map(stretched), channels, width, height),
    })
}

fn decode_jpeg(bytes: &[u8]) -> Result<Grey, zune_jpeg::errors::DecodeErrors> {
    let mut decoder = JpegDecoder::new(Cursor::new(bytes));
    decoder.decode_headers()?;
    // A JPEG of red, green and blue itself has no luma of its own.
    let wanted = match decoder.input_colorspace() {
        Some(ColorSpace::YCbCr | ColorSpace::Luma) => ColorSpace::Luma,
        _ => ColorSpace::RGB,
    };
    let options = DecoderOptions::default().jpeg_set_out_colorspace(wanted);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(bytes), options);
    let samples = decoder.decode()?;
    let (width, height) = decoder.info().map_or((0, 0), |info| {
        (usize::from(info.width), usize::from(info.height))
    });
    let channels = decoder
        .output_colorspace()
        .map_or(1, |space| space.num_components())
        .max(1);
    Ok(grey(
        samples.into_iter().map(stretched),
        channels,
        width,
        height,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(color: png::ColorType, depth: png::BitDepth, width: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, 2);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == png::ColorType::Indexed {
            encoder.set_palette(vec![0, 0, 0, 255, 0, 0]);
        }
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(data).expect("the pixels");
        writer.finish().expect("an end");
        bytes
    }

    #[test]
    fn every_kind_of_png_becomes_grey() {
        use png::{BitDepth, ColorType};
        let red = (65535 * 2126 / 10_000) as u16;
        for (color, depth, width, data, values) in [
            (
                ColorType::Grayscale,
                BitDepth::Eight,
                2,
                &[0, 255, 7, 128][..],
                vec![0, 65535, 1799, 32896],
            ),
            (
                ColorType::Grayscale,
                BitDepth::One,
                2,
                &[0x40, 0x80],
                vec![0, 65535, 65535, 0],
            ),
            (
                ColorType::Grayscale,
                BitDepth::Sixteen,
                1,
                &[1, 2, 0xff, 0xfe],
                vec![258, 65534],
            ),
            (
                ColorType::GrayscaleAlpha,
                BitDepth::Eight,
                1,
                &[9, 0, 8, 255],
                vec![2313, 2056],
            ),
            (
                ColorType::Rgb,
                BitDepth::Eight,
                1,
                &[255, 0, 0, 5, 5, 5],
                vec![red, 1285],
            ),
            (
                ColorType::Rgba,
                BitDepth::Eight,
                1,
                &[255, 0, 0, 3, 5, 5, 5, 0],
                vec![red, 1285],
            ),
            (
                ColorType::Indexed,
                BitDepth::One,
                1,
                &[0x80, 0],
                vec![red, 0],
            ),
        ] {
            let grey = decode(&png(color, depth, width, data)).expect("a picture");
            assert_eq!((grey.width, grey.height), (width as usize, 2));
            assert_eq!(grey.values, values, "{color:?} {depth:?}");
        }
    }

    #[test]
    fn a_jpeg_gives_its_luma() {
        // 16 x 8 px, left half black, right half white, made by ffmpeg.
        let bytes = include_bytes!("picture.jpg");
        let grey = decode(bytes).expect("a picture");
        assert_eq!((grey.width, grey.height), (16, 8));
        for (k, &value) in grey.values.iter().enumerate() {
            let white = k % 16 >= 8;
            assert_eq!(value, if white { 65535 } else { 0 }, "{k}");
        }
    }

    #[test]
    fn what_is_no_picture_is_refused_whatever_is_wrong_with_it() {
        let good = png(
            png::ColorType::Grayscale,
            png::BitDepth::Eight,
            2,
            &[1, 2, 3, 4],
        );
        for cut in 0..good.len() - 12 {
            assert!(decode(&good[..cut]).is_err(), "{cut} bytes");
        }
        let jpeg = include_bytes!("picture.jpg");
        for cut in [0, 3, 20, 100, 150] {
            assert!(decode(&jpeg[..cut]).is_err(), "{cut} bytes");
        }
        assert!(matches!(
            decode(b"RIFF....WEBP"),
            Err(PictureError::Unknown)
        ));
        let mut liar = good;
        // Two thousand million columns, and the checksum of that.
        liar[16..20].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
        assert!(decode(&liar).is_err());
    }
}
