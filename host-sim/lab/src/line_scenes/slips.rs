//! How often a periodic texture is read at the wrong stripe.

use super::case::{Case, tone, usual};
use super::measure::{CaseError, measure};
use host_sim::Scene;

/// Distances of the stripes, px.
pub const PERIODS_PX: [f64; 3] = [16.0, 12.0, 10.0];

/// The motion: 8 px peak to peak at these frequencies, Hz.
const HZ: [f64; 7] = [7.7, 20.3, 33.1, 50.3, 77.7, 119.3, 203.7];

/// A recording in which some frames were read at the wrong stripe has another amplitude than this share allows.
const RIGHT: f64 = 0.01;

/// Of `recordings` at each frequency those that slipped, frequency by frequency, of them all those of which it was not told,
/// and of how many others it was.
///
/// # Errors
/// [`CaseError`] when a recording cannot be made.
fn slipped(period_px: f64, seed: u64, recordings: u64) -> Result<(Vec<u64>, u64, u64), CaseError> {
    let (mut untold, mut others_told) = (0, 0);
    let slips = |hz: f64| {
        let mut slips = 0;
        for k in 0..recordings {
            let mut moving = tone(hz, 4.0);
            moving.phase_rad += 2.1 * k as f64;
            let mut case: Case = usual(seed + k, "stripes", vec![moving], 0.4);
            case.config.scene = Scene::Stripes { period_px };
            case.peaks = false;
            let figures = measure(&case)?;
            let error = figures.amplitude_error.abs();
            // Where nothing was measured there is no number.
            let slipped = error.is_nan() || error > RIGHT;
            slips += u64::from(slipped);
            untold += u64::from(slipped && !figures.slips_told);
            others_told += u64::from(!slipped && figures.slips_told);
        }
        Ok(slips)
    };
    let each = HZ
        .into_iter()
        .map(slips)
        .collect::<Result<_, CaseError>>()?;
    Ok((each, untold, others_told))
}

/// The head of the table.
pub fn head() -> String {
    let hz: String = HZ.iter().map(|hz| format!(" {hz:>6}")).collect();
    format!("{:<18}{hz}  all", "slipped at Hz")
}

/// A row of the table; where a recording cannot be made, why.
pub fn row(period_px: f64, seed: u64, recordings: u64) -> String {
    let name = format!("{period_px} px stripes");
    match slipped(period_px, seed, recordings) {
        Ok((slips, untold, others_told)) => {
            let each: String = slips.iter().map(|n| format!(" {n:>6}")).collect();
            let (sum, of) = (slips.iter().sum::<u64>(), recordings * HZ.len() as u64);
            format!(
                "{name:<18}{each}  {sum} of {of}, {untold} not told; told of {others_told} more"
            )
        }
        Err(error) => format!("{name:<18} {error}"),
    }
}
