//! Curves over one axis.

use plotters::coord::Shift;
use plotters::prelude::*;
use rowtone_plot::{DrawError, Drawing};

use super::COLOURS;

/// One curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// What it is.
    pub name: String,
    /// Its points.
    pub points: Vec<(f64, f64)>,
}

/// The drawing. What lies beyond the axes is not drawn.
#[derive(Clone, Debug)]
pub struct Lines {
    /// What to write above.
    pub title: String,
    /// What the axes are.
    pub axes: [&'static str; 2],
    /// From where to where across.
    pub across: (f64, f64),
    /// From where to where upwards.
    pub up: (f64, f64),
    /// The curves, in the order of the colours.
    pub curves: Vec<Curve>,
    /// Points as dots, not joined.
    pub dots: bool,
}

impl Drawing for Lines {
    fn size(&self) -> (u32, u32) {
        (860, 420)
    }

    fn draw<B>(&self, root: &DrawingArea<B, Shift>) -> Result<(), DrawError>
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        root.fill(&WHITE)?;
        let font = |size: u32| ("sans-serif", size).into_font();
        let mut chart = ChartBuilder::on(root)
            .caption(&self.title, font(17))
            .margin(12)
            .margin_right(24)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(self.across.0..self.across.1, self.up.0..self.up.1)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(226, 230, 234))
            .label_style(font(14))
            .axis_desc_style(font(15))
            .x_desc(self.axes[0])
            .y_desc(self.axes[1])
            .draw()?;
        for (curve, (r, g, b)) in self.curves.iter().zip(COLOURS.into_iter().cycle()) {
            let colour = RGBColor(r, g, b);
            let inside = curve.points.iter().copied().filter(|p| {
                (self.across.0..=self.across.1).contains(&p.0)
                    && (self.up.0..=self.up.1).contains(&p.1)
            });
            let key = move |(x, y)| Rectangle::new([(x, y - 4), (x + 16, y + 4)], colour.filled());
            if self.dots {
                chart
                    .draw_series(inside.map(|p| Circle::new(p, 3, colour.filled())))?
                    .label(&curve.name)
                    .legend(key);
            } else {
                chart
                    .draw_series(LineSeries::new(inside, colour.stroke_width(2)))?
                    .label(&curve.name)
                    .legend(key);
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(226, 230, 234))
            .label_font(font(14))
            .draw()?;
        Ok(())
    }
}
