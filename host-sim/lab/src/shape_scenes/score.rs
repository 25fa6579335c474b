//! A measured shape against the true one.

use host_sim::Camera;
use num_complex::Complex64;
use rowtone::tracker::Axes;
use rowtone_measure::shapes::tones::Found;
use rowtone_measure::shapes::{self, Shape, Wanted};

use super::case::{Case, SIZE_PX, TILE_PX};
use crate::LabError;
use crate::filmed::Filmed;

/// What came of one recording.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Modal assurance criterion of both axes together (Allemang & Brown 1982), from 0 to 1.
    pub mac: f64,
    /// Measured size over the true one.
    pub scale: f64,
    /// Root mean square of the errors of real and imaginary parts over their stated deviations, the common phase taken off.
    pub error_over_sd: f64,
    /// Tiles that stand still.
    pub still: u32,
    /// Those of them that are drawn as moving.
    pub drawn: u32,
    /// Tiles that move by more than ten deviations and are not drawn.
    pub missed: u32,
    /// Median deviation of a tile's real or imaginary part, px.
    pub sd_px: f64,
}

/// Simulates and measures a case.
///
/// # Errors
/// [`LabError`] where it cannot be simulated or measured.
pub fn score(case: &Case) -> Result<Score, LabError> {
    let simulated = |why| LabError::Recording {
        what: case.kind.name().to_owned(),
        why,
    };
    let camera = Camera::new(case.config.clone()).map_err(simulated)?;
    // That the tone is found is what other sweeps measure, and most of the time that it takes.
    let tone = Found {
        hz: case.hz,
        amplitude_px: case.px,
    };
    let filmed = Filmed::new(&camera, Axes::Xy)?;
    let wanted = Wanted {
        tile_px: TILE_PX,
        known: Some(vec![tone]),
        ..Wanted::default()
    };
    let shapes = shapes::measure_from(|| Ok(filmed.feed()?), &wanted, |_| ())?;
    let shape = shapes.shapes.first().ok_or(LabError::NoReport)?;
    Ok(compared(case, shape))
}

fn compared(case: &Case, shape: &Shape) -> Score {
    let columns = SIZE_PX.0 as usize / usize::from(TILE_PX);
    // Measured, true, deviation of all that is known.
    let mut known = Vec::new();
    let mut score = Score::default();
    for tile in 0..shape.moves.len() {
        let truth = case.truth(tile % columns, tile / columns);
        let truth = truth.map(|[re, im]| Complex64::new(re, im));
        let still = truth.iter().all(|px| px.norm() == 0.0);
        score.still += u32::from(still);
        score.drawn += u32::from(still && shape.moves[tile]);
        let axes = [(&shape.x, &shape.x_sd), (&shape.y, &shape.y_sd)];
        let mut most = 0.0f64;
        for (truth, (px, sd)) in truth.into_iter().zip(axes) {
            if let (Some(px), Some(sd)) = (px[tile], sd[tile]) {
                known.push((px, truth, sd));
                most = most.max(truth.norm() / sd);
            }
        }
        score.missed += u32::from(most > 10.0 && !shape.moves[tile]);
    }
    let mut product = Complex64::default();
    let (mut own, mut all) = (0.0, 0.0);
    for (px, truth, _) in &known {
        product += truth.conj() * px;
        own += px.norm_sqr();
        all += truth.norm_sqr();
    }
    score.mac = product.norm_sqr() / (own * all);
    score.scale = product.norm() / all;
    let turn = product / product.norm();
    let error = |(px, truth, sd): &(Complex64, Complex64, f64)| {
        (px - truth * turn).norm_sqr() / (2.0 * sd * sd)
    };
    let squares: f64 = known.iter().map(error).sum();
    score.error_over_sd = (squares / known.len().max(1) as f64).sqrt();
    let mut deviations: Vec<f64> = known.iter().map(|(_, _, sd)| *sd).collect();
    deviations.sort_by(f64::total_cmp);
    score.sd_px = deviations.get(deviations.len() / 2).copied().unwrap_or(0.0);
    score
}

/// What the columns of [`row`] are.
pub fn head() -> String {
    format!(
        "{:<30} {:>7} {:>5} {:>8} {:>8} {:>15} {:>9} {:>12} {:>7} {:>8}",
        "shape",
        "Hz",
        "px",
        "MAC",
        "least",
        "scale",
        "error/sd",
        "still, drawn",
        "missed",
        "sd, px"
    )
}

/// A line of the table: one case over seeds.
pub fn row(name: &str, hz: f64, px: f64, scores: &[Score]) -> String {
    let mean = |of: &dyn Fn(&Score) -> f64| {
        scores.iter().map(of).sum::<f64>() / scores.len().max(1) as f64
    };
    let least = scores.iter().map(|s| s.mac).fold(1.0, f64::min);
    let scales = scores.iter().map(|s| s.scale);
    let (low, high) = scales.fold((f64::MAX, 0.0f64), |(a, b), s| (a.min(s), b.max(s)));
    let [still, drawn, missed] = scores.iter().fold([0; 3], |[a, b, c], s| {
        [a + s.still, b + s.drawn, c + s.missed]
    });
    format!(
        "{name:<30} {hz:>7.1} {px:>5.2} {:>8.4} {least:>8.4} {low:>7.4}-{high:<7.4} {:>9.2} \
         {:>12} {missed:>7} {:>8.5}",
        mean(&|s| s.mac),
        mean(&|s| s.error_over_sd * s.error_over_sd).sqrt(),
        format!("{still}, {drawn}"),
        mean(&|s| s.sd_px),
    )
}
