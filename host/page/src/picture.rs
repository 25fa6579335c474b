//! A picture for the eye, and what it says while the camera is aimed.

use jpeg_encoder::{ColorType, Encoder, EncodingError};
use serde::Serialize;

use crate::frames::Shot;

/// A picture is shrunk by a whole number until it is no wider than this, px.
const WIDEST: usize = 1280;
/// Quality of the JPEG, of 100.
const QUALITY: u8 = 82;
/// Grey values below and from which a pixel tells nothing, of 256.
const DARK: u8 = 5;
const BRIGHT: u8 = 250;
/// Points of the profiles along rows and columns.
const PROFILE: usize = 64;

/// Grey values, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grey {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// So many pixels of the camera, along both axes, are one here.
    pub shrunk: usize,
    /// The values.
    pub values: Vec<u8>,
}

impl Grey {
    /// A frame's upper 8 bits; colours of neighbouring pixels are averaged, and so are pixels of a picture too wide for a
    /// screen.
    pub fn of(shot: &Shot) -> Self {
        let (width, height) = (
            usize::from(shot.layout.width),
            usize::from(shot.layout.height),
        );
        let mut shrunk = width.div_ceil(WIDEST).max(1);
        if shot.layout.bayer {
            shrunk = shrunk.next_multiple_of(2);
        }
        let (columns, rows) = ((width / shrunk).max(1), (height / shrunk).max(1));
        let mut values = Vec::with_capacity(columns * rows);
        let mut row_bytes = Vec::with_capacity(width);
        let mut sums = vec![0_u32; columns];
        for row in 0..rows {
            sums.fill(0);
            for line in 0..shrunk {
                row_bytes.clear();
                shot.grey_row(row * shrunk + line, &mut row_bytes);
                for (sum, pixels) in sums.iter_mut().zip(row_bytes.chunks_exact(shrunk)) {
                    *sum += pixels.iter().map(|&v| u32::from(v)).sum::<u32>();
                }
            }
            let area = (shrunk * shrunk) as u32;
            values.extend(sums.iter().map(|sum| (sum / area) as u8));
        }
        Self {
            width: columns,
            height: rows,
            shrunk,
            values,
        }
    }

    /// As JPEG.
    ///
    /// # Errors
    /// Where it has no pixels, or more than JPEG can say.
    pub fn jpeg(&self) -> Result<Vec<u8>, EncodingError> {
        let mut bytes = Vec::with_capacity(self.values.len() / 4);
        let encoder = Encoder::new(&mut bytes, QUALITY);
        encoder.encode(
            &self.values,
            self.width as u16,
            self.height as u16,
            ColorType::Luma,
        )?;
        Ok(bytes)
    }

    fn rows(&self) -> impl Iterator<Item = &[u8]> {
        self.values.chunks_exact(self.width.max(1))
    }
}

/// What a picture says while the camera is aimed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Aim {
    /// How sharp it is: the share of the contrast that lies between neighbouring pixels, percent. It has no absolute scale:
    /// turn the lens until it is largest.
    pub focus: f32,
    /// Mean grey value, percent of white.
    pub mean: f32,
    /// Pixels that are black, percent.
    pub dark: f32,
    /// Pixels that are white, percent.
    pub bright: f32,
    /// Pixels of each of 32 steps of grey, percent.
    pub histogram: Vec<f32>,
    /// How much each of up to 64 groups of rows of the part knows of motion along x: the standard deviation that one of its
    /// rows would have, relative to that of the row in the middle of the order. `None` where it knows nothing.
    pub rows: Vec<Option<f32>>,
    /// The same of columns and motion along y.
    pub columns: Vec<Option<f32>>,
}

/// A part of a picture, px of the camera: x, y, width, height.
pub type Part = [usize; 4];

impl Aim {
    /// Looks at a picture of which `part` is measured.
    pub fn of(grey: &Grey, part: Part) -> Self {
        let mut histogram = [0_u32; 256];
        for &value in &grey.values {
            histogram[usize::from(value)] += 1;
        }
        let all = grey.values.len().max(1) as f32;
        let percent = |range: std::ops::Range<usize>| {
            let count: u32 = histogram.get(range).unwrap_or_default().iter().sum();
            100.0 * count as f32 / all
        };
        let sum: f64 = histogram
            .iter()
            .enumerate()
            .map(|(v, &n)| v as f64 * f64::from(n))
            .sum();
        let (rows, columns) = profiles(grey, part);
        Self {
            focus: focus(grey),
            mean: (sum / f64::from(all) / 2.55) as f32,
            dark: percent(0..DARK.into()),
            bright: percent(BRIGHT.into()..256),
            histogram: (0..32)
                .map(|step| percent(8 * step..8 * step + 8))
                .collect(),
            rows,
            columns,
        }
    }
}

/// Mean square difference of neighbours over twice the variance, percent: 100 of white noise, next to 0 of what is blurred.
fn focus(grey: &Grey) -> f32 {
    let (mut differences, mut pairs) = (0.0_f64, 0.0_f64);
    let (mut sum, mut squares, mut count) = (0.0_f64, 0.0_f64, 0.0_f64);
    for row in grey.rows() {
        for pair in row.windows(2) {
            let difference = f64::from(pair[1]) - f64::from(pair[0]);
            differences += difference * difference;
        }
        pairs += row.len().saturating_sub(1) as f64;
        for &value in row {
            sum += f64::from(value);
            squares += f64::from(value) * f64::from(value);
        }
        count += row.len() as f64;
    }
    let variance = squares / count.max(1.0) - (sum / count.max(1.0)).powi(2);
    if variance < 0.25 || pairs == 0.0 {
        return 0.0;
    }
    (100.0 * differences / pairs / (2.0 * variance)) as f32
}

type Profile = Vec<Option<f32>>;

/// The information of a row about motion along it goes with the sum of its squared differences (the Cramér-Rao bound of a
/// shift), so the standard deviation goes with the root of its inverse; of columns the same.
fn profiles(grey: &Grey, part: Part) -> (Profile, Profile) {
    let [x, y, width, height] = part.map(|v| v / grey.shrunk.max(1));
    let (right, bottom) = ((x + width).min(grey.width), (y + height).min(grey.height));
    let mut of_rows = vec![0.0_f32; bottom.saturating_sub(y)];
    let mut of_columns = vec![0.0_f32; right.saturating_sub(x)];
    let mut above: Option<&[u8]> = None;
    for (row, sum) in grey.rows().skip(y).zip(&mut of_rows) {
        let row = row.get(x..right).unwrap_or_default();
        for pair in row.windows(2) {
            let difference = f32::from(pair[1]) - f32::from(pair[0]);
            *sum += difference * difference;
        }
        if let Some(above) = above {
            for ((sum, &a), &b) in of_columns.iter_mut().zip(above).zip(row) {
                *sum += (f32::from(b) - f32::from(a)).powi(2);
            }
        }
        above = Some(row);
    }
    (relative(&of_rows), relative(&of_columns))
}

fn relative(information: &[f32]) -> Profile {
    let size = information.len().div_ceil(PROFILE).max(1);
    let groups: Vec<f32> = information
        .chunks(size)
        .map(|group| group.iter().sum::<f32>() / group.len() as f32)
        .collect();
    let mut order: Vec<f32> = groups.iter().copied().filter(|&v| v > 0.0).collect();
    order.sort_by(f32::total_cmp);
    let middle = order.get(order.len() / 2).copied().unwrap_or(1.0);
    // A hundredth of the usual is noise.
    let known = |v: f32| (v > 0.01 * middle).then(|| (middle / v).sqrt());
    groups.into_iter().map(known).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Layout;
    use rowtone::camera::RawFormat;

    fn shot(width: u16, height: u16, bayer: bool, value: impl Fn(usize, usize) -> u8) -> Shot {
        let pixels =
            (0..usize::from(height)).flat_map(|y| (0..usize::from(width)).map(move |x| (x, y)));
        Shot {
            number: 1,
            frame: 0,
            start_ns: 0,
            layout: Layout {
                width,
                height,
                stride: width.into(),
                format: RawFormat::Raw8,
                bayer,
            },
            bytes: pixels.map(|(x, y)| value(x, y)).collect(),
        }
    }

    #[test]
    fn wide_pictures_and_colours_are_averaged() {
        let wide = Grey::of(&shot(3000, 30, false, |_, _| 7));
        assert_eq!((wide.width, wide.height, wide.shrunk), (1000, 10, 3));
        assert!(wide.values.iter().all(|&v| v == 7));
        let bayer = Grey::of(&shot(
            8,
            8,
            true,
            |x, y| if (x + y) % 2 == 0 { 200 } else { 100 },
        ));
        assert_eq!((bayer.width, bayer.height), (4, 4));
        assert!(bayer.values.iter().all(|&v| v == 150));
    }

    #[test]
    fn a_jpeg_is_one() {
        let jpeg = Grey::of(&shot(40, 30, false, |x, y| (x * y) as u8))
            .jpeg()
            .unwrap();
        assert!(jpeg.starts_with(&[0xff, 0xd8, 0xff]) && jpeg.ends_with(&[0xff, 0xd9]));
        assert!(jpeg.len() < 2000);
    }

    #[test]
    fn sharper_means_more_focus() {
        let stripes = |length: f64| {
            move |x: usize, _: usize| (128.0 + 100.0 * (x as f64 / length).sin()) as u8
        };
        let focus = |length| {
            Aim::of(
                &Grey::of(&shot(200, 20, false, stripes(length))),
                [0, 0, 200, 20],
            )
            .focus
        };
        assert!(focus(1.0) > 2.0 * focus(2.0) && focus(2.0) > 2.0 * focus(4.0));
        let even = Aim::of(
            &Grey::of(&shot(200, 20, false, |_, _| 255)),
            [0, 0, 200, 20],
        );
        assert_eq!((even.focus, even.bright, even.dark), (0.0, 100.0, 0.0));
        assert_eq!((even.mean, even.histogram[31]), (100.0, 100.0));
    }

    #[test]
    fn rows_without_texture_know_nothing() {
        // The upper half has upright stripes, the lower half lying ones.
        let half = |x: usize, y: usize| match y {
            0..16 => 80 + 40 * (x % 4) as u8,
            _ => 80 + 40 * (y % 4) as u8,
        };
        let aim = Aim::of(&Grey::of(&shot(64, 32, false, half)), [0, 0, 64, 32]);
        assert_eq!(aim.rows.len(), 32);
        assert!(
            aim.rows[..16]
                .iter()
                .all(|v| v.is_some_and(|sd| (sd - 1.0).abs() < 0.01))
        );
        assert!(aim.rows[16..].iter().all(Option::is_none));
        assert!(aim.columns.iter().all(Option::is_some));
        // A part outside the picture is no reason to fall.
        assert_eq!(
            Aim::of(&Grey::of(&shot(64, 32, false, half)), [60, 30, 900, 900])
                .rows
                .len(),
            2
        );
    }
}
