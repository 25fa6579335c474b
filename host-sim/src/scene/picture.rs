//! A picture file as a scene.

use std::path::Path;

use crate::SimError;
use crate::texture::Strip;

/// A picture scaled to the frame's height; what is missing in width is its mirror image, and the
/// strip closes by fading its last part into its first.
pub(super) fn picture(path: &Path, period_px: usize, rows: usize) -> Result<Strip, SimError> {
    let fail = |why: String| SimError::File {
        path: path.display().to_string(),
        why,
    };
    let reader = image::ImageReader::open(path).map_err(|e| fail(e.to_string()))?;
    let reader = reader
        .with_guessed_format()
        .map_err(|e| fail(e.to_string()))?;
    let grey = reader
        .decode()
        .map_err(|e| fail(e.to_string()))?
        .into_luma16();
    let (w, h) = grey.dimensions();
    if w == 0 || h == 0 {
        return Err(fail("the picture is empty".into()));
    }
    let width = ((f64::from(w) * rows as f64 / f64::from(h)).round() as u32).max(1);
    let scaled = image::imageops::resize(
        &grey,
        width,
        rows as u32,
        image::imageops::FilterType::Triangle,
    );
    let fade = (period_px / 8).min(64);
    let at = |x: usize, y: usize| {
        let turn = 2 * width as usize;
        let k = x % turn;
        let k = if k < width as usize { k } else { turn - 1 - k };
        f32::from(scaled.get_pixel(k as u32, y as u32).0[0]) / 65535.0
    };
    let mut values = Vec::with_capacity(period_px * rows);
    for y in 0..rows {
        for x in 0..period_px {
            // The last columns fade into what lies left of the first, itself a mirror image.
            let into = (x + fade + 1).saturating_sub(period_px) as f32 / (fade + 1) as f32;
            values.push(at(x, y) * (1.0 - into) + at(period_px - 1 - x, y) * into);
        }
    }
    Ok(Strip {
        period_px,
        fineness: 1,
        values,
    })
}
