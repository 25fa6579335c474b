//! The recording itself: a frame with the part that is measured, and which of its rows and columns know something.

use plotters::prelude::*;

use super::draw::{Area, Drawn, INK, MUTED, X_AXIS, Y_AXIS, font};

/// Places of the picture along its longer side.
const PIECES: usize = 180;
/// Grey levels that are told apart: neighbours of one level are drawn as one.
const LEVELS: f32 = 48.0;
/// Beside the picture, for what rows and columns know, in the drawing's unit.
const PROFILE: i32 = 34;
const GAP: i32 = 6;
/// A row or column knows something where its slope has more power than this share of the best one's.
const KNOWS: f32 = 0.02;

/// A frame and the part of it that is measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Photo {
    /// Grey values from 0 to 255, row by row, as the rows are measured.
    pub grey: Vec<u8>,
    /// Width and height, px.
    pub size: (usize, usize),
    /// The part: left, top, width, height, px.
    pub part: [usize; 4],
}

/// What the rows and the columns of the part know of motion along x and along y, each from 0 to 1.
struct Known {
    rows: [Vec<f32>; 2],
    columns: [Vec<f32>; 2],
}

impl Photo {
    fn is_whole(&self) -> bool {
        let (width, height) = self.size;
        let [x, y, w, h] = self.part;
        let fits = x + w <= width && y + h <= height && w > 0 && h > 0;
        fits && self.grey.len() == width * height
    }

    fn at(&self, x: usize, y: usize) -> f32 {
        f32::from(self.grey[y * self.size.0 + x])
    }

    /// Power of the slopes.
    fn known(&self) -> Known {
        let [left, top, w, h] = self.part;
        let mut known = Known {
            rows: [vec![0.0; h], vec![0.0; h]],
            columns: [vec![0.0; w], vec![0.0; w]],
        };
        for y in 1..h.saturating_sub(1) {
            for x in 1..w.saturating_sub(1) {
                let (px, py) = (left + x, top + y);
                let across = 0.5 * (self.at(px + 1, py) - self.at(px - 1, py));
                let down = 0.5 * (self.at(px, py + 1) - self.at(px, py - 1));
                for (axis, slope) in [across, down].into_iter().enumerate() {
                    known.rows[axis][y] += slope * slope;
                    known.columns[axis][x] += slope * slope;
                }
            }
        }
        for lines in [&mut known.rows, &mut known.columns] {
            // The slope at an edge is taken for its neighbour's.
            for line in lines.iter_mut().filter(|line| line.len() > 2) {
                let last = line.len() - 1;
                (line[0], line[last]) = (line[1], line[last - 1]);
            }
            let most = lines.iter().flatten().fold(1e-6_f32, |a, b| a.max(*b));
            lines.iter_mut().flatten().for_each(|v| *v /= most);
        }
        known
    }

    /// Draws it into an area, with the profiles below and to the right.
    pub(super) fn draw<B>(&self, area: &Area<B>, axes: usize) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        if !self.is_whole() {
            return Ok(());
        }
        let (width, height) = area.dim_in_pixel();
        let (left, top) = (24, 44);
        let room = (
            width as i32 - left - PROFILE - GAP - 12,
            height as i32 - top - PROFILE - GAP - 40,
        );
        let scale = (f64::from(room.0) / self.size.0 as f64)
            .min(f64::from(room.1) / self.size.1 as f64)
            .max(1e-3);
        let sheet = Sheet {
            photo: self,
            scale,
            corner: (left, top),
        };
        area.draw(&Text::new(
            "What is measured: the part in the frame",
            (left, 12),
            font(16),
        ))?;
        sheet.pieces(area)?;
        sheet.part(area)?;
        sheet.profiles(area, axes)
    }
}

struct Sheet<'a> {
    photo: &'a Photo,
    scale: f64,
    corner: (i32, i32),
}

impl Sheet<'_> {
    fn at(&self, x: usize, y: usize) -> (i32, i32) {
        let unit = |v: usize| (v as f64 * self.scale).round() as i32;
        (self.corner.0 + unit(x), self.corner.1 + unit(y))
    }

    fn pieces<B>(&self, area: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let (width, height) = self.photo.size;
        let piece = width.max(height).div_ceil(PIECES).max(1);
        let mut sorted: Vec<u8> = self.photo.grey.iter().step_by(13).copied().collect();
        sorted.sort_unstable();
        let dark = f32::from(sorted[sorted.len() / 100]);
        let bright = f32::from(sorted[sorted.len() * 99 / 100]).max(dark + 8.0);
        for y in (0..height).step_by(piece) {
            let y_to = (y + piece).min(height);
            let level = |x: usize| {
                let x_to = (x + piece).min(width);
                let row = |y: usize| (x..x_to).map(move |x| self.photo.at(x, y)).sum::<f32>();
                let mean = (y..y_to).map(row).sum::<f32>() / ((x_to - x) * (y_to - y)) as f32;
                (LEVELS * ((mean - dark) / (bright - dark)).clamp(0.0, 1.0)).round() as u8
            };
            let levels: Vec<u8> = (0..width).step_by(piece).map(level).collect();
            let mut from = 0;
            for run in levels.chunk_by(|a, b| a == b) {
                let to = from + run.len();
                let grey = (60.0 + 185.0 * f32::from(run[0]) / LEVELS) as u8;
                let corners = [
                    self.at(from * piece, y),
                    self.at((to * piece).min(width), y_to),
                ];
                let colour = RGBColor(grey, grey, grey);
                area.draw(&Rectangle::new(corners, colour.filled()))?;
                from = to;
            }
        }
        Ok(())
    }

    fn part<B>(&self, area: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let [x, y, w, h] = self.photo.part;
        let corners = [self.at(x, y), self.at(x + w, y + h)];
        area.draw(&Rectangle::new(corners, WHITE.stroke_width(4)))?;
        area.draw(&Rectangle::new(corners, INK.stroke_width(2)))?;
        Ok(())
    }

    /// Bars beside the part, as long as what each row and column knows.
    fn profiles<B>(&self, area: &Area<B>, axes: usize) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let known = self.photo.known();
        let [left, top, w, h] = self.photo.part;
        let (right, bottom) = self.at(self.photo.size.0, self.photo.size.1);
        let colours = [X_AXIS, Y_AXIS];
        let bar = |v: f32| (f64::from(PROFILE) * f64::from(v.sqrt())).round() as i32;
        for (axis, colour) in colours.into_iter().enumerate().take(axes) {
            let places = |values: &[f32], start: usize, is_row: bool| -> Vec<(i32, i32)> {
                let point = |(i, v): (usize, &f32)| {
                    if is_row {
                        (right + GAP + bar(*v), self.at(0, start + i).1)
                    } else {
                        (self.at(start + i, 0).0, bottom + GAP + bar(*v))
                    }
                };
                values.iter().enumerate().map(point).collect()
            };
            let rows = places(&known.rows[axis], top, true);
            let columns = places(&known.columns[axis], left, false);
            area.draw(&PathElement::new(rows, colour.stroke_width(1)))?;
            area.draw(&PathElement::new(columns, colour.stroke_width(1)))?;
        }
        let [x0, y0] = [self.at(left, 0).0, self.at(0, top).1];
        let [x1, y1] = [self.at(left + w, 0).0, self.at(0, top + h).1];
        let lines = [
            vec![(right + GAP, y0), (right + GAP, y1)],
            vec![(x0, bottom + GAP), (x1, bottom + GAP)],
        ];
        for line in lines {
            area.draw(&PathElement::new(line, MUTED.stroke_width(1)))?;
        }
        let share = |lines: &[Vec<f32>; 2]| {
            let count = lines[0].len().max(1);
            let knows = |i: &usize| lines.iter().take(axes).any(|v| v[*i] > KNOWS);
            100 * (0..count).filter(knows).count() / count
        };
        let text = format!(
            "{} % of the rows and {} % of the columns know something",
            share(&known.rows),
            share(&known.columns)
        );
        let below = bottom + GAP + PROFILE + 6;
        area.draw(&Text::new(text, (self.corner.0, below), font(13)))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stripes from top to bottom in the right half: all rows know of motion along x, the right half of the columns does.
    #[test]
    fn texture_is_where_it_is() {
        let value = |x: usize| {
            if x >= 20 && (x / 2).is_multiple_of(2) {
                200
            } else {
                100
            }
        };
        let photo = Photo {
            grey: (0..40 * 30).map(|i| value(i % 40)).collect(),
            size: (40, 30),
            part: [0, 0, 40, 30],
        };
        let known = photo.known();
        assert!(known.rows[0].iter().all(|v| *v > 0.9));
        assert!(known.columns[0][..18].iter().all(|v| *v == 0.0));
        assert!(known.columns[0][21..].iter().all(|v| *v > 0.2));
        assert!(
            known.rows[1]
                .iter()
                .chain(&known.columns[1])
                .all(|v| *v == 0.0)
        );
        let beyond = Photo {
            part: [10, 0, 40, 30],
            ..photo
        };
        assert!(!beyond.is_whole());
    }
}
