//! Drawings for the tables of docs/results.md, which [`rowtone_plot::write`] makes files of.
//!
//! | file | what it draws |
//! | --- | --- |
//! | [`dots`] | one line a method, dots with whiskers on a logarithmic axis |
//! | [`lines`] | curves over one axis |
//! | [`shades`] | spectrograms beside each other |

pub mod dots;
pub mod lines;
pub mod shades;

use plotters::style::RGBColor;

/// Colours that are told apart by most eyes (Okabe and Ito 2008): blue, vermilion, green, yellow-orange, purple.
pub const COLOURS: [(u8, u8, u8); 5] = [
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (230, 159, 0),
    (204, 121, 167),
];

/// The colour of a series.
fn colour(index: usize) -> RGBColor {
    let (r, g, b) = COLOURS[index % COLOURS.len()];
    RGBColor(r, g, b)
}
