//! A picture file as a scene.

use std::path::Path;

use rowtone_clip::picture::Grey;

use crate::SimError;
use crate::texture::Strip;

/// A picture scaled to the frame's height; what is missing in width is its mirror image, and the
/// strip closes by fading its last part into its first.
pub(super) fn picture(path: &Path, period_px: usize, rows: usize) -> Result<Strip, SimError> {
    let fail = |why: String| SimError::File {
        path: path.display().to_string(),
        why,
    };
    let Grey {
        width: w,
        height: h,
        values: grey,
    } = rowtone_clip::picture::read(path).map_err(|e| fail(e.to_string()))?;
    if w == 0 || h == 0 {
        return Err(fail("the picture is empty".into()));
    }
    let width = ((w as f64 * rows as f64 / h as f64).round() as usize).max(1);
    let grey: Vec<f32> = grey.into_iter().map(|v| f32::from(v) / 65535.0).collect();
    let scaled = scaled(&transposed(&scaled(&grey, h, rows), w), w, width);
    let fade = (period_px / 8).min(64);
    let at = |x: usize, y: usize| {
        let turn = 2 * width;
        let k = x % turn;
        let k = if k < width { k } else { turn - 1 - k };
        scaled[k * rows + y]
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

/// A picture of `from` rows in `to` rows: each is the mean of what lies within a row's distance of it (of the coarser
/// of both), nearer rows counting more, in a straight line.
fn scaled(values: &[f32], from: usize, to: usize) -> Vec<f32> {
    let width = values.len() / from;
    let ratio = from as f32 / to as f32;
    let reach = ratio.max(1.0);
    let mut scaled = Vec::with_capacity(width * to);
    for row in 0..to {
        let middle = (row as f32 + 0.5) * ratio;
        let first = ((middle - reach).floor().max(0.0) as usize).min(from - 1);
        let end = ((middle + reach).ceil() as usize).clamp(first + 1, from);
        let weights: Vec<f32> = (first..end)
            .map(|k| (1.0 - ((k as f32 + 0.5 - middle) / reach).abs()).max(0.0))
            .collect();
        let sum: f32 = weights.iter().sum();
        scaled.extend((0..width).map(|x| {
            let rows = values[first * width..].chunks(width);
            rows.zip(&weights).map(|(r, w)| r[x] * w).sum::<f32>() / sum
        }));
    }
    scaled
}

/// Columns as rows.
fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    (0..width)
        .flat_map(|x| values.iter().copied().skip(x).step_by(width))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaling_keeps_a_slope_and_the_mean() {
        let slope: Vec<f32> = (0..40).map(|k| (k / 2) as f32).collect();
        // 20 rows of 2 columns to 50 rows: row r is at (r + 1/2)·20/50 − 1/2.
        let more = scaled(&slope, 20, 50);
        assert_eq!(more.len(), 100);
        for row in 2..48 {
            let expected = (row as f32 + 0.5) * 0.4 - 0.5;
            assert!((more[2 * row] - expected).abs() < 1e-4 && more[2 * row] == more[2 * row + 1]);
        }
        let fewer = scaled(&slope, 20, 5);
        for row in 1..4 {
            assert!(
                (fewer[2 * row] - (4.0 * row as f32 + 1.5)).abs() < 1e-4,
                "{fewer:?}"
            );
        }
        assert_eq!(scaled(&slope, 20, 20), slope);
        let turned = transposed(&slope, 2);
        assert_eq!(turned[..3], [0.0, 1.0, 2.0]);
        assert_eq!(transposed(&turned, 20), slope);
    }
}
