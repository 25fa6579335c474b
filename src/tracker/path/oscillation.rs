//! The motion as the rows before tell it: how fast it oscillates, and where it is, how fast, and how that changes.
//!
//! Of one tone of ω rad a row the rows at −B, 0 and B tell x(B) + x(−B) − 2·x = −4·sin²(ωB/2)·(x − mean): a regression
//! over some thousand rows gives ω (Prony's method). Place, speed and acceleration are then the state of
//! an oscillator of that ω, followed by a Kalman filter with fading memory, whose noise is that of the rows alone: over the
//! rows of an exposure a speed is known far better than from its last four.

use crate::math::sqrtf;

/// Rows that are kept: twice the largest B, and one.
const RING: usize = 32;
const MOST_LAG: u8 = 15;

/// Further apart, two rows are not of one motion, px.
const JUMP_PX: f32 = 3.0;

/// Where a row is kept; those of a run are whole numbers from 0 on.
fn ring(row: f32) -> usize {
    row as i32 as usize % RING
}

/// sin ωτ/ω and (1 − cos ωτ)/ω² of a time τ, and cos ωτ.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Basis {
    cos: f32,
    pub(super) speed: f32,
    pub(super) change: f32,
}

impl Basis {
    pub(super) fn new(omega: f32, rows: f32) -> Self {
        let turn = omega * rows;
        if turn.abs() < 0.05 {
            let square = turn * turn;
            return Self {
                cos: 1.0 - 0.5 * square,
                speed: rows * (1.0 - square / 6.0),
                change: 0.5 * rows * rows * (1.0 - square / 12.0),
            };
        }
        let cos = libm::cosf(turn);
        Self {
            cos,
            speed: libm::sinf(turn) / omega,
            change: (1.0 - cos) / (omega * omega),
        }
    }
}

/// The frequency's regression: sums of the present frame, and fading ones of those before, each about its frame's own mean.
/// Frames may have been read at different stripes of a periodic texture.
#[derive(Clone, Copy, Debug, Default)]
struct Regression {
    /// Fading mean and mean square of all rows.
    n: f32,
    x: f32,
    xx: f32,
    frame: Sums,
    before: Moments,
}

/// Sums of one frame; x is taken from its first row on, so that single precision is enough.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    first: f32,
    n: f32,
    x: f32,
    z: f32,
    xx: f32,
    xz: f32,
    noise: f32,
}

/// Rows, Σ x² and −Σ xz.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    n: f32,
    xx: f32,
    xz: f32,
}

impl Regression {
    const MEMORY: f32 = 8192.0;
    /// Fewer rows tell nothing, of all and in a frame.
    const LEAST: f32 = 192.0;
    const LEAST_IN_FRAME: f32 = 16.0;

    /// `noise`: variance of a row.
    fn add(&mut self, x: f32, z: f32, noise: f32) {
        self.n = (self.n + 1.0).min(Self::MEMORY);
        let share = 1.0 / self.n;
        self.x += (x - self.x) * share;
        self.xx += (x * x - self.xx) * share;
        let frame = &mut self.frame;
        if frame.n == 0.0 {
            frame.first = x;
        }
        let x = x - frame.first;
        frame.n += 1.0;
        frame.x += x;
        frame.z += z;
        frame.xx += x * x;
        frame.xz += x * z;
        frame.noise += noise;
    }

    fn end_frame(&mut self) {
        let Sums {
            n,
            x,
            z,
            xx,
            xz,
            noise,
            ..
        } = core::mem::take(&mut self.frame);
        if n < Self::LEAST_IN_FRAME {
            return;
        }
        let before = &mut self.before;
        let keep = (1.0 - n / Self::MEMORY).max(0.0);
        before.n = before.n * keep + n;
        // The noise of x is twice in z, with the other sign.
        before.xx = before.xx * keep + (xx - x * x / n - noise).max(0.0);
        before.xz = before.xz * keep + (x * z / n - xz - 2.0 * noise);
    }

    fn variance(&self) -> f32 {
        (self.xx - self.x * self.x).max(0.0)
    }

    /// 4·sin²(ωB/2); `None` while it is not known.
    fn bend(&self) -> Option<f32> {
        let Moments { n, xx, xz } = self.before;
        let bend = xz / xx;
        (n >= Self::LEAST && bend.is_finite()).then_some(bend.clamp(0.0, 4.0))
    }
}

/// See the [module](self).
#[derive(Clone, Copy, Debug)]
pub(super) struct Oscillation {
    lag: u8,
    /// Share of what is known that is left a row later.
    keep: f32,
    regression: Regression,
    recent: [f32; RING],
    run: u8,
    /// The last row, in rows since the beginning of this frame.
    row: f32,
    omega: f32,
    one_row: Basis,
    /// Place, speed and acceleration at the last row, px and rows, and their variances.
    state: [f32; 3],
    variance: [[f32; 3]; 3],
}

impl Oscillation {
    /// For lines that are exposed for so many rows, with a memory of so many.
    pub(super) fn new(exposure_rows: f32, memory_rows: f32) -> Self {
        Self {
            lag: ((0.25 * exposure_rows) as u8).clamp(2, MOST_LAG),
            keep: 1.0 - 1.0 / memory_rows,
            regression: Regression::default(),
            recent: [0.0; RING],
            run: 0,
            row: 0.0,
            omega: 0.0,
            one_row: Basis::new(0.0, 1.0),
            state: [0.0; 3],
            variance: Self::unknown(16.0, 0.0),
        }
    }

    fn unknown(place_px2: f32, omega2: f32) -> [[f32; 3]; 3] {
        let speed = place_px2 * omega2.max(1e-4);
        [
            [place_px2, 0.0, 0.0],
            [0.0, speed, 0.0],
            [0.0, 0.0, speed * omega2.max(1e-4)],
        ]
    }

    /// A frame begins so many rows after the last one did.
    pub(super) fn begin_frame(&mut self, rows: f32) {
        self.row -= rows;
        self.run = 0;
        self.regression.end_frame();
        if let Some(bend) = self.regression.bend() {
            self.omega = 2.0 / f32::from(self.lag) * libm::asinf(0.5 * sqrtf(bend));
        }
        self.one_row = Basis::new(self.omega, 1.0);
    }

    /// rad a row; 0 while it is not known.
    pub(super) fn omega(&self) -> f32 {
        self.omega
    }

    /// Mean square of the motion about its middle, px².
    pub(super) fn power_px2(&self) -> f32 {
        self.regression.variance()
    }

    /// A frame begins so many rows after the last one did; the frequency is as another knows it.
    pub(super) fn begin_frame_like(&mut self, rows: f32, other: &Self) {
        self.row -= rows;
        self.omega = other.omega;
        self.one_row = other.one_row;
        self.regression = other.regression;
    }

    /// Where the picture will be in the first row of this frame, px; `None` where the frequency is not known, or the rows
    /// before are long ago.
    pub(super) fn foresee(&self) -> Option<f32> {
        const MOST_ROWS: f32 = 4096.0;
        let rows = -self.row;
        let soon = rows > 0.0 && rows < MOST_ROWS;
        let Basis { speed, change, .. } = Basis::new(self.omega, rows);
        let [px, v, a] = self.state;
        let px = px + v * speed + a * change;
        (soon && px.is_finite()).then_some(px)
    }

    /// What the rows before say of this one.
    fn go_to(&mut self, row: f32) {
        let rows = row - self.row;
        let Basis { cos, speed, change } = match rows == 1.0 {
            true => self.one_row,
            false => Basis::new(self.omega, rows),
        };
        let omega2 = self.omega * self.omega;
        let f = [
            [1.0, speed, change],
            [0.0, cos, speed],
            [0.0, -omega2 * speed, cos],
        ];
        let apply = |v: [f32; 3]| f.map(|f| f[0] * v[0] + f[1] * v[1] + f[2] * v[2]);
        // F·P·Fᵀ; P is symmetric.
        let half = transposed(self.variance.map(apply));
        self.variance = half.map(apply);
        self.state = apply(self.state);
        let far = rows != 1.0;
        let fade = if far { 4.0 } else { 1.0 / self.keep };
        for v in self.variance.as_flattened_mut() {
            *v *= fade;
        }
        let most = 4.0 * self.power_px2().max(0.04);
        if far {
            // Over a gap the phase is known only as well as the frequency.
            let unsure = Self::unknown(0.02 * most, omega2);
            for (v, u) in self
                .variance
                .iter_mut()
                .flatten()
                .zip(unsure.iter().flatten())
            {
                *v += u;
            }
        }
        // Neither is true of what is no number.
        let [[a, _, _], [_, e, _], [_, _, i]] = self.variance;
        let away = self.state[0] - self.regression.x;
        let known = a < most && a.min(e).min(i) > 0.0 && away * away < 4.0 * most;
        if !known {
            self.state = [self.regression.x, 0.0, 0.0];
            self.variance = Self::unknown(most, omega2);
        }
        self.row = row;
    }

    /// Takes a row's place.
    pub(super) fn add(&mut self, row: f32, px: f32, information: f32, of_frequency: bool) {
        let before = self.recent[ring(self.row)];
        let follows = row == self.row + 1.0 && (px - before).abs() < JUMP_PX;
        self.go_to(row);
        let own = 1.0 / information;
        let [[a, b, c], _, _] = self.variance;
        let gain = [a, b, c].map(|v| v / (a + own));
        let off = px - self.state[0];
        for (v, g) in self.state.iter_mut().zip(gain) {
            *v += g * off;
        }
        // Both halves alike: what rounding makes of their difference would grow.
        let [[_, _, _], [_, e, f], [_, _, i]] = self.variance;
        let [place, speed, change] = gain;
        let (ab, ac) = (b - place * b, c - place * c);
        let bc = f - speed * c;
        self.variance = [
            [a - place * a, ab, ac],
            [ab, e - speed * b, bc],
            [ac, bc, i - change * c],
        ];
        if !of_frequency {
            self.run = 0;
            return;
        }
        self.run = if follows {
            self.run.saturating_add(1)
        } else {
            1
        };
        let at = |before: u8| ring(row - f32::from(before));
        self.recent[at(0)] = px;
        if self.run > 2 * self.lag {
            let [x, before] = [self.lag, 2 * self.lag].map(|k| self.recent[at(k)]);
            self.regression.add(x, px + before - 2.0 * x, own);
        }
    }

    /// Speed and acceleration at a row that is at about `px`, px and rows.
    pub(super) fn motion(&self, row: f32, px: f32, information: f32) -> [f32; 2] {
        let mut here = *self;
        here.add(row, px, information, false);
        [here.state[1], here.state[2]]
    }
}

fn transposed(m: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    let [[a, b, c], [d, e, f], [g, h, i]] = m;
    [[a, d, g], [b, e, h], [c, f, i]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_is_followed_over_frames_and_gaps() {
        // 4 px at 463 Hz with 33.67 µs a row, 300 rows and a gap of 195.
        let omega = core::f32::consts::TAU * 463.0 * 33.67e-6;
        let mut oscillation = Oscillation::new(29.7, 29.7);
        let mut noise = 1u32;
        let (mut worst, mut worst_at_first) = (0.0f32, 0.0f32);
        for frame in 0..20u16 {
            oscillation.begin_frame(495.0);
            for row in (0..300u16).map(f32::from) {
                let turn = omega * (f32::from(frame) * 495.0 + row);
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let off = ((noise >> 8) as f32 / 8_388_608.0 - 1.0) * 0.03;
                let px = 0.4 + 4.0 * libm::sinf(turn) + off;
                let [speed, change] = oscillation.motion(row, px, 3000.0);
                let error = (speed - 4.0 * omega * libm::cosf(turn)).abs() / omega
                    + (change + 4.0 * omega * omega * libm::sinf(turn)).abs() / (omega * omega);
                match row < 20.0 {
                    true if frame > 4 => worst_at_first = worst_at_first.max(error),
                    false if frame > 4 => worst = worst.max(error),
                    _ => {}
                }
                oscillation.add(row, px, 3000.0, true);
            }
        }
        assert!((oscillation.omega() / omega - 1.0).abs() < 2e-3);
        assert!((oscillation.power_px2() - 8.0).abs() < 0.5);
        // Of 4 px each.
        assert!(worst < 0.1, "{worst} px");
        assert!(worst_at_first < 1.0, "{worst_at_first} px");
    }

    #[test]
    fn what_is_no_number_is_forgotten() {
        let mut oscillation = Oscillation::new(10.0, 10.0);
        oscillation.begin_frame(f32::INFINITY);
        oscillation.add(3.0, f32::NAN, 100.0, false);
        oscillation.begin_frame(100.0);
        for row in 0..100u8 {
            oscillation.add(f32::from(row), 1.0, 1000.0, true);
        }
        let [speed, change] = oscillation.motion(100.0, 1.0, 1000.0);
        assert!(
            speed.abs() < 0.01 && change.abs() < 0.01,
            "{speed} {change}"
        );
    }
}
