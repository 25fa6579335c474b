//! Shapes side by side: the still picture in grey, amplitudes as colour, orbits enlarged.

use plotters::prelude::*;

use super::draw::{Area, Drawn, INK, font, shade};
use super::file::Drawing;

/// Width of one picture of the plate, in the drawing's unit.
const WIDTH: f64 = 560.0;
/// Around and above each: title, scale and colours.
const LEFT: i32 = 16;
const ABOVE: i32 = 40;
const RIGHT: i32 = 96;
const BELOW: i32 = 34;
/// Share of the colour in a tile that moves; the rest is the picture.
const COLOUR: f64 = 0.6;
/// The largest orbit reaches so far, in tiles.
const REACH: f64 = 0.8;
/// Corners of an orbit.
const CORNERS: usize = 24;
/// More orbits than this in a picture are a carpet: then only every second tile of every second row has one.
const MOST_ORBITS: usize = 1500;
/// Steps of the colour bar.
const STEPS: i32 = 48;

/// A tile's motion, px: real and imaginary part of X along x and of Y along y, where the motion is Re X·e^(iωt).
pub type Phasors = [[f64; 2]; 2];

/// The shape of one tone.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What to write above.
    pub title: String,
    /// Frequency of the tone, Hz.
    pub hz: f64,
    /// Of each tile, row by row; `None` where nothing moves, which is not drawn.
    pub tiles: Vec<Option<Phasors>>,
}

/// All that is drawn.
#[derive(Clone, Debug)]
pub struct Plate<'a> {
    /// The still picture, grey values row by row.
    pub picture: &'a [f32],
    /// Its width and height, px.
    pub size: (usize, usize),
    /// Side of a tile, px.
    pub tile_px: usize,
    /// One picture each.
    pub panels: Vec<Panel>,
}

impl Panel {
    /// The largest semi-axis of all tiles, px.
    pub(crate) fn largest_px(&self) -> f64 {
        self.tiles
            .iter()
            .flatten()
            .map(semi_major)
            .fold(0.0, f64::max)
    }
}

impl Plate<'_> {
    /// Pictures side by side.
    pub(crate) fn across(&self) -> usize {
        let panels = self.panels.len().max(1);
        (1..).find(|n| n * n >= panels).unwrap_or(1)
    }

    /// Tiles side by side.
    pub(crate) fn columns(&self) -> usize {
        (self.size.0 / self.tile_px.max(1)).max(1)
    }

    /// Units of the drawing for a px of the picture.
    fn scale(&self) -> f64 {
        WIDTH / self.size.0.max(1) as f64
    }

    fn panel_size(&self) -> (i32, i32) {
        let height = self.scale() * self.size.1 as f64;
        (
            LEFT + WIDTH as i32 + RIGHT,
            ABOVE + height.ceil() as i32 + BELOW,
        )
    }
}

impl Drawing for Plate<'_> {
    fn size(&self) -> (u32, u32) {
        let ((width, height), across) = (self.panel_size(), self.across());
        let down = self.panels.len().max(1).div_ceil(across);
        (width as u32 * across as u32, height as u32 * down as u32)
    }

    fn draw<B>(&self, root: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        root.fill(&WHITE)?;
        let ((width, height), across) = (self.panel_size(), self.across());
        for (k, panel) in self.panels.iter().enumerate() {
            let corner = ((k % across) as i32 * width, (k / across) as i32 * height);
            let sheet = Sheet {
                plate: self,
                panel,
                corner: (corner.0 + LEFT, corner.1 + ABOVE),
                largest_px: panel.largest_px(),
            };
            sheet.draw(root)?;
        }
        Ok(())
    }
}

/// Grey values that are drawn as dark and as bright: all but a hundredth of the pixels lie within, on each side.
pub(crate) fn range_of(picture: &[f32]) -> [f64; 2] {
    let mut sorted: Vec<f32> = picture.iter().step_by(7).copied().collect();
    sorted.sort_by(f32::total_cmp);
    let quantile = |share: usize| {
        let at = sorted.get(sorted.len() * share / 100);
        f64::from(at.copied().unwrap_or(0.0))
    };
    [quantile(1), quantile(99).max(quantile(1) + 1.0)]
}

/// Length of the scale under a picture of this width, px.
pub(crate) fn scale_bar_px(width: usize) -> usize {
    let lengths = [200, 100, 50, 20, 10];
    lengths.into_iter().find(|&px| px * 4 <= width).unwrap_or(5)
}

/// The larger semi-axis of an orbit.
pub(crate) fn semi_major([x, y]: &Phasors) -> f64 {
    let sum = x[0] * x[0] + x[1] * x[1] + y[0] * y[0] + y[1] * y[1];
    let re = x[0] * x[0] - x[1] * x[1] + y[0] * y[0] - y[1] * y[1];
    let im = 2.0 * (x[0] * x[1] + y[0] * y[1]);
    (0.5 * (sum + re.hypot(im))).sqrt()
}

/// One picture of the plate.
struct Sheet<'a> {
    plate: &'a Plate<'a>,
    panel: &'a Panel,
    corner: (i32, i32),
    largest_px: f64,
}

impl Sheet<'_> {
    fn at(&self, x: f64, y: f64) -> (i32, i32) {
        let scale = self.plate.scale();
        let unit = |v: f64| (v * scale).round() as i32;
        (self.corner.0 + unit(x), self.corner.1 + unit(y))
    }

    fn draw<B>(&self, root: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        self.picture(root)?;
        self.orbits(root)?;
        self.legend(root)
    }

    /// The still picture in pieces, coloured where something moves.
    fn picture<B>(&self, root: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let (width, height) = self.plate.size;
        let tile = self.plate.tile_px;
        let piece = (tile / 4).max(2);
        let columns = width / tile;
        let [dark, bright] = range_of(self.plate.picture);
        for y in (0..height).step_by(piece) {
            for x in (0..width).step_by(piece) {
                let (x_to, y_to) = ((x + piece).min(width), (y + piece).min(height));
                let rows = (y..y_to)
                    .filter_map(|y| self.plate.picture.get(y * width + x..y * width + x_to));
                let sum: f64 = rows.flatten().map(|&grey| f64::from(grey)).sum();
                let mean = sum / ((x_to - x) * (y_to - y)) as f64;
                let grey = 40.0 + 200.0 * ((mean - dark) / (bright - dark)).clamp(0.0, 1.0);
                let moving = if x / tile < columns {
                    self.panel
                        .tiles
                        .get(y / tile * columns + x / tile)
                        .copied()
                        .flatten()
                } else {
                    None
                };
                let plain = RGBColor(grey as u8, grey as u8, grey as u8);
                let colour = moving.map_or(plain, |phasors| {
                    let RGBColor(r, g, b) = shade(semi_major(&phasors) / self.largest_px);
                    let mix = |v: u8| (COLOUR * f64::from(v) + (1.0 - COLOUR) * grey) as u8;
                    RGBColor(mix(r), mix(g), mix(b))
                });
                // A little larger than it is, so that no seam shows; what comes next covers the rest.
                let seam = |to: usize, all: usize| if to < all { 1 } else { 0 };
                let (right, bottom) = self.at(x_to as f64, y_to as f64);
                let corners = [
                    self.at(x as f64, y as f64),
                    (right + seam(x_to, width), bottom + seam(y_to, height)),
                ];
                root.draw(&Rectangle::new(corners, colour.filled()))?;
            }
        }
        Ok(())
    }

    /// What each tile does in a period, with a dot where it is when the largest tile is at its furthest.
    fn orbits<B>(&self, root: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let tile = self.plate.tile_px;
        let columns = (self.plate.size.0 / tile).max(1);
        let crowded = self.panel.tiles.iter().flatten().count() > MOST_ORBITS;
        let enlarged = self.enlarged();
        for (k, phasors) in self.panel.tiles.iter().enumerate() {
            let (column, row) = (k % columns, k / columns);
            let Some([x, y]) = phasors.filter(|_| !crowded || (column % 2 == 0 && row % 2 == 0))
            else {
                continue;
            };
            let middle = |at: usize| (at as f64 + 0.5) * tile as f64;
            let place = |turn: f64| {
                let (sin, cos) = turn.sin_cos();
                let away = |v: [f64; 2]| enlarged * (v[0] * cos - v[1] * sin);
                self.at(middle(column) + away(x), middle(row) + away(y))
            };
            let turns = (0..=CORNERS).map(|k| std::f64::consts::TAU * k as f64 / CORNERS as f64);
            root.draw(&PathElement::new(
                turns.map(place).collect::<Vec<_>>(),
                WHITE.stroke_width(1),
            ))?;
            root.draw(&Circle::new(place(0.0), 2, WHITE.filled()))?;
        }
        Ok(())
    }

    /// Orbits are so many times as large as they are in the picture.
    fn enlarged(&self) -> f64 {
        let reach = REACH * self.plate.tile_px as f64;
        if self.largest_px > 0.0 {
            reach / self.largest_px
        } else {
            0.0
        }
    }

    /// Title, colours with their amplitudes, and a scale.
    fn legend<B>(&self, root: &Area<B>) -> Drawn
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let (width, height) = self.plate.size;
        let (left, top) = self.at(0.0, 0.0);
        let (right, bottom) = self.at(width as f64, height as f64);
        root.draw(&Text::new(
            self.panel.title.as_str(),
            (left, top - 28),
            font(18),
        ))?;
        let bar = right + 14;
        let level = |step: i32| bottom - (bottom - top) * step / STEPS;
        for step in 0..STEPS {
            let colour = shade(f64::from(step) / f64::from(STEPS - 1));
            let top = (level(step + 1) - 1).max(top);
            let corners = [(bar, top), (bar + 14, level(step))];
            root.draw(&Rectangle::new(corners, colour.filled()))?;
        }
        for share in [0, 1, 2] {
            let px = self.largest_px * f64::from(share) / 2.0;
            let y = (level(STEPS * share / 2) - 7).clamp(top - 4, bottom - 10);
            root.draw(&Text::new(format!("{px:.3}"), (bar + 19, y), font(13)))?;
        }
        root.draw(&Text::new("px", (bar, top - 20), font(13)))?;
        let length = scale_bar_px(width);
        let (from, to) = (
            self.at(0.0, height as f64),
            self.at(length as f64, height as f64),
        );
        let y = from.1 + 12;
        root.draw(&PathElement::new(
            vec![(from.0, y), (to.0, y)],
            INK.stroke_width(2),
        ))?;
        let text = format!("{length} px; orbits enlarged {:.0} times", self.enlarged());
        root.draw(&Text::new(text, (to.0 + 8, y - 7), font(13)))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_still_tile_has_no_colour_and_a_moving_one_has() {
        let picture = vec![100.0; 32 * 16];
        let plate = Plate {
            picture: &picture,
            size: (32, 16),
            tile_px: 16,
            panels: vec![
                Panel {
                    title: "131.700 Hz".to_owned(),
                    hz: 131.7,
                    tiles: vec![None, Some([[0.05, 0.0], [0.0, 0.02]])],
                };
                3
            ],
        };
        let svg = crate::svg(&plate).expect("a drawing");
        assert_eq!(svg.matches("131.700 Hz").count(), 3);
        assert_eq!(
            svg.matches("<circle").count(),
            3,
            "an orbit where something moves"
        );
        assert!(
            svg.contains("0.050") && svg.contains("enlarged 256 times"),
            "{svg}"
        );
        let png = crate::png(&plate).expect("a drawing");
        assert!(png.starts_with(b"\x89PNG"));
    }

    #[test]
    fn the_semi_axis_of_a_circle_is_its_radius_and_of_a_line_its_half() {
        let circle = semi_major(&[[0.3, 0.0], [0.0, 0.3]]);
        assert!((circle - 0.3).abs() < 1e-12);
        let line = semi_major(&[[0.3, 0.0], [-0.4, 0.0]]);
        assert!((line - 0.5).abs() < 1e-12);
    }
}
