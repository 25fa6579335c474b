//! What each series of samples sees of a motion along x and y, and what all of them know of it.

use super::model::Samples;
use super::shape::{Coupling, Shape, Sight, legendre};

/// Where one direction knows less than this share of what the other does, all edges lean one way.
const LEAST_RATIO: f32 = 1e-2;

/// Edges that lean by no more than this, rad, are upright.
const UPRIGHT: f32 = 2e-3;

/// No more is believed of what a slot's second measurement has of the speed along x: a tenth of a second.
const MOST_DELAY_NS: f32 = 1e8;

impl Samples<'_> {
    /// What this series sees of a tone's shape.
    pub(crate) fn sight(&self, series: usize) -> Sight {
        let slot = series % self.slots.max(1);
        let axes = (self.channels > 1).then(|| {
            let [x, y] = self.both(series, slot);
            match self.lean {
                None => [x, y],
                Some([along_x, along_y]) => {
                    let across = Coupling {
                        of_motion: along_x * x.of_motion + along_y * y.of_motion,
                        of_speed_s: along_x * x.of_speed_s + along_y * y.of_speed_s,
                    };
                    [across, Coupling::default()]
                }
            }
        });
        Sight {
            polynomials: legendre(self.slot_eta[slot]),
            axes,
        }
    }

    /// What a series sees of the motion along x and y.
    fn both(&self, series: usize, slot: usize) -> [Coupling; 2] {
        let of = self.couplings.get(slot).copied().unwrap_or_default();
        let coupling = |of_motion: f32, of_speed_ns: f32| Coupling {
            of_motion,
            of_speed_s: 1e-9 * of_speed_ns,
        };
        if series < self.slots {
            [
                coupling(1.0, 0.0),
                coupling(of.coupling, of.coupling_delay_ns),
            ]
        } else {
            // What is added up is weighted by the information, of which the first measurement has so much more.
            let more = self.series_weight[slot] / self.series_weight[series].max(1e-20);
            let cross_ns = (more * of.coupling_delay_ns).clamp(-MOST_DELAY_NS, MOST_DELAY_NS);
            [coupling(0.0, cross_ns), coupling(1.0, of.delay_ns)]
        }
    }

    /// Sum over the samples of their weight times the squared amplitude that they see.
    pub(crate) fn seen_power(&self, shape: &Shape, hz: f32) -> f32 {
        let seen = |series: usize| self.sight(series).seen(shape, hz).norm_sqr();
        (0..self.series())
            .map(|s| self.series_weight[s] * seen(s))
            .sum()
    }

    /// The information of all samples: of x, of both, of y.
    pub(crate) fn information(&self) -> [f32; 3] {
        let mut sum = [0.0_f32; 3];
        for series in 0..self.series() {
            let sight = self.sight(series);
            let w = self.series_weight[series];
            let (x, y) = (sight.of_drift(0), sight.of_drift(1));
            for (sum, part) in sum.iter_mut().zip([x * x, x * y, y * y]) {
                *sum += w * part;
            }
        }
        sum
    }

    /// Where all edges lean one way only the motion across them can be told, and is fitted from here on (the aperture
    /// problem).
    pub(crate) fn lean(&mut self) {
        let [xx, xy, yy] = self.information();
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let apart = crate::math::sqrtf(half * half + xy * xy);
        if self.channels < 2 || mean - apart > LEAST_RATIO * (mean + apart) {
            return;
        }
        // The eigenvector of the larger eigenvalue.
        let (mut x, mut y) = if half >= 0.0 {
            (half + apart, xy)
        } else {
            (xy, apart - half)
        };
        let size = crate::math::sqrtf(x * x + y * y).max(f32::MIN_POSITIVE);
        if x < 0.0 {
            (x, y) = (-x, -y);
        }
        self.axes = 1;
        // Upright edges, or samples that know x alone, tell x and nothing else.
        if y.abs() > UPRIGHT * size {
            self.lean = Some([x / size, y / size]);
        }
    }
}
