//! The small methods: one row against its mean row, one function each.
//!
//! | method | idea | source |
//! | --- | --- | --- |
//! | centre of gravity | mean position of what is brighter than the darkest pixel | textbook |
//! | multi-threshold centre | mean position of where the row crosses several grey levels | textbook |
//! | contour centre | middle between the two edges of the widest bright object | textbook |
//! | subset correlation | subsets of 16 px matched by Gauss–Newton | digital image correlation |
//! | template tracking | normalised cross-correlation, a parabola through its top | Lewis 1995 |
//! | phase correlation | peak after Foroosh, or through a Gaussian | Foroosh et al. 2002 |
//! | Lucas–Kanade | one least-squares step of the brightness equation | Lucas and Kanade 1981 |
//! | Horn–Schunck | smooth flow along the row, averaged by slope | Horn and Schunck 1981 |
//! | block matching | least absolute difference, a parabola through its bottom | textbook |

mod centres;
mod flow;
mod matching;
mod phase;

use super::correlate::{PeakFit, PhaseCorrelation};
use super::{Clip, Method, Shifts};

/// A method that looks at one row at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Classical {
    /// Centre of gravity.
    CentreOfGravity,
    /// Mean of threshold crossings.
    MultiThreshold,
    /// Middle of the widest object's contour.
    ContourCentre,
    /// Subsets by Gauss–Newton.
    Subsets,
    /// Normalised cross-correlation.
    Template,
    /// Phase correlation, Foroosh's peak.
    PhaseForoosh,
    /// Phase correlation, Gaussian peak.
    PhaseGaussian,
    /// Lucas–Kanade flow.
    LucasKanade,
    /// Horn–Schunck flow.
    HornSchunck,
    /// Block matching.
    BlockMatching,
}

impl Classical {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::CentreOfGravity,
        Self::MultiThreshold,
        Self::ContourCentre,
        Self::Subsets,
        Self::Template,
        Self::PhaseForoosh,
        Self::PhaseGaussian,
        Self::LucasKanade,
        Self::HornSchunck,
        Self::BlockMatching,
    ];
}

impl Method for Classical {
    fn name(&self) -> &'static str {
        match self {
            Self::CentreOfGravity => "centre of gravity",
            Self::MultiThreshold => "multi-threshold centre",
            Self::ContourCentre => "contour centre",
            Self::Subsets => "subset correlation",
            Self::Template => "template tracking (NCC)",
            Self::PhaseForoosh => "phase correlation, Foroosh",
            Self::PhaseGaussian => "phase correlation, Gaussian",
            Self::LucasKanade => "Lucas-Kanade",
            Self::HornSchunck => "Horn-Schunck",
            Self::BlockMatching => "block matching",
        }
    }

    fn shifts(&self, clip: &Clip) -> Shifts {
        let mean = clip.mean();
        let correlation = PhaseCorrelation::new(clip.width);
        let one = |n: usize, y: usize| {
            let (row, reference) = (clip.row(n, y), &mean[y * clip.width..(y + 1) * clip.width]);
            match self {
                Self::CentreOfGravity => centres::gravity(row) - centres::gravity(reference),
                Self::MultiThreshold => centres::multi_threshold(row, reference),
                Self::ContourCentre => centres::contour_centre(row, reference),
                Self::Subsets => matching::subsets(row, reference),
                Self::Template => matching::template(row, reference),
                Self::PhaseForoosh => phase::shift(&correlation, row, reference, PeakFit::Foroosh),
                Self::PhaseGaussian => {
                    phase::shift(&correlation, row, reference, PeakFit::Gaussian)
                }
                Self::LucasKanade => flow::lucas_kanade(row, reference),
                Self::HornSchunck => flow::horn_schunck(row, reference),
                Self::BlockMatching => matching::block_matching(row, reference),
            }
        };
        (0..clip.frames.len())
            .map(|n| (0..clip.height).map(|y| one(n, y)).collect())
            .collect()
    }
}

/// Slope at each pixel, zero at the ends.
fn slope(row: &[f64]) -> Vec<f64> {
    let last = row.len() - 1;
    (0..row.len())
        .map(|x| {
            if x > 0 && x < last {
                0.5 * (row[x + 1] - row[x - 1])
            } else {
                0.0
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone_linear::dot;

    /// A smooth row moved by parts of a pixel: bars that fade out towards both ends, so that nothing comes in or
    /// goes out.
    pub(super) fn bars(shift: f64) -> Vec<f64> {
        (0..160)
            .map(|x| {
                let x = f64::from(x) - shift;
                let fade = (-((x - 80.0) / 25.0).powi(2)).exp();
                100.0
                    + 60.0 * fade * (0.5 * x).sin()
                    + 40.0 * fade * (0.83 * x + 1.0).sin()
                    + 30.0 * fade
            })
            .collect()
    }

    const SMALL: [f64; 5] = [-0.4, 0.0, 0.4, 0.2, -0.2];

    /// Gain of what is found for [`bars`] on the true small shifts.
    pub(super) fn gain(find: impl Fn(&[f64], &[f64]) -> f64) -> f64 {
        let found = SMALL.map(|s| find(&bars(s), &bars(0.0)));
        dot(&found, &SMALL) / dot(&SMALL, &SMALL)
    }

    /// Each method by its name, through a whole clip, against its mean.
    #[test]
    fn each_reads_a_small_shift_of_a_clip() {
        let clip = Clip {
            width: 160,
            height: 1,
            frames: SMALL.iter().map(|&s| bars(s)).collect(),
        };
        for method in Classical::ALL {
            let found: Vec<f64> = method.shifts(&clip).iter().map(|f| f[0]).collect();
            let mean = found.iter().sum::<f64>() / 5.0;
            let moved: Vec<f64> = found.iter().map(|f| f - mean).collect();
            let gain = dot(&moved, &SMALL) / dot(&SMALL, &SMALL);
            let wide = match method {
                // Known to be coarse: their bias is what the table is about. The centre of gravity weighs
                // everything brighter than the darkest pixel, so a still ground holds it back.
                Classical::CentreOfGravity => 0.95,
                Classical::BlockMatching | Classical::PhaseGaussian | Classical::PhaseForoosh => {
                    0.6
                }
                _ => 0.2,
            };
            assert!((gain - 1.0).abs() < wide, "{}: gain {gain}", method.name());
        }
    }
}
