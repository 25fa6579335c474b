//! Shapes as a universal file (UFF), which programs for modal analysis read.
//!
//! Datasets as the Structural Dynamics Research Laboratory of the University of Cincinnati describes them: 151 (header), 164
//! (units), 15 (nodes: the tiles' middles), 82 (trace lines: the mesh), 55 (data at nodes: one a tone) and 58 (function at a
//! node: one a tile and axis, its spectrum over the tones). The frame is the picture's: x to the right, y downwards, z away
//! from the camera, which is right-handed.

use std::io::{self, Write};

use num_complex::Complex64;
use rowtone_measure::shapes::{Shape, Shapes};

/// Most nodes of a trace line.
const TRACE: usize = 250;

/// Writes all datasets. Lengths are in metres where there is a scale, otherwise in px. What a tile does not know along one
/// axis is written as 0; tiles that know nothing have neither a function nor data.
///
/// # Errors
/// What writing says.
pub(super) fn write(
    to: &mut impl Write,
    shapes: &Shapes,
    name: &str,
    um_per_px: Option<f64>,
) -> io::Result<()> {
    let scale = um_per_px.map_or(1.0, |um| um * 1e-6);
    let unit = if um_per_px.is_some() { "m" } else { "px" };
    header(to, name)?;
    units(to, um_per_px.is_some())?;
    nodes(to, shapes, scale)?;
    mesh(to, shapes)?;
    for (number, shape) in shapes.shapes.iter().enumerate() {
        data(to, shape, number + 1, scale, unit)?;
    }
    let known = (0..shapes.grid.tiles()).filter(|&tile| known(shapes, tile));
    for tile in known {
        for axis in [0, 1] {
            function(to, shapes, tile, axis, scale, unit)?;
        }
    }
    Ok(())
}

fn known(shapes: &Shapes, tile: usize) -> bool {
    shapes.shapes.iter().any(|shape| shape.sd(tile).is_some())
}

fn begin(to: &mut impl Write, dataset: u32) -> io::Result<()> {
    writeln!(to, "{:6}\n{dataset:6}", -1)
}

fn end(to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "{:6}", -1)
}

/// A line of text, at most 80 characters of ASCII.
fn text(to: &mut impl Write, line: &str) -> io::Result<()> {
    let plain = |c: char| if (' '..='~').contains(&c) { c } else { '?' };
    let line: String = line.chars().map(plain).take(80).collect();
    writeln!(to, "{line:80}")
}

fn header(to: &mut impl Write, name: &str) -> io::Result<()> {
    begin(to, 151)?;
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    text(to, file)?;
    text(
        to,
        "Operating deflection shapes; x right, y down, z away from the camera",
    )?;
    text(to, "rowtone")?;
    // Dates of a database that there is none of.
    writeln!(to, "{:10}{:10}{:10}{:10}{:10}", "", "", 0, 0, 0)?;
    writeln!(to, "{:10}{:10}", "", "")?;
    text(to, concat!("rowtone ", env!("CARGO_PKG_VERSION")))?;
    writeln!(to, "{:10}{:10}", "", "")?;
    end(to)
}

fn units(to: &mut impl Write, scaled: bool) -> io::Result<()> {
    let (code, description) = if scaled { (1, "SI") } else { (9, "px") };
    begin(to, 164)?;
    writeln!(to, "{code:10}{description:>20}{:10}", 2)?;
    // Length, force and temperature against SI.
    let long = |value: f64| exponent(value, 25, 16).replace('E', "D");
    writeln!(
        to,
        "{}{}{}\n{}",
        long(1.0),
        long(1.0),
        long(1.0),
        long(273.15)
    )?;
    end(to)
}

/// Nodes are numbered from 1, tile by tile.
fn nodes(to: &mut impl Write, shapes: &Shapes, scale: f64) -> io::Result<()> {
    begin(to, 15)?;
    let (columns, side) = (shapes.grid.columns(), shapes.grid.tile_px() as f64);
    for tile in 0..shapes.grid.tiles() {
        // The middle of a tile, from the middle of the first pixel.
        let place =
            [tile % columns, tile / columns].map(|at| ((at as f64 + 0.5) * side - 0.5) * scale);
        let [x, y, z] = [place[0], place[1], 0.0].map(short);
        writeln!(to, "{:10}{:10}{:10}{:10}{x}{y}{z}", tile + 1, 0, 0, 1)?;
    }
    end(to)
}

/// Lines through neighbours that are known, row by row and column by column; 0 lifts the pen.
fn mesh(to: &mut impl Write, shapes: &Shapes) -> io::Result<()> {
    let (columns, rows) = (shapes.grid.columns(), shapes.grid.rows());
    let across = (0..rows).map(|row| (0..columns).map(|at| row * columns + at).collect());
    let down = (0..columns).map(|column| (0..rows).map(|at| at * columns + column).collect());
    let mut number = 0;
    for line in across.chain(down) {
        let line: Vec<usize> = line;
        let pen = |&tile: &usize| if known(shapes, tile) { tile + 1 } else { 0 };
        let mut nodes: Vec<usize> = line.iter().map(pen).collect();
        nodes.dedup_by(|a, b| *a == 0 && *b == 0);
        // A long line in pieces that share their ends.
        let mut from = 0;
        while from + 1 < nodes.len() {
            let piece = &nodes[from..(from + TRACE).min(nodes.len())];
            from += piece.len() - 1;
            if piece.iter().all(|&node| node == 0) {
                continue;
            }
            number += 1;
            begin(to, 82)?;
            writeln!(to, "{number:10}{:10}{:10}", piece.len(), 1)?;
            text(to, "tiles")?;
            for eight in piece.chunks(8) {
                let nodes: String = eight.iter().map(|node| format!("{node:10}")).collect();
                writeln!(to, "{nodes}")?;
            }
            end(to)?;
        }
    }
    Ok(())
}

/// Real and imaginary part along x and y.
fn phasors(shape: &Shape, tile: usize, scale: f64) -> [Complex64; 2] {
    [&shape.x, &shape.y].map(|all| all[tile].unwrap_or_default() * scale)
}

/// A tone's shape: a frequency response's displacements, three complex values a node.
fn data(
    to: &mut impl Write,
    shape: &Shape,
    number: usize,
    scale: f64,
    unit: &str,
) -> io::Result<()> {
    begin(to, 55)?;
    text(
        to,
        &format!("Operating deflection shape at {:.4} Hz", shape.hz),
    )?;
    text(
        to,
        &format!("Zero-to-peak displacement, {unit}; Re X e^(2 pi i f t)"),
    )?;
    text(to, "NONE")?;
    text(to, "NONE")?;
    text(to, "NONE")?;
    // Structural, frequency response, translations, displacement, complex, three a node.
    writeln!(to, "{:10}{:10}{:10}{:10}{:10}{:10}", 1, 5, 2, 8, 5, 3)?;
    writeln!(to, "{:10}{:10}{:10}{:10}", 2, 1, 1, number)?;
    writeln!(to, "{}", short(shape.hz))?;
    for tile in (0..shape.moves.len()).filter(|&tile| shape.sd(tile).is_some()) {
        let [x, y] = phasors(shape, tile, scale);
        let values: String = [x.re, x.im, y.re, y.im, 0.0, 0.0].map(short).concat();
        writeln!(to, "{:10}\n{values}", tile + 1)?;
    }
    end(to)
}

/// A tile's spectrum along one axis: its complex amplitudes at the tones, in the order of their frequencies.
fn function(
    to: &mut impl Write,
    shapes: &Shapes,
    tile: usize,
    axis: usize,
    scale: f64,
    unit: &str,
) -> io::Result<()> {
    let mut tones: Vec<&Shape> = shapes.shapes.iter().collect();
    tones.sort_by(|a, b| a.hz.total_cmp(&b.hz));
    let node = tile + 1;
    begin(to, 58)?;
    text(to, &format!("Tile {node}, {}", ["x", "y"][axis]))?;
    text(to, &format!("Zero-to-peak displacement, {unit}"))?;
    text(to, "NONE")?;
    text(to, "NONE")?;
    text(to, "NONE")?;
    // A spectrum of the node along this axis.
    let entity = "NONE";
    writeln!(
        to,
        "{:5}{:10}{:5}{:10} {entity:>10}{node:10}{:4} {entity:>10}{:10}{:4}",
        12,
        node * 2 + axis - 1,
        0,
        0,
        axis + 1,
        0,
        0
    )?;
    // Complex in double precision, at frequencies as they come.
    let none = short(0.0);
    writeln!(to, "{:10}{:10}{:10}{none}{none}{none}", 6, tones.len(), 0)?;
    let axes = [
        (18, "Frequency", "Hz"),
        (8, "Displacement", unit),
        (0, "NONE", "NONE"),
    ];
    for (kind, label, unit) in [axes[0], axes[1], axes[2], axes[2]] {
        writeln!(to, "{kind:10}{:5}{:5}{:5} {label:20} {unit:20}", 0, 0, 0)?;
    }
    for shape in tones {
        let value = phasors(shape, tile, scale)[axis];
        let [re, im] = [value.re, value.im].map(|v| exponent(v, 20, 11));
        writeln!(to, "{}{re}{im}", short(shape.hz))?;
    }
    end(to)
}

/// FORTRAN's 1PE13.5.
fn short(value: f64) -> String {
    exponent(value, 13, 5)
}

/// FORTRAN's 1PEw.d: an exponent of a sign and two digits.
fn exponent(value: f64, width: usize, digits: usize) -> String {
    let written = format!("{value:.digits$e}");
    let (mantissa, power) = written.split_once('e').unwrap_or((&written, "0"));
    let (sign, power) = match power.strip_prefix('-') {
        Some(power) => ('-', power),
        None => ('+', power),
    };
    format!("{:>width$}", format!("{mantissa}E{sign}{power:0>2}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_fortran() {
        assert_eq!(short(131.7), "  1.31700E+02");
        assert_eq!(short(-0.05), " -5.00000E-02");
        assert_eq!(short(0.0), "  0.00000E+00");
        assert_eq!(exponent(1.0, 25, 16), "   1.0000000000000000E+00");
        assert_eq!(exponent(-1e-12, 20, 11).len(), 20);
    }

    #[test]
    fn a_line_of_text_is_eighty_plain_characters() {
        let mut line = Vec::new();
        text(&mut line, &"ä".repeat(90)).expect("memory");
        assert_eq!(line, format!("{}\n", "?".repeat(80)).into_bytes());
    }
}
