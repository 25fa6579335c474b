//! What the rows of the key frames say, as numbers to fit.

use rowtone::timeline::{Group, Sample};

/// Rows whose errors hold together in a codec's picture: those of a macroblock.
const BLOCK_ROWS: usize = 16;
/// An axis of which less than this share is known of what is known of the other is not fitted.
const LEAST_SHARE: f64 = 1e-3;

/// One measurement: x + κ·y, or y, of a group of rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Datum {
    /// Middle of its exposure, from the start of the recording's first frame, s.
    pub(super) t_s: f64,
    /// Which key frame.
    pub(super) frame: usize,
    /// The group of rows and the measurement: those that share an unknown offset.
    pub(super) place: usize,
    /// 0 for x + κ·y, 1 for y.
    pub(super) axis: usize,
    pub(super) coupling: f64,
    pub(super) px: f64,
    /// Stated information, 1/px².
    pub(super) weight: f64,
}

/// The rows of all key frames.
#[derive(Clone, Debug)]
pub(super) struct Data {
    pub(super) all: Vec<Datum>,
    /// Number of places and of frames.
    pub(super) places: usize,
    pub(super) frames: usize,
    /// Start of each frame, from that of the recording's first, s.
    pub(super) starts_s: Vec<f64>,
    /// The motion along the columns is known too.
    pub(super) planar: bool,
    /// Groups of rows in a macroblock.
    pub(super) block: usize,
}

impl Data {
    /// Of the samples of key frames, in order; `origin_ns` is when the recording began.
    pub(super) fn new(samples: &[Sample], group: Group, origin_ns: i64) -> Self {
        let slots = usize::from(group.slots());
        let (mut all, mut starts_s) = (Vec::with_capacity(2 * samples.len()), Vec::new());
        let mut last = None;
        for sample in samples {
            let t_s = (sample.time_ns - origin_ns) as f64 * 1e-9;
            if last.replace(sample.frame) != Some(sample.frame) {
                starts_s.push(t_s - group.middle_ns(sample.slot) as f64 * 1e-9);
            }
            let v = sample.vertical.unwrap_or_default();
            for (axis, px, weight) in [
                (0, sample.shift_px, sample.information_per_px2),
                (1, v.shift_px, v.information_per_px2),
            ] {
                if weight > 0.0 && px.is_finite() {
                    all.push(Datum {
                        t_s,
                        frame: starts_s.len() - 1,
                        place: axis * slots + usize::from(sample.slot),
                        axis,
                        coupling: v.coupling.into(),
                        px: px.into(),
                        weight: weight.into(),
                    });
                }
            }
        }
        let known = |axis: usize| -> f64 {
            all.iter()
                .filter(|d| d.axis == axis)
                .map(|d| d.weight)
                .sum()
        };
        let planar = known(1) > LEAST_SHARE * known(0);
        if !planar {
            all.retain(|datum| datum.axis == 0);
        }
        Self {
            frames: starts_s.len(),
            all,
            places: 2 * slots,
            starts_s,
            planar,
            block: BLOCK_ROWS.div_ceil(group.rows_per_sample().max(1).into()),
        }
    }

    /// From the first to the last, s.
    pub(super) fn span_s(&self) -> f64 {
        match (self.starts_s.first(), self.starts_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Key frames a second, on average.
    pub(super) fn rate_hz(&self) -> f64 {
        (self.frames.saturating_sub(1)) as f64 / self.span_s().max(1e-9)
    }

    /// Times of the noise that is stated, by how sums over a frame's macroblocks scatter, for either axis; and no less than 1.
    pub(super) fn scatter(&self, residual: &[f64]) -> [f64; 2] {
        let blocks = self.places.div_ceil(self.block);
        let mut sums = vec![[0.0; 2]; blocks * self.frames];
        for (datum, r) in self.all.iter().zip(residual) {
            let cell = &mut sums[datum.frame * blocks + datum.place / self.block];
            cell[0] += datum.weight * r;
            cell[1] += datum.weight;
        }
        // A mean a place was taken off.
        let frames = self.frames as f64;
        let freedom = frames / (frames - 1.0).max(1.0);
        let half = blocks / 2;
        [0..half, half..blocks].map(|of_axis| {
            let (mut sum, mut n) = (0.0, 0.0);
            for frame in 0..self.frames {
                for cell in &sums[frame * blocks..][of_axis.clone()] {
                    if cell[1] > 0.0 {
                        sum += cell[0] * cell[0] / cell[1];
                        n += 1.0;
                    }
                }
            }
            if n > 0.0 {
                (freedom * sum / n).max(1.0)
            } else {
                1.0
            }
        })
    }
}
