//! Shapes as JSON.

use rowtone_measure::shapes::Shapes;

/// A list with one object a tone, and a line feed.
pub(super) fn text(shapes: &Shapes, um_per_px: Option<f64>) -> String {
    // Numbers and lists cannot fail.
    let mut text = serde_json::to_string(&shapes.objects(um_per_px)).unwrap_or_default();
    text.push('\n');
    text
}
