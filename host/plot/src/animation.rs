//! Shapes that swing: a mesh through the tiles' middles over one still picture, at the true phase, slowed and enlarged.
//!
//! The picture itself stands still: what moves is drawn, mesh and vectors, and no pixel of the recording is moved.

use ab_glyph_rasterizer::{Point, point};
use plotters::prelude::*;
use plotters_backend::BackendColor;

use crate::canvas::{Canvas, Pen};
use crate::draw::{INK, font, shade};
use crate::error::DrawError;
use crate::plate::{Panel, Plate, range_of, scale_bar_px, semi_major};

/// A period is shown in so many seconds.
pub(crate) const PERIOD_S: f64 = 1.92;
/// Width of one picture, pixels, at most.
const WIDTH: usize = 480;
/// Around each picture.
const MARGIN: usize = 10;
const ABOVE: usize = 26;
const BELOW: usize = 40;
/// The node that moves furthest goes so far, in meshes.
const REACH: f64 = 0.9;
/// No mesh has more nodes than this in a row.
const MOST_ACROSS: usize = 48;

/// A plate as one frame after the other.
#[derive(Debug)]
pub struct Animation<'a> {
    plate: &'a Plate<'a>,
    /// Pixels of a picture for one of the plate's.
    scale: f64,
    /// Of one picture, and of all.
    picture: [usize; 2],
    size: [usize; 2],
    /// Title, still pictures and scales, which every frame has.
    still: Canvas,
}

/// One of the pictures, and how it is enlarged.
struct Mesh<'a> {
    panel: &'a Panel,
    corner: [f64; 2],
    /// Tiles from one node to the next.
    stride: usize,
    largest_px: f64,
    enlarged: f64,
}

impl<'a> Animation<'a> {
    /// Prepares what every frame has.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn new(plate: &'a Plate<'a>) -> Result<Self, DrawError> {
        let scale = (WIDTH as f64 / plate.size.0.max(1) as f64).min(4.0);
        let side = |px: usize| ((px as f64 * scale).round() as usize).max(1);
        let picture = [side(plate.size.0), side(plate.size.1)];
        let across = plate.across();
        let down = plate.panels.len().max(1).div_ceil(across);
        let even = |length: usize| length.next_multiple_of(2);
        let size = [
            even(across * (picture[0] + 2 * MARGIN)),
            even(down * (picture[1] + ABOVE + BELOW)),
        ];
        let mut animation = Self {
            plate,
            scale,
            picture,
            size,
            still: Canvas::new((size[0] as u32, size[1] as u32), 1.0),
        };
        let mut still = animation.still.clone();
        for mesh in animation.meshes() {
            animation.paint(&mut still, &mesh);
            animation.label(&mut still, &mesh)?;
        }
        animation.still = still;
        Ok(animation)
    }

    /// Width and height, pixels; both are even.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The frame in which every tone has turned by this part of its period: red, green and blue, row by row.
    pub fn frame(&self, turn: f64) -> Vec<u8> {
        let mut canvas = self.still.clone();
        for mesh in self.meshes() {
            self.swing(&mut canvas, &mesh, turn);
        }
        canvas.picture().2.to_vec()
    }

    fn meshes(&self) -> impl Iterator<Item = Mesh<'a>> + use<'a> {
        let plate = self.plate;
        let across = plate.across();
        let cell = [
            self.picture[0] + 2 * MARGIN,
            self.picture[1] + ABOVE + BELOW,
        ];
        let stride = plate.columns().div_ceil(MOST_ACROSS).max(1);
        plate.panels.iter().enumerate().map(move |(k, panel)| {
            let largest_px = panel.largest_px();
            let reach = REACH * (stride * plate.tile_px) as f64;
            Mesh {
                panel,
                corner: [k % across * cell[0] + MARGIN, k / across * cell[1] + ABOVE]
                    .map(|at| at as f64),
                stride,
                largest_px,
                enlarged: if largest_px > 0.0 {
                    reach / largest_px
                } else {
                    0.0
                },
            }
        })
    }

    /// The still picture in grey.
    fn paint(&self, canvas: &mut Canvas, mesh: &Mesh<'_>) {
        let (width, height) = self.plate.size;
        let [dark, bright] = range_of(self.plate.picture);
        let span = |at: usize, all: usize| {
            let from = ((at as f64 / self.scale) as usize).min(all.saturating_sub(1));
            let to = ((at + 1) as f64 / self.scale) as usize;
            from..to.clamp(from + 1, all.max(from + 1))
        };
        for y in 0..self.picture[1] {
            for x in 0..self.picture[0] {
                let columns = span(x, width);
                let (mut sum, mut count) = (0.0, 0.0f64);
                for row in span(y, height) {
                    let own = row * width + columns.start..row * width + columns.end;
                    for grey in self.plate.picture.get(own).unwrap_or_default() {
                        sum += f64::from(*grey);
                        count += 1.0;
                    }
                }
                let share = (sum / count.max(1.0) - dark) / (bright - dark);
                let grey = (30.0 + 170.0 * share.clamp(0.0, 1.0)) as u8;
                let [left, top] = mesh.corner.map(|at| at as usize);
                canvas.set(left + x, top + y, [grey; 3]);
            }
        }
    }

    /// Title, and what is slowed and enlarged by how much.
    fn label(&self, canvas: &mut Canvas, mesh: &Mesh<'_>) -> Result<(), DrawError> {
        let [left, top] = mesh.corner.map(|at| at as i32);
        let bottom = top + self.picture[1] as i32;
        let area = DrawingArea::from(Pen(canvas));
        area.draw(&Text::new(
            mesh.panel.title.as_str(),
            (left, top - 20),
            font(14),
        ))?;
        let px = scale_bar_px(self.plate.size.0);
        let to = left + (px as f64 * self.scale).round() as i32;
        area.draw(&PathElement::new(
            vec![(left, bottom + 10), (to, bottom + 10)],
            INK.stroke_width(2),
        ))?;
        area.draw(&Text::new(
            format!("{px} px"),
            (to + 8, bottom + 3),
            font(13),
        ))?;
        let slowed = mesh.panel.hz * PERIOD_S;
        let words = if mesh.enlarged > 0.0 {
            format!(
                "slowed {slowed:.0} times, enlarged {:.0} times",
                mesh.enlarged
            )
        } else {
            "nothing moves".to_owned()
        };
        area.draw(&Text::new(words, (left, bottom + 20), font(13)))?;
        area.present()?;
        Ok(())
    }

    /// Mesh and vectors.
    fn swing(&self, canvas: &mut Canvas, mesh: &Mesh<'_>, turn: f64) {
        let plate = self.plate;
        let (columns, stride) = (plate.columns(), mesh.stride);
        let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
        let node = |tile: usize| -> Option<[Point; 2]> {
            let phasors = mesh.panel.tiles.get(tile).copied().flatten()?;
            let middle =
                [tile % columns, tile / columns].map(|at| (at as f64 + 0.5) * plate.tile_px as f64);
            let at = |enlarged: f64| {
                let place: [f64; 2] = core::array::from_fn(|axis| {
                    let [re, im] = phasors[axis];
                    let px = middle[axis] + enlarged * (re * cos - im * sin);
                    mesh.corner[axis] + px * self.scale
                });
                point(place[0] as f32, place[1] as f32)
            };
            Some([at(0.0), at(mesh.enlarged)])
        };
        let share = |tile: usize| {
            let phasors = mesh.panel.tiles.get(tile).copied().flatten();
            phasors.map_or(0.0, |p| semi_major(&p)) / mesh.largest_px.max(f64::MIN_POSITIVE)
        };
        let on_mesh = |at: usize| at.is_multiple_of(stride);
        let tiles = |k: &usize| on_mesh(k % columns) && on_mesh(k / columns);
        for tile in (0..mesh.panel.tiles.len()).filter(tiles) {
            let Some([rest, here]) = node(tile) else {
                continue;
            };
            canvas.stroke(&[rest, here], 1, colour(WHITE));
            let right = (tile % columns + stride < columns).then_some(tile + stride);
            for to in [right, Some(tile + stride * columns)].into_iter().flatten() {
                if let Some([_, there]) = node(to) {
                    let shade = shade(0.5 * (share(tile) + share(to)));
                    canvas.stroke(&[here, there], 2, colour(shade));
                }
            }
        }
    }
}

fn colour(RGBColor(r, g, b): RGBColor) -> BackendColor {
    BackendColor {
        alpha: 1.0,
        rgb: (r, g, b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_still_does_and_what_moves_comes_back_after_a_period() {
        let picture: Vec<f32> = (0..64 * 32).map(|at| (at % 64) as f32).collect();
        let moving = |px: f64| Some([[px, 0.0], [0.0, 0.5 * px]]);
        let panel = |tiles: Vec<_>| Panel {
            title: "131.700 Hz".to_owned(),
            hz: 131.7,
            tiles,
        };
        let mut tiles = vec![None; 8];
        (tiles[0], tiles[1]) = (moving(0.05), moving(-0.02));
        let plate = Plate {
            picture: &picture,
            size: (64, 32),
            tile_px: 16,
            panels: vec![panel(tiles), panel(vec![None; 8])],
        };
        let animation = Animation::new(&plate).expect("a drawing");
        let [width, height] = animation.size();
        let first = animation.frame(0.0);
        assert_eq!(first.len(), 3 * width * height);
        assert_eq!(animation.frame(1.0), first);
        let half = animation.frame(0.5);
        let differs = |from: usize, to: usize| {
            (0..height).any(|y| {
                let row = 3 * (y * width + from)..3 * (y * width + to);
                first[row.clone()] != half[row]
            })
        };
        assert!(differs(0, width / 2) && !differs(width / 2, width));
    }
}
