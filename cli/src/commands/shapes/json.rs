//! Shapes as JSON.

use rowtone_measure::shapes::Shapes;
use serde::Serialize;

#[derive(Serialize)]
struct Object {
    hz: f64,
    tile: usize,
    cols: usize,
    rows: usize,
    x: Vec<Option<[f64; 2]>>,
    y: Vec<Option<[f64; 2]>>,
    /// Of a real or imaginary part, the root mean square of both axes.
    sd: Vec<Option<f64>>,
    x_sd: Vec<Option<f64>>,
    y_sd: Vec<Option<f64>>,
    moves: Vec<bool>,
    /// µm a px, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    um_per_px: Option<f64>,
}

/// A list with one object a tone, and a line feed.
pub(super) fn text(shapes: &Shapes, um_per_px: Option<f64>) -> String {
    let objects: Vec<Object> = shapes
        .shapes
        .iter()
        .map(|shape| {
            let pairs = |all: &[Option<num_complex::Complex64>]| {
                all.iter()
                    .map(|v| v.map(|v| [digits(v.re), digits(v.im)]))
                    .collect()
            };
            let rounded = |all: &[Option<f64>]| all.iter().map(|v| v.map(digits)).collect();
            Object {
                hz: shape.hz,
                tile: shapes.grid.tile_px(),
                cols: shapes.grid.columns(),
                rows: shapes.grid.rows(),
                x: pairs(&shape.x),
                y: pairs(&shape.y),
                sd: (0..shape.moves.len())
                    .map(|tile| shape.sd(tile).map(digits))
                    .collect(),
                x_sd: rounded(&shape.x_sd),
                y_sd: rounded(&shape.y_sd),
                moves: shape.moves.clone(),
                um_per_px,
            }
        })
        .collect();
    // Numbers and lists cannot fail.
    let mut text = serde_json::to_string(&objects).unwrap_or_default();
    text.push('\n');
    text
}

/// To a ten-millionth of a px, which is far below what is known.
fn digits(px: f64) -> f64 {
    (px * 1e7).round() / 1e7
}
