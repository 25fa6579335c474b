//! Drawings as pixels: a backend for plotters with smooth edges and a font that comes with the program.
//!
//! The drawing's own unit is kept ([`DrawingBackend::get_size`]); a pixel of the picture is `1/scale` of it. A line
//! or a dot covers a pixel by how near its middle is, a filled polygon by the exact share of its area.

use std::convert::Infallible;

use ab_glyph_rasterizer::{Point, Rasterizer, point};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};

use crate::glyphs;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// A picture in the making, RGB with 8 bits, white at first.
#[derive(Clone, Debug)]
pub(crate) struct Canvas {
    size: (u32, u32),
    scale: f32,
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

/// How much of each pixel of a rectangle is covered, from 0 to 1.
struct Coverage {
    left: i32,
    top: i32,
    width: usize,
    shares: Vec<f32>,
}

impl Coverage {
    /// Room for what lies between two corners (in pixels, their order is free) and `margin` around, as far as it is
    /// on the canvas.
    fn new(canvas: &Canvas, corners: [Point; 2], margin: f32) -> Self {
        let span = |a: f32, b: f32, end: usize| {
            let end = end as f32;
            let from = (a.min(b) - margin).floor().clamp(0.0, end);
            let to = (a.max(b) + margin).ceil().clamp(from, end);
            (from as i32, (to - from) as usize)
        };
        let [a, b] = corners;
        let (left, width) = span(a.x, b.x, canvas.width);
        let (top, height) = span(a.y, b.y, canvas.height);
        Self {
            left,
            top,
            width,
            shares: vec![0.0; width * height],
        }
    }

    /// Covers each pixel between the two corners by what `share` says of its middle, where that is more than there is.
    fn cover(&mut self, corners: [Point; 2], margin: f32, share: impl Fn(Point) -> f32) {
        let [a, b] = corners;
        let height = self.shares.len() / self.width.max(1);
        let span = |a: f32, b: f32, start: i32, count: usize| {
            let from = ((a.min(b) - margin).floor() as i32 - start).clamp(0, count as i32);
            let to = ((a.max(b) + margin).ceil() as i32 - start).clamp(from, count as i32);
            from as usize..to as usize
        };
        let columns = span(a.x, b.x, self.left, self.width);
        for y in span(a.y, b.y, self.top, height) {
            let row = &mut self.shares[y * self.width..(y + 1) * self.width];
            for (x, covered) in row
                .iter_mut()
                .enumerate()
                .take(columns.end)
                .skip(columns.start)
            {
                let middle = point(
                    (self.left + x as i32) as f32 + 0.5,
                    (self.top + y as i32) as f32 + 0.5,
                );
                *covered = covered.max(share(middle).clamp(0.0, 1.0));
            }
        }
    }
}

/// Distance of `p` from the line between two points.
fn distance(p: Point, [a, b]: [Point; 2]) -> f32 {
    let (along, to) = (b - a, p - a);
    let square = along.x * along.x + along.y * along.y;
    let part = match square > 0.0 {
        true => ((to.x * along.x + to.y * along.y) / square).clamp(0.0, 1.0),
        false => 0.0,
    };
    (to.x - part * along.x).hypot(to.y - part * along.y)
}

/// The corners of the smallest rectangle around some points; `None` of no points.
fn bounds(points: &[Point]) -> Option<[Point; 2]> {
    points.iter().fold(None, |bounds, p| {
        let [a, b] = bounds.unwrap_or([*p; 2]);
        Some([
            point(a.x.min(p.x), a.y.min(p.y)),
            point(b.x.max(p.x), b.y.max(p.y)),
        ])
    })
}

impl Canvas {
    /// For a drawing of `size`, each of its units `scale` pixels.
    pub(crate) fn new(size: (u32, u32), scale: f32) -> Self {
        let pixels = |length: u32| (length as f32 * scale).ceil() as usize;
        let (width, height) = (pixels(size.0), pixels(size.1));
        Self {
            size,
            scale,
            width,
            height,
            pixels: vec![u8::MAX; 3 * width * height],
        }
    }

    /// Columns, rows and the pixels row by row: red, green, blue.
    pub(crate) fn picture(&self) -> (u32, u32, &[u8]) {
        (self.width as u32, self.height as u32, &self.pixels)
    }

    /// Sets one pixel; nothing outside the picture.
    pub(crate) fn set(&mut self, x: usize, y: usize, rgb: [u8; 3]) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.pixels[at..at + 3].copy_from_slice(&rgb);
        }
    }

    /// A place in pixels. What lies far outside is moved nearer, so that it costs no time.
    fn place(&self, (x, y): BackendCoord) -> Point {
        let far = |v: i32, size: usize| {
            let size = size as f32;
            (v as f32 * self.scale).clamp(-size, 2.0 * size)
        };
        point(far(x, self.width), far(y, self.height))
    }

    /// Mixes a colour into one pixel; nothing outside the picture.
    fn mix(&mut self, x: i32, y: i32, colour: BackendColor, share: f32) {
        let inside = |v: i32, size: usize| usize::try_from(v).ok().filter(|v| *v < size);
        let (Some(x), Some(y)) = (inside(x, self.width), inside(y, self.height)) else {
            return;
        };
        let share = share.clamp(0.0, 1.0) * colour.alpha as f32;
        let at = 3 * (y * self.width + x);
        let (r, g, b) = colour.rgb;
        for (old, new) in self.pixels[at..at + 3].iter_mut().zip([r, g, b]) {
            let mixed = f32::from(*old) + share * (f32::from(new) - f32::from(*old));
            *old = mixed.round() as u8;
        }
    }

    fn lay(&mut self, coverage: &Coverage, colour: BackendColor) {
        for (y, row) in (coverage.top..).zip(coverage.shares.chunks(coverage.width.max(1))) {
            for (x, &share) in (coverage.left..).zip(row) {
                if share > 0.0 {
                    self.mix(x, y, colour, share);
                }
            }
        }
    }

    /// A line through some places, in drawing units wide.
    pub(crate) fn stroke(&mut self, points: &[Point], width: u32, colour: BackendColor) {
        let Some(around) = bounds(points) else {
            return;
        };
        let half = 0.5 * width as f32 * self.scale;
        // A line narrower than a pixel is a pixel wide, and fainter.
        let (half, strength) = (half.max(0.5), (2.0 * half).min(1.0));
        let mut coverage = Coverage::new(self, around, half + 1.0);
        for pair in points.windows(2) {
            let ends = [pair[0], pair[1]];
            coverage.cover(ends, half + 1.0, |p| {
                strength * (half + 0.5 - distance(p, ends))
            });
        }
        self.lay(&coverage, colour);
    }

    fn ring(
        &mut self,
        middle: Point,
        share: impl Fn(f32) -> f32,
        reach: f32,
        colour: BackendColor,
    ) {
        let mut coverage = Coverage::new(self, [middle; 2], reach);
        coverage.cover([middle; 2], reach, |p| {
            share((p.x - middle.x).hypot(p.y - middle.y))
        });
        self.lay(&coverage, colour);
    }
}

/// What draws on a canvas.
#[derive(Debug)]
pub(crate) struct Pen<'a>(pub(crate) &'a mut Canvas);

impl DrawingBackend for Pen<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.0.size
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        self.draw_rect((x, y), (x + 1, y + 1), &colour, true)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<Point> = path.into_iter().map(|at| self.0.place(at)).collect();
        self.0.stroke(&points, style.stroke_width(), style.color());
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let (a, b) = (self.0.place(upper_left), self.0.place(bottom_right));
        if !fill {
            let corners = [a, point(b.x, a.y), b, point(a.x, b.y), a];
            self.0.stroke(&corners, style.stroke_width(), style.color());
            return Ok(());
        }
        let share = |middle: f32, a: f32, b: f32| {
            (middle + 0.5).min(a.max(b)) - (middle - 0.5).max(a.min(b))
        };
        let mut coverage = Coverage::new(self.0, [a, b], 1.0);
        coverage.cover([a, b], 1.0, |p| {
            share(p.x, a.x, b.x).max(0.0) * share(p.y, a.y, b.y).max(0.0)
        });
        self.0.lay(&coverage, style.color());
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let middle = self.0.place(center);
        let radius = radius as f32 * self.0.scale;
        let half = 0.5 * style.stroke_width() as f32 * self.0.scale;
        let colour = style.color();
        if fill {
            self.0
                .ring(middle, |d| radius + 0.5 - d, radius + 1.0, colour);
        } else {
            let reach = radius + half + 1.0;
            self.0
                .ring(middle, |d| half + 0.5 - (d - radius).abs(), reach, colour);
        }
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        vert: I,
        style: &S,
    ) -> Drawn {
        let points: Vec<Point> = vert.into_iter().map(|at| self.0.place(at)).collect();
        let Some([a, b]) = bounds(&points) else {
            return Ok(());
        };
        let (left, top) = (a.x.floor(), a.y.floor());
        let size = |from: f32, to: f32| (to - from).ceil() as usize + 1;
        let mut rasterizer = Rasterizer::new(size(left, b.x), size(top, b.y));
        let moved = |p: Point| point(p.x - left, p.y - top);
        for (k, &from) in points.iter().enumerate() {
            rasterizer.draw_line(moved(from), moved(points[(k + 1) % points.len()]));
        }
        let colour = style.color();
        rasterizer.for_each_pixel_2d(|x, y, share| {
            self.0
                .mix(left as i32 + x as i32, top as i32 + y as i32, colour, share);
        });
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, at: BackendCoord) -> Drawn {
        let at = self.0.place(at);
        let colour = style.color();
        glyphs::draw(text, style, self.0.scale, |x, y, share| {
            self.0.mix(
                (at.x + x).floor() as i32,
                (at.y + y).floor() as i32,
                colour,
                share,
            );
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLACK: BackendColor = BackendColor {
        alpha: 1.0,
        rgb: (0, 0, 0),
    };

    struct Line(u32);

    impl BackendStyle for Line {
        fn color(&self) -> BackendColor {
            BLACK
        }

        fn stroke_width(&self) -> u32 {
            self.0
        }
    }

    /// Ink in a picture, pixels that are wholly black counting as one.
    fn ink(canvas: &Canvas) -> f64 {
        let (_, _, pixels) = canvas.picture();
        pixels
            .iter()
            .map(|&v| f64::from(255 - v) / 255.0)
            .sum::<f64>()
            / 3.0
    }

    #[test]
    fn shapes_hold_as_much_ink_as_their_area() {
        let draw = |scale: f32, shape: &dyn Fn(Pen<'_>) -> Drawn| {
            let mut canvas = Canvas::new((100, 80), scale);
            shape(Pen(&mut canvas)).expect("cannot fail");
            ink(&canvas) / f64::from(scale * scale)
        };
        for scale in [1.0, 1.5, 2.3] {
            let rect = draw(scale, &|mut c| {
                c.draw_rect((10, 20), (33, 41), &BLACK, true)
            });
            assert!((rect - 483.0).abs() < 2.0, "{scale}: {rect}");
            let circle = draw(scale, &|mut c| c.draw_circle((50, 40), 10, &BLACK, true));
            assert!((circle - 314.16).abs() < 3.0, "{scale}: {circle}");
            let triangle = draw(scale, &|mut c| {
                c.fill_polygon([(10, 10), (60, 10), (10, 50)], &BLACK)
            });
            assert!((triangle - 1000.0).abs() < 3.0, "{scale}: {triangle}");
            // 50 long, 2 wide, and a round end at both sides.
            let line = draw(scale, &|mut c| c.draw_line((20, 20), (60, 50), &Line(2)));
            assert!((line - 103.14).abs() < 3.0, "{scale}: {line}");
        }
    }

    #[test]
    fn what_lies_outside_is_left_out() {
        let mut canvas = Canvas::new((40, 30), 1.5);
        let far = i32::MAX / 4;
        Pen(&mut canvas)
            .draw_rect((-far, -far), (-1, -1), &BLACK, true)
            .unwrap();
        Pen(&mut canvas)
            .draw_circle((far, far), 10, &BLACK, false)
            .unwrap();
        Pen(&mut canvas)
            .draw_line((-5, -far), (-5, far), &Line(1))
            .unwrap();
        Pen(&mut canvas)
            .fill_polygon([(50, 0), (far, 0), (far, far)], &BLACK)
            .unwrap();
        Pen(&mut canvas).draw_pixel((40, 30), BLACK).unwrap();
        assert_eq!(ink(&canvas), 0.0);
        Pen(&mut canvas).draw_path([], &Line(3)).unwrap();
        Pen(&mut canvas)
            .draw_rect((-far, -far), (far, far), &BLACK, true)
            .unwrap();
        assert_eq!(ink(&canvas), 60.0 * 45.0);
    }
}
