//! Text as pixels, placed as an SVG viewer places it.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont, point};
use plotters_backend::{
    BackendTextStyle,
    text_anchor::{HPos, VPos},
};

/// The font: Ubuntu Light, which the program carries, so that none of the system is needed.
static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok());

/// A text of plotters' size s is drawn as plotters' SVG draws it: s/1.24 for an em.
const SIZE_OF_EM: f32 = 1.24;

/// Where the glyphs of a text stand from its start on, em `em` high, and how long it is.
fn line(font: &FontRef<'_>, text: &str, em: f32) -> (Vec<(GlyphId, f32)>, f32) {
    let scaled = font.as_scaled(scale(font, em));
    let mut glyphs: Vec<(GlyphId, f32)> = Vec::new();
    let mut end = 0.0;
    for id in text.chars().map(|c| font.glyph_id(c)) {
        if let Some((before, _)) = glyphs.last() {
            end += scaled.kern(*before, id);
        }
        glyphs.push((id, end));
        end += scaled.h_advance(id);
    }
    (glyphs, end)
}

fn scale(font: &FontRef<'_>, em: f32) -> PxScale {
    let units = font.units_per_em().unwrap_or(1000.0);
    PxScale::from(em * font.height_unscaled() / units)
}

/// Hands out the pixels of a text with how much of each is covered, as they lie about its anchor. `pixels` of them are
/// one unit of the drawing.
pub(crate) fn draw<T: BackendTextStyle>(
    text: &str,
    style: &T,
    pixels: f32,
    mut pixel: impl FnMut(f32, f32, f32),
) {
    let Some(font) = FONT.as_ref() else {
        return;
    };
    let em = style.size() as f32 / SIZE_OF_EM * pixels;
    let (glyphs, width) = line(font, text, em);
    let across = match style.anchor().h_pos {
        HPos::Left => 0.0,
        HPos::Center => -0.5 * width,
        HPos::Right => -width,
    };
    // As plotters' SVG says: 0.76 em, and half of an ex, which is half an em.
    let down = match style.anchor().v_pos {
        VPos::Top => 0.76 * em,
        VPos::Center => 0.25 * em,
        VPos::Bottom => -0.25 * em,
    };
    let turn = style.transform();
    for (id, start) in glyphs {
        let glyph = id.with_scale_and_position(scale(font, em), point(across + start, down));
        let Some(outline) = font.outline_glyph(glyph) else {
            continue;
        };
        let corner = outline.px_bounds().min;
        outline.draw(|x, y, share| {
            let (x, y) = (corner.x as i32 + x as i32, corner.y as i32 + y as i32);
            let (x, y) = turn.transform(x, y);
            pixel(x as f32, y as f32, share);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_what_labels_are_made_of() {
        let font = FONT.as_ref().expect("the font can be read");
        for c in "0123456789.,+-±µσ·°²/()%ABCXYZabcxyz".chars() {
            assert_ne!(
                font.glyph_id(c),
                font.glyph_id('\u{fffe}'),
                "{c} is missing"
            );
        }
        let width = |text| line(font, text, 11.0).1;
        assert!((width("1111") / width("1") - 4.0).abs() < 0.05);
    }
}
