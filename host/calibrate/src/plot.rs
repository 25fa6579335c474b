//! The stripes of the first frame, the fitted wave over them and what it leaves, as SVG.

use super::fit::Fit;
use std::fmt::Write;

const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 640.0;
/// Left and right edge of all three pictures.
const EDGES: [f64; 2] = [70.0, 970.0];
/// Top and bottom of the stripes themselves, of the curves, and of the residuals.
const STRIPES: [f64; 2] = [64.0, 114.0];
const CURVES: [f64; 2] = [130.0, 430.0];
const LEFT: [f64; 2] = [480.0, 580.0];

/// Draws the first frame: its stripes as they are seen (turned on their side), the row means (dots) with the fit (line),
/// and what the fit leaves. `hz` is the light's frequency, for the figures in the head.
pub fn stripes(rows: &[Vec<f64>], fit: &Fit, hz: f64) -> String {
    let data = rows.first().map_or(&[][..], Vec::as_slice);
    let count = fit.gain.len();
    let centre = 0.5 * (count as f64 - 1.0);
    let model: Vec<f64> = (0..count)
        .map(|y| fit.offset[y] + fit.gain[y] * fit.model.wave(fit.model.psi(0, y as f64 - centre)))
        .collect();
    let residual = fit.residual.first().map_or(&[][..], Vec::as_slice);
    let least = data.iter().copied().fold(f64::INFINITY, f64::min);
    let most = data.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (bottom, top) = scale(least, most);
    let largest = residual.iter().fold(1e-9_f64, |m, r| m.max(r.abs()));
    let x = |row: f64| EDGES[0] + (EDGES[1] - EDGES[0]) * row / data.len().max(1) as f64;
    let level = |v: f64| between(CURVES, (v - bottom) / (top - bottom));
    let left = |v: f64| between(LEFT, 0.5 + 0.5 * v / largest);

    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#333\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    head(&mut svg, fit, hz);
    as_seen(&mut svg, data, [least, most], &x);
    let tick = step(top - bottom);
    let mut value = (bottom / tick).ceil() * tick;
    while value <= top {
        rule(
            &mut svg,
            level(value),
            &format!("{}", (value / tick).round() * tick + 0.0),
        );
        value += tick;
    }
    for value in [-largest, 0.0, largest] {
        rule(&mut svg, left(value), &format!("{value:.2}"));
    }
    for (y, &value) in data.iter().enumerate() {
        dot(&mut svg, x(y as f64 + 0.5), level(value), 2.0);
    }
    let curve = model.iter().enumerate().filter(|(_, v)| v.is_finite());
    line(&mut svg, curve.map(|(y, &v)| (x(y as f64 + 0.5), level(v))));
    for (y, &r) in residual.iter().enumerate() {
        dot(&mut svg, x(y as f64 + 0.5), left(r), 1.3);
    }
    rows_axis(&mut svg, data.len(), &x);
    let middle = |part: [f64; 2]| 0.5 * (part[0] + part[1]);
    for (part, name) in [(CURVES, "mean of a row"), (LEFT, "left over")] {
        let _ = writeln!(
            svg,
            "<text transform=\"translate(18,{:.1}) rotate(-90)\" text-anchor=\"middle\">{name}</text>",
            middle(part)
        );
    }
    svg + "</svg>\n"
}

/// Place of `part` (0 to 1, from below) in a picture from top to bottom.
fn between([top, bottom]: [f64; 2], part: f64) -> f64 {
    bottom + (top - bottom) * part
}

/// A range with some air about the data.
fn scale(least: f64, most: f64) -> (f64, f64) {
    let air = 0.06 * (most - least).max(1e-6);
    (least - air, most + air)
}

/// About five steps over a range, 1, 2 or 5 times a power of ten.
fn step(range: f64) -> f64 {
    let rough = range.max(1e-9) / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let digits = [1.0, 2.0, 5.0].into_iter().find(|d| d * power >= rough);
    digits.unwrap_or(10.0) * power
}

// Writing to a string cannot fail.

fn head(svg: &mut String, fit: &Fit, hz: f64) {
    let count = fit.gain.len() as f64;
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"28\" font-size=\"18\">Line time {:.5} ± {:.5} µs by a light of {hz:.3} Hz</text>\n<text x=\"{}\" y=\"50\" fill=\"#666\">{:.4} ± {:.4} periods in {count} rows; {} frame(s), {} harmonics, noise of a row {:.3}; shown: the first frame</text>",
        EDGES[0],
        1e6 * fit.model.per_row / hz,
        1e6 * fit.per_row_sd / hz,
        EDGES[0],
        fit.model.per_row * count,
        fit.per_row_sd * count,
        fit.residual.len(),
        fit.model.harmonics.len(),
        fit.noise()
    );
}

/// The picture itself, one bar a row.
fn as_seen(svg: &mut String, data: &[f64], [least, most]: [f64; 2], x: &dyn Fn(f64) -> f64) {
    let span = (most - least).max(1e-9);
    for (y, value) in data.iter().enumerate() {
        let grey = (255.0 * (value - least) / span).round();
        let _ = writeln!(
            svg,
            "<rect x=\"{:.2}\" y=\"{}\" width=\"{:.2}\" height=\"{}\" fill=\"rgb({grey},{grey},{grey})\"/>",
            x(y as f64),
            STRIPES[0],
            // A little over, so that no seams show.
            x(1.0) - x(0.0) + 0.3,
            STRIPES[1] - STRIPES[0]
        );
    }
}

/// A horizontal rule with its value.
fn rule(svg: &mut String, y: f64, label: &str) {
    let [from, to] = EDGES;
    let _ = writeln!(
        svg,
        "<path d=\"M{from},{y:.1}H{to}\" stroke=\"#ddd\"/>\n<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#666\">{label}</text>",
        from - 7.0,
        y + 4.5
    );
}

fn rows_axis(svg: &mut String, rows: usize, x: &dyn Fn(f64) -> f64) {
    let tick = step(0.5 * rows as f64).max(1.0);
    let mut row = 0.0;
    while row <= rows as f64 {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\" fill=\"#666\">{row}</text>",
            x(row),
            LEFT[1] + 20.0
        );
        row += tick;
    }
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">row</text>\n<circle cx=\"{}\" cy=\"449\" r=\"2.2\" fill=\"#1f5f99\"/><text x=\"{}\" y=\"454\">measured</text><path d=\"M{},449h26\" stroke=\"#d1495b\" stroke-width=\"2\"/><text x=\"{}\" y=\"454\">fitted</text>",
        0.5 * (EDGES[0] + EDGES[1]),
        LEFT[1] + 42.0,
        EDGES[0] + 10.0,
        EDGES[0] + 18.0,
        EDGES[0] + 95.0,
        EDGES[0] + 127.0
    );
}

fn dot(svg: &mut String, x: f64, y: f64, radius: f64) {
    let _ = writeln!(
        svg,
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"#1f5f99\" fill-opacity=\"0.7\"/>"
    );
}

fn line(svg: &mut String, points: impl Iterator<Item = (f64, f64)>) {
    svg.push_str("<polyline fill=\"none\" stroke=\"#d1495b\" stroke-width=\"1.6\" points=\"");
    for (x, y) in points {
        let _ = write!(svg, "{x:.1},{y:.1} ");
    }
    svg.push_str("\"/>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        assert_eq!([step(1080.0), step(255.0), step(9.0)], [500.0, 100.0, 2.0]);
    }
}
