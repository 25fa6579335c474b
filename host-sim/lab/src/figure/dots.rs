//! One line a method: a dot a series, with a whisker from the least to the largest, on a logarithmic axis.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use rowtone_plot::{DrawError, Drawing};

use super::colour;

/// Least, middle and largest value.
pub type Range = [f64; 3];

/// The drawing.
#[derive(Clone, Debug, Default)]
pub struct Dots {
    /// What to write above.
    pub title: String,
    /// What stands at each line.
    pub lines: Vec<String>,
    /// Name of each series, and its values line by line; `None` where there is none.
    pub series: Vec<(String, Vec<Option<Range>>)>,
    /// First and last decade of the axis: powers of ten.
    pub decades: (i32, i32),
}

const LEFT: i32 = 250;
const WIDTH: f64 = 560.0;
const TOP: i32 = 74;
const STEP: i32 = 30;

impl Dots {
    /// Place of a value across; what lies beyond the axis is drawn at its end.
    fn x(&self, value: f64) -> i32 {
        let (first, last) = (f64::from(self.decades.0), f64::from(self.decades.1));
        let place = (value.max(f64::MIN_POSITIVE).log10() - first) / (last - first);
        LEFT + (WIDTH * place.clamp(0.0, 1.0)).round() as i32
    }

    fn bottom(&self) -> i32 {
        TOP + STEP * self.lines.len() as i32
    }
}

/// Text of this size, in a drawing's units of an SVG, about its place.
fn text(size: f64, across: HPos) -> TextStyle<'static> {
    // plotters' size of a font is not what an em is: an em is 1/1.24 of it.
    ("sans-serif", 1.24 * size)
        .into_font()
        .color(&RGBColor(38, 44, 52))
        .pos(Pos::new(across, VPos::Center))
}

impl Drawing for Dots {
    fn size(&self) -> (u32, u32) {
        (860, (self.bottom() + 34) as u32)
    }

    fn draw<B>(&self, on: &DrawingArea<B, Shift>) -> Result<(), DrawError>
    where
        B: DrawingBackend,
        B::ErrorType: 'static,
    {
        let bottom = self.bottom();
        on.fill(&WHITE)?;
        on.draw(&Text::new(
            self.title.as_str(),
            (16, 21),
            text(16.0, HPos::Left),
        ))?;
        for decade in self.decades.0..=self.decades.1 {
            let value = 10f64.powi(decade);
            let x = self.x(value);
            let line = [(x, TOP - 8), (x, bottom)];
            on.draw(&PathElement::new(line, RGBColor(213, 218, 224)))?;
            let style = text(14.0, HPos::Center);
            on.draw(&Text::new(value.to_string(), (x, bottom + 16), style))?;
        }
        for (k, (name, _)) in self.series.iter().enumerate() {
            let x = LEFT + 150 * k as i32;
            on.draw(&Circle::new((x, 48), 5, colour(k).filled()))?;
            on.draw(&Text::new(
                name.as_str(),
                (x + 12, 48),
                text(14.0, HPos::Left),
            ))?;
        }
        for (i, line) in self.lines.iter().enumerate() {
            let middle = TOP + STEP * i as i32 + STEP / 2;
            let style = text(14.0, HPos::Right);
            on.draw(&Text::new(line.as_str(), (LEFT - 16, middle), style))?;
            for (k, (_, values)) in self.series.iter().enumerate() {
                let y = middle + (14 * k as i32 - 7 * (self.series.len() as i32 - 1)) / 2;
                if let Some(Some([low, here, high])) = values.get(i) {
                    let line = [(self.x(*low), y), (self.x(*high), y)];
                    on.draw(&PathElement::new(line, colour(k).stroke_width(2)))?;
                    on.draw(&Circle::new((self.x(*here), y), 4, colour(k).filled()))?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_are_evenly_spaced_and_the_ends_hold() {
        let dots = Dots {
            title: "a < b".to_owned(),
            lines: vec!["one".to_owned(), "two".to_owned()],
            series: vec![("s".to_owned(), vec![Some([1.0, 10.0, 1e9]), None])],
            decades: (0, 2),
        };
        assert_eq!((dots.x(0.1), dots.x(10.0), dots.x(1e9)), (250, 530, 810));
        let svg = rowtone_plot::svg(&dots).expect("an SVG");
        assert!(
            svg.contains("a &lt; b") && svg.contains("points=\"250,89 810,89 \""),
            "{svg}"
        );
        assert_eq!(svg.matches("r=\"4\"").count(), 1);
    }
}
