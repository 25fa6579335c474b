//! A drawing as a file: SVG or PNG, as its name ends.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, IntoDrawingArea, SVGBackend};

use crate::canvas::{Canvas, Pen};
use crate::error::{DrawError, PlotError};

/// Pixels of a PNG for one unit of the drawing.
const SCALE: f32 = 1.5;

/// Something that plotters draws, on whatever backend.
pub trait Drawing {
    /// Width and height, in the drawing's own unit: a pixel of an SVG at its natural size.
    fn size(&self) -> (u32, u32);

    /// Draws it.
    ///
    /// # Errors
    /// What the drawing library says.
    fn draw<B>(&self, on: &DrawingArea<B, Shift>) -> Result<(), DrawError>
    where
        B: DrawingBackend,
        B::ErrorType: 'static;
}

/// A drawing as SVG.
///
/// # Errors
/// What the drawing library says.
pub fn svg(drawing: &impl Drawing) -> Result<String, DrawError> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, drawing.size()).into_drawing_area();
        drawing.draw(&area)?;
        area.present()?;
    }
    Ok(text)
}

/// A drawing as PNG.
///
/// # Errors
/// What the drawing library or the encoder says.
pub fn png(drawing: &impl Drawing) -> Result<Vec<u8>, DrawError> {
    let mut canvas = Canvas::new(drawing.size(), SCALE);
    {
        let area = DrawingArea::from(Pen(&mut canvas));
        drawing.draw(&area)?;
        area.present()?;
    }
    let (width, height, pixels) = canvas.picture();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(bytes)
}

/// Writes a drawing, as what the file's ending says.
///
/// # Errors
/// [`PlotError`] when it cannot be drawn or written.
pub fn write(path: &Path, drawing: &impl Drawing) -> Result<(), PlotError> {
    let bytes = match ending(path) {
        Some(Ending::Png) => png(drawing),
        _ => svg(drawing).map(String::into_bytes),
    };
    let path = || path.to_path_buf();
    let bytes = bytes.map_err(|why| PlotError::Draw { path: path(), why })?;
    rowtone_files::write(&path(), bytes).map_err(|why| PlotError::Write { path: path(), why })
}

/// Whether a picture of this name can be drawn.
///
/// # Errors
/// [`PlotError::Ending`] when its ending is neither `.svg` nor `.png`.
pub fn check_ending(path: &Path) -> Result<(), PlotError> {
    match ending(path) {
        Some(_) => Ok(()),
        None => Err(PlotError::Ending(path.to_path_buf())),
    }
}

enum Ending {
    Svg,
    Png,
}

fn ending(path: &Path) -> Option<Ending> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "svg" => Some(Ending::Svg),
        "png" => Some(Ending::Png),
        _ => None,
    }
}
