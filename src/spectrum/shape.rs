//! How a tone's amplitude and phase run over the rows: polynomials of the row, along either axis.
//!
//! At one row, f and f ± k·fps look alike: what tells them apart is how the phase runs over the rows. A motion that is not
//! the same in all rows (a cantilever, a node, a rotation) has images at f ± k·fps in a model that takes all rows alike. So
//! a tone is a frequency and a shape, Σ c_m·P_m(η): complex coefficients of Legendre polynomials of the row, η from −1 to
//! 1. The constant along x alone is the rigid tone.

use num_complex::Complex32 as Complex;

/// Coefficients along one axis: polynomials of order 0 to 3.
pub(crate) const ORDERS: usize = 4;

/// Coefficients along both axes, x first.
pub(crate) const BASIS: usize = 2 * ORDERS;

/// Where a shape's constants along x and y are among its coefficients.
pub(crate) const CONSTANTS: [usize; 2] = [0, ORDERS];

const ZERO: Complex = Complex::new(0.0, 0.0);

/// P_0 to P_3 at `eta`.
pub(crate) fn legendre(eta: f32) -> [f32; ORDERS] {
    let square = eta * eta;
    [1.0, eta, 1.5 * square - 0.5, eta * (2.5 * square - 1.5)]
}

/// What a series of samples sees of a motion along one axis: of the motion, and of its speed, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Coupling {
    pub(crate) of_motion: f32,
    pub(crate) of_speed_s: f32,
}

/// What a series of samples sees of a shape: its polynomials, and of either axis so much.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) polynomials: [f32; ORDERS],
    /// `None`: the motion along x, and nothing else.
    pub(crate) axes: Option<[Coupling; 2]>,
}

impl Sight {
    /// What an amplitude along `axis` is multiplied by, for a tone of `hz`: motion is Re(conj(c)·e^(iωt)), so its speed has
    /// the amplitude −iω·c.
    fn factor(&self, axis: usize, hz: f32) -> Complex {
        match &self.axes {
            Some(axes) => {
                let turn = -core::f32::consts::TAU * hz * axes[axis].of_speed_s;
                Complex::new(axes[axis].of_motion, turn)
            }
            None => Complex::new(if axis == 0 { 1.0 } else { 0.0 }, 0.0),
        }
    }

    /// What coefficient `j` is multiplied by, for a tone of `hz`.
    pub(crate) fn column(&self, j: usize, hz: f32) -> Complex {
        let axis = usize::from(j >= ORDERS);
        self.factor(axis, hz).scale(self.polynomials[j % ORDERS])
    }

    /// The amplitude that is seen of a tone of `hz` with this shape.
    pub(crate) fn seen(&self, shape: &Shape, hz: f32) -> Complex {
        let [x, y] = shape.at(&self.polynomials);
        match &self.axes {
            None => x,
            Some(_) => self.factor(0, hz) * x + self.factor(1, hz) * y,
        }
    }

    /// How much is seen of what moves slowly along `axis`.
    pub(crate) fn of_drift(&self, axis: usize) -> f32 {
        match &self.axes {
            Some(axes) => axes[axis].of_motion,
            None => [1.0, 0.0][axis],
        }
    }
}

/// Complex amplitudes over the rows, px: those of [`ORDERS`] polynomials along x, then along y.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    coefficients: [Complex; BASIS],
    /// How many of them are fitted along x and along y.
    orders: [u8; 2],
}

impl Shape {
    /// The same in all rows, along x; no amplitude yet.
    const RIGID: Self = Self {
        coefficients: [ZERO; BASIS],
        orders: [1, 0],
    };

    /// The same in all rows, along x, 0, or y, 1; no amplitude yet.
    pub(crate) const fn along(axis: usize) -> Self {
        if axis == 0 {
            Self::RIGID
        } else {
            Self {
                coefficients: [ZERO; BASIS],
                orders: [0, 1],
            }
        }
    }

    /// The axis of a shape that is the same in all rows and along one axis.
    pub(crate) fn rigid_axis(&self) -> Option<usize> {
        match self.orders {
            [1, 0] => Some(0),
            [0, 1] => Some(1),
            _ => None,
        }
    }

    /// Fitted coefficients along either axis, no more than there are; without amplitude.
    pub(crate) fn of_orders(x: usize, y: usize) -> Self {
        Self {
            coefficients: [ZERO; BASIS],
            orders: [x.min(ORDERS) as u8, y.min(ORDERS) as u8],
        }
    }

    /// How many coefficients are fitted along x and along y.
    pub(crate) fn orders(&self) -> [usize; 2] {
        self.orders.map(usize::from)
    }

    /// Places of the coefficients that are fitted.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = usize> + use<> {
        let [x, y] = self.orders();
        (0..x).chain(ORDERS..ORDERS + y)
    }

    /// How many coefficients are fitted.
    pub(crate) fn count(&self) -> usize {
        let [x, y] = self.orders();
        x + y
    }

    /// Coefficient `j`; 0 beyond the last.
    pub(crate) fn coefficient(&self, j: usize) -> Complex {
        self.coefficients.get(j).copied().unwrap_or(ZERO)
    }

    /// Changes coefficient `j`.
    pub(crate) fn change(&mut self, j: usize, change: impl FnOnce(&mut Complex)) {
        if let Some(c) = self.coefficients.get_mut(j) {
            change(c);
        }
    }

    /// The amplitudes along x and y where the polynomials are these.
    pub(crate) fn at(&self, polynomials: &[f32; ORDERS]) -> [Complex; 2] {
        let mut axes = [ZERO; 2];
        for (axis, first) in CONSTANTS.into_iter().enumerate() {
            let count = usize::from(self.orders[axis]).min(ORDERS);
            let coefficients = &self.coefficients[first..first + count];
            for (c, &p) in coefficients.iter().zip(polynomials) {
                axes[axis] += c.scale(p);
            }
        }
        axes
    }

    /// No amplitude at all: nothing was fitted yet.
    pub(crate) fn is_zero(&self) -> bool {
        self.coefficients.iter().all(|c| *c == ZERO)
    }

    /// The shape of the mirror image.
    pub(crate) fn conjugate(&self) -> Self {
        Self {
            coefficients: self.coefficients.map(|c| c.conj()),
            orders: self.orders,
        }
    }

    /// Forgets the amplitude.
    pub(crate) fn clear(&mut self) {
        self.coefficients = [ZERO; BASIS];
    }

    /// The mean over the rows of the squared amplitude, px².
    pub(crate) fn power(&self) -> f32 {
        let mut sum = 0.0;
        for j in self.fitted() {
            let order = (j % ORDERS) as f32;
            sum += self.coefficients[j].norm_sqr() / (2.0 * order + 1.0);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomials_are_legendres() {
        for i in -4..=4_i8 {
            let x = f32::from(i) * 0.25;
            let p = legendre(x);
            assert_eq!((p[0], p[1]), (1.0, x));
            // (m + 1)·P_{m+1} = (2m + 1)·x·P_m − m·P_{m−1} (Bonnet).
            assert!((2.0 * p[2] - (3.0 * x * p[1] - p[0])).abs() < 1e-6);
            assert!((3.0 * p[3] - (5.0 * x * p[2] - 2.0 * p[1])).abs() < 1e-6);
        }
    }

    #[test]
    fn power_is_the_mean_over_the_rows() {
        let mut shape = Shape::of_orders(4, 2);
        for (i, j) in shape.fitted().enumerate() {
            shape.change(j, |c| *c = Complex::new(0.3 * i as f32 - 0.4, 0.1));
        }
        let mut mean = 0.0;
        let steps = 2000_u16;
        for i in 0..steps {
            let eta = (f32::from(i) + 0.5) / f32::from(steps) * 2.0 - 1.0;
            let p = legendre(eta);
            let [x, y] = shape.at(&p);
            let square = x.norm_sqr() + y.norm_sqr();
            mean += square / f32::from(steps);
        }
        assert!((mean / shape.power() - 1.0).abs() < 1e-3);
    }
}
