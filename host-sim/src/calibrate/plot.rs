//! The stripes of the first frame and the fitted wave, as SVG.

use super::fit::Fit;
use std::fmt::Write;

const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 360.0;
const MARGIN: f64 = 50.0;

/// Draws the row means of the first frame (dots), the fit (line) and, below, what the fit leaves.
pub fn stripes(rows: &[Vec<f64>], fit: &Fit) -> String {
    let data = rows.first().map_or(&[][..], Vec::as_slice);
    let centre = 0.5 * (fit.gain.len() as f64 - 1.0);
    let model: Vec<f64> = (0..fit.gain.len())
        .map(|y| fit.offset[y] + fit.gain[y] * fit.model.wave(fit.model.psi(0, y as f64 - centre)))
        .collect();
    let top = data.iter().copied().fold(1e-9, f64::max) * 1.05;
    let x = |y: usize| MARGIN + (WIDTH - 2.0 * MARGIN) * y as f64 / data.len().max(1) as f64;
    let level = |v: f64| HEIGHT - MARGIN - (HEIGHT - 2.0 * MARGIN) * v / top;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {}\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        HEIGHT * 1.5
    );
    // Writing to a string cannot fail.
    let _ = writeln!(
        svg,
        "<text x=\"{MARGIN}\" y=\"22\">Row means of the first frame (dots) and the fit: {:.4} ± {:.4} periods in {} rows</text>",
        fit.model.per_row * fit.gain.len() as f64,
        fit.per_row_sd * fit.gain.len() as f64,
        fit.gain.len()
    );
    axis(&mut svg, data.len(), top, &x, &level);
    for (y, &value) in data.iter().enumerate() {
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"1.6\" fill=\"#345\"/>",
            x(y),
            level(value)
        );
    }
    line(
        &mut svg,
        model
            .iter()
            .enumerate()
            .filter(|(_, v)| v.is_finite())
            .map(|(y, &v)| (x(y), level(v))),
        "#d33",
    );
    let residual = fit.residual.first().map_or(&[][..], Vec::as_slice);
    let largest = residual.iter().fold(1e-9_f64, |m, r| m.max(r.abs()));
    let middle = HEIGHT * 1.25;
    let _ = writeln!(
        svg,
        "<text x=\"{MARGIN}\" y=\"{:.0}\">What the fit leaves (full scale ±{largest:.3})</text>",
        middle - 0.2 * HEIGHT
    );
    line(
        &mut svg,
        residual
            .iter()
            .enumerate()
            .map(|(y, r)| (x(y), middle - 0.15 * HEIGHT * r / largest)),
        "#345",
    );
    svg + "</svg>\n"
}

fn axis(
    svg: &mut String,
    rows: usize,
    top: f64,
    x: &dyn Fn(usize) -> f64,
    level: &dyn Fn(f64) -> f64,
) {
    let _ = writeln!(
        svg,
        "<path d=\"M{:.1},{:.1}V{:.1}H{:.1}\" stroke=\"#999\" fill=\"none\"/>",
        x(0),
        level(top),
        level(0.0),
        x(rows)
    );
    for k in 0..=4 {
        let (row, value) = (rows * k / 4, top * k as f64 / 4.0);
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{row}</text>",
            x(row),
            level(0.0) + 18.0
        );
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{value:.0}</text>",
            x(0) - 6.0,
            level(value) + 4.0
        );
    }
}

fn line(svg: &mut String, points: impl Iterator<Item = (f64, f64)>, colour: &str) {
    svg.push_str("<polyline fill=\"none\" stroke-width=\"1\" points=\"");
    for (x, y) in points {
        let _ = write!(svg, "{x:.1},{y:.1} ");
    }
    let _ = writeln!(svg, "\" stroke=\"{colour}\"/>");
}
