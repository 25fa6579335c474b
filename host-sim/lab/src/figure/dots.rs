//! One line a method: a dot a series, with a whisker from the least to the largest, on a logarithmic axis.

use std::fmt::Write;

use super::{escaped, hex};

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

const LEFT: f64 = 250.0;
const WIDTH: f64 = 560.0;
const TOP: f64 = 74.0;
const STEP: f64 = 30.0;

impl Dots {
    /// Place of a value across; what lies beyond the axis is drawn at its end.
    fn x(&self, value: f64) -> f64 {
        let (first, last) = (f64::from(self.decades.0), f64::from(self.decades.1));
        let place = (value.max(f64::MIN_POSITIVE).log10() - first) / (last - first);
        LEFT + WIDTH * place.clamp(0.0, 1.0)
    }

    /// The drawing as SVG.
    pub fn svg(&self) -> String {
        let bottom = TOP + STEP * self.lines.len() as f64;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 860 {}\" font-family=\"sans-serif\" font-size=\"14\" fill=\"#262c34\">\n\
             <rect width=\"860\" height=\"{}\" fill=\"white\"/>\n<text x=\"16\" y=\"26\" font-size=\"16\">{}</text>\n",
            bottom + 34.0,
            bottom + 34.0,
            escaped(&self.title)
        );
        for decade in self.decades.0..=self.decades.1 {
            let value = 10f64.powi(decade);
            let x = self.x(value);
            // Writing to a string cannot fail.
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {:.1}V{bottom:.1}\" stroke=\"#d5dae0\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{value}</text>",
                TOP - 8.0,
                bottom + 20.0
            );
        }
        for (k, (name, _)) in self.series.iter().enumerate() {
            let x = LEFT + 150.0 * k as f64;
            let _ = writeln!(
                svg,
                "<circle cx=\"{x}\" cy=\"48\" r=\"5\" fill=\"{}\"/><text x=\"{}\" y=\"53\">{}</text>",
                hex(k),
                x + 12.0,
                escaped(name)
            );
        }
        for (i, line) in self.lines.iter().enumerate() {
            let middle = TOP + STEP * (i as f64 + 0.5);
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 16.0,
                middle + 5.0,
                escaped(line)
            );
            for (k, (_, values)) in self.series.iter().enumerate() {
                let y = middle + 7.0 * (k as f64 - 0.5 * (self.series.len() as f64 - 1.0));
                if let Some(Some([low, here, high])) = values.get(i) {
                    let (from, to, x) = (self.x(*low), self.x(*high), self.x(*here));
                    let colour = hex(k);
                    let _ = writeln!(
                        svg,
                        "<path d=\"M{from:.1} {y:.1}H{to:.1}\" stroke=\"{colour}\" stroke-width=\"2\"/><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>"
                    );
                }
            }
        }
        svg + "</svg>\n"
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
        assert_eq!(
            (dots.x(0.1), dots.x(10.0), dots.x(1e9)),
            (250.0, 530.0, 810.0)
        );
        let svg = dots.svg();
        assert!(
            svg.contains("a &lt; b") && svg.contains("M250.0 89.0H810.0"),
            "{svg}"
        );
        assert_eq!(svg.matches("r=\"4\"").count(), 1);
    }
}
