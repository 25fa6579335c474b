//! What a model leaves of the window: its periodogram and its noise, kept while the search asks for them.

use super::demodulated::{Demodulated, Struck};
use super::fit::Fit;
use super::judge::Noise;
use super::model::Samples;
use super::parameters::Model;
use super::periodogram::{Band, Periodogram, Places};
use super::phase::Frequency;

/// Candidates that noise explains, after which a window is given up: each costs a fit.
const MOST_REFUSED: u32 = 10;

/// Changing tones that are tried in a window: each costs some fits.
const MOST_CHANGING: u32 = 3;

/// The residual of one model, along one axis after the other.
#[derive(Debug)]
pub(crate) struct Residual<'g> {
    grid: &'g mut [f32],
    noise: &'g mut [Noise; 2],
    band: Band,
    axes: usize,
    /// The noise along these axes is that of the model.
    known: [bool; 2],
    /// What the grid holds.
    places: Option<Places>,
    refused: u32,
    changing: u32,
    strict: bool,
    hopeless: bool,
}

impl<'g> Residual<'g> {
    /// Of no model yet.
    pub(crate) fn new(
        samples: &Samples<'_>,
        band: Band,
        grid: &'g mut [f32],
        noise: &'g mut [Noise; 2],
    ) -> Self {
        for noise in noise.iter_mut() {
            noise.assume_white(0.0, 1.0);
            noise
                .images_mut()
                .measure(samples, band.fps, band.highest_hz);
        }
        Self {
            grid,
            noise,
            band,
            axes: samples.axes.clamp(1, 2),
            known: [false; 2],
            places: None,
            refused: 0,
            changing: 0,
            strict: false,
            hopeless: false,
        }
    }

    /// The grid, for another use, and the noise as it was measured last.
    pub(crate) fn into_parts(self) -> (&'g mut [f32], &'g [Noise; 2]) {
        (self.grid, self.noise)
    }

    /// Leaves samples out that are far off all others.
    pub(crate) fn leave_outliers_out(&mut self, samples: &mut Samples<'_>, model: &Model) {
        super::outlier::leave_out(samples, model, self.grid);
        self.forget();
    }

    /// Another model is looked at: what is known is of no use.
    pub(crate) fn forget(&mut self) {
        self.places = None;
        self.known = [false; 2];
    }

    /// A search begins whose tones have to stand out of the noise as it is; the one before took it for white.
    pub(crate) fn begin_again(&mut self) {
        self.strict = true;
        self.hopeless = false;
        self.forget();
    }

    /// Length of the window that was looked at last, s.
    pub(crate) fn length_s(&self) -> f32 {
        self.periodogram().map_or(0.0, |p| p.length_s)
    }

    /// Tones have to stand out of the noise as it is.
    pub(crate) const fn is_strict(&self) -> bool {
        self.strict
    }

    /// Tones only have to stand out of white noise.
    pub(crate) fn takes_white(&self) -> bool {
        !self.strict || self.is_white()
    }

    /// What is left is noise: no further tone is looked for.
    pub(crate) fn give_up(&mut self) {
        self.hopeless = true;
    }

    /// What is left was found to be noise.
    pub(crate) const fn is_hopeless(&self) -> bool {
        self.hopeless
    }

    /// A candidate was refused for the noise; says whether enough have been.
    pub(crate) fn refuse(&mut self) -> bool {
        self.refused += 1;
        self.refused >= MOST_REFUSED
    }

    /// Fewer changing tones than are tried in a window have been; from now on one more has.
    pub(crate) fn may_try_changing(&mut self) -> bool {
        self.changing += 1;
        self.changing <= MOST_CHANGING
    }

    /// The periodogram of what `model` leaves along an axis, unless the grid holds it; measures the noise along it.
    pub(crate) fn look(&mut self, samples: &mut Samples<'_>, model: &Model, axis: usize) {
        let axis = axis.min(1);
        if self.known[axis] && self.places.is_some_and(|p| p.axis() == axis) {
            return;
        }
        self.places = Places::fill(samples, model, self.grid, self.band, axis);
        if self.known[axis] {
            return;
        }
        self.known[axis] = true;
        let freedom = Fit::freedom(samples, model);
        match self.places.and_then(|places| places.of(self.grid)) {
            Some(p) => self.noise[axis].measure(&p, model.squares, freedom),
            None => self.noise[axis].assume_white(model.squares, freedom),
        }
    }

    /// Measures the noise along all axes.
    pub(crate) fn look_all(&mut self, samples: &mut Samples<'_>, model: &Model) {
        for axis in (0..self.axes).rev() {
            if !self.known[axis] {
                self.look(samples, model, axis);
            }
        }
    }

    /// The noise along an axis, as it was measured last.
    pub(crate) fn noise(&self, axis: usize) -> &Noise {
        &self.noise[axis.min(1)]
    }

    /// The noise is white along all axes.
    pub(crate) fn is_white(&self) -> bool {
        self.noise[..self.axes].iter().all(Noise::is_white)
    }

    /// The periodogram that was looked at last.
    pub(crate) fn periodogram(&self) -> Option<Periodogram<'_>> {
        self.places.and_then(|places| places.of(self.grid))
    }

    /// The noise's variance at `hz` along an axis, px², as deviations are stated against it.
    pub(crate) fn variance(&self, hz: f32, axis: usize) -> f32 {
        let p = self.periodogram().filter(|p| p.axis == axis);
        self.noise(axis).at(hz, p.as_ref())
    }

    /// Where and how fast an evenly changing tone near a frequency along an axis may be in what `model` leaves, turns a window length
    /// away and turns a window length squared.
    pub(crate) fn ramp(
        &mut self,
        samples: &mut Samples<'_>,
        model: &Model,
        at: (Frequency, usize),
    ) -> (f32, f32) {
        self.places = None;
        let seen = Demodulated::of(samples, model, at, self.grid);
        seen.map_or((0.0, 0.0), |seen| seen.ramp())
    }

    /// When what `model` leaves near a frequency along an axis may have been struck.
    pub(crate) fn struck(
        &mut self,
        samples: &mut Samples<'_>,
        model: &Model,
        at: (Frequency, usize),
    ) -> Option<Struck> {
        self.places = None;
        let seen = Demodulated::of(samples, model, at, self.grid)?;
        Some(seen.struck(samples.length_s))
    }

    /// The onset of the last tone of `model`, which was struck about then, to one sample: where what the samples gain by it
    /// from there on is most.
    pub(crate) fn place_onset(&mut self, samples: &mut Samples<'_>, model: &mut Model) {
        self.places = None;
        super::onset::place(samples, model, self.grid);
    }
}
