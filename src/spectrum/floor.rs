//! The noise floor: the power of what is no tone against frequency.
//!
//! Wander, random vibration and codecs are not white. The residual's periodogram is cut into bands of six
//! cells or 8 % of their frequency. A band's level is a mean that single places do not lift: places count
//! no more than three times the level. Neighbours are merged, the two most alike first, while a
//! likelihood-ratio test cannot tell them apart (agglomerative segmentation; both sides exponential).
//! Where a single segment is left the noise is white, and its level is what the fit's residual says.

use super::periodogram::Periodogram;

/// Most bands.
pub(crate) const MOST_BANDS: usize = 64;

/// A band is so many cells wide at least.
const CELLS: f32 = 6.0;

/// A band is so wide at least, as a share of its frequency.
const WIDTH: f32 = 0.08;

/// Segments are told apart where the logarithm of their likelihood ratio is this large.
pub(crate) const ALIKE: f32 = 7.0;

/// The same before a tone is fitted: a weak one alone lifts its band.
pub(crate) const ALIKE_UNFITTED: f32 = 14.0;

/// With fewer bands a floor is not sought: the noise is taken for white.
const LEAST_BANDS: usize = 4;

/// Noise of one level over a part of the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    /// Where it ends, Hz; it begins where the one before it ends.
    pub(crate) to_hz: f32,
    /// Cells in it.
    pub(crate) cells: f32,
    /// Mean power, px² as [`Periodogram::z`].
    pub(crate) level: f32,
    /// What merging it with the next would cost.
    cost: f32,
}

/// The floor, in segments from low to high frequency.
#[derive(Clone, Debug)]
pub(crate) struct Floor {
    pub(crate) segments: heapless::Vec<Segment, MOST_BANDS>,
}

impl Floor {
    /// Nothing known: white.
    pub(crate) const fn new() -> Self {
        Self {
            segments: heapless::Vec::new(),
        }
    }

    /// One level for all frequencies.
    pub(crate) fn is_white(&self) -> bool {
        self.segments.len() <= 1
    }

    /// The bands of `p`, none merged yet.
    pub(crate) fn measure(&mut self, p: &Periodogram<'_>) {
        self.segments.clear();
        let (low, high) = (p.band.lowest_hz, p.band.highest_hz);
        let cell_hz = 1.0 / p.length_s;
        // As fine as there is room: bands of a share of their frequency double their number every octave.
        let share = WIDTH.max(1.5 * libm::logf((high / low).max(1.0)) / MOST_BANDS as f32);
        let mut from = low;
        while from < high && !self.segments.is_full() {
            let mut to = from + (CELLS * cell_hz).max(share * from);
            // What would be left of the last is too little for a band.
            if to + 0.5 * (to - from) > high {
                to = high;
            }
            if let Some((level, cells)) = level_of(p, from, to) {
                // There is room: it was asked above.
                let _ = self.segments.push(Segment {
                    to_hz: to,
                    cells,
                    level,
                    cost: 0.0,
                });
            } else if let Some(last) = self.segments.last_mut() {
                last.to_hz = to;
            }
            from = to;
        }
        if self.segments.len() < LEAST_BANDS {
            self.segments.clear();
        }
        for i in 0..self.segments.len() {
            self.price(i);
        }
    }

    /// Merges neighbours while that costs less than `alike`.
    pub(crate) fn merge(&mut self, alike: f32) {
        loop {
            let mut cheapest: Option<(usize, f32)> = None;
            for (i, s) in self.segments.iter().enumerate() {
                let last = i + 1 == self.segments.len();
                if !last && s.cost < alike && cheapest.is_none_or(|(_, c)| s.cost < c) {
                    cheapest = Some((i, s.cost));
                }
            }
            let Some((i, _)) = cheapest else { return };
            let a = self.segments.remove(i);
            if let Some(b) = self.segments.get_mut(i) {
                b.level = (a.cells * a.level + b.cells * b.level) / (a.cells + b.cells);
                b.cells += a.cells;
            }
            self.price(i);
            if let Some(before) = i.checked_sub(1) {
                self.price(before);
            }
        }
    }

    /// What merging segment `i` with the next costs: the logarithm of their likelihood ratio.
    fn price(&mut self, i: usize) {
        if let (Some(a), Some(b)) = (self.segments.get(i), self.segments.get(i + 1)) {
            let pooled = (a.cells * a.level + b.cells * b.level) / (a.cells + b.cells);
            let cost =
                a.cells * libm::logf(pooled / a.level) + b.cells * libm::logf(pooled / b.level);
            if let Some(a) = self.segments.get_mut(i) {
                a.cost = cost;
            }
        }
    }

    /// The segment at `hz`; `None` where the floor is white.
    pub(crate) fn at(&self, hz: f32) -> Option<&Segment> {
        if self.is_white() {
            return None;
        }
        let inside = self.segments.iter().find(|s| hz < s.to_hz);
        inside.or(self.segments.last())
    }

    /// Level of the quietest segment.
    pub(crate) fn quietest(&self) -> f32 {
        let levels = self.segments.iter().map(|s| s.level);
        levels.fold(f32::INFINITY, f32::min)
    }
}

/// Mean power between two frequencies, to which single places add little, and over how many cells.
fn level_of(p: &Periodogram<'_>, from_hz: f32, to_hz: f32) -> Option<(f32, f32)> {
    let places = p.between(from_hz, to_hz);
    let mean = |most: f32| {
        let (mut sum, mut count) = (0.0, 0.0);
        for z in places.clone().filter_map(|b| p.level(b)) {
            sum += z.min(most);
            count += 1.0;
        }
        (sum / count, count)
    };
    let (plain, count) = mean(f32::INFINITY);
    let cells = count / p.places();
    if !(plain > 0.0 && plain.is_finite()) || cells < 0.3 * CELLS {
        return None;
    }
    // An exponential distribution's median is ln 2 of its mean, and cut off at three times its mean it has 0.95 of it.
    let mut level = median(p, places.clone(), plain) / core::f32::consts::LN_2;
    for _ in 0..4 {
        level = mean(3.0 * level).0 / 0.95;
    }
    // What is exactly nothing has no logarithm.
    Some((level.max(1e-9 * plain), cells))
}

/// Half of the places are below it, to a part in a hundred; found by halving, in place.
fn median(p: &Periodogram<'_>, places: core::ops::Range<usize>, mean: f32) -> f32 {
    let (mut low, mut high) = (0.0, 2.0 * mean);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let (mut below, mut count) = (0, 0);
        for z in places.clone().filter_map(|b| p.level(b)) {
            below += u32::from(z < middle);
            count += 1;
        }
        if 2 * below < count {
            low = middle;
        } else {
            high = middle;
        }
        if high - low < 0.01 * low {
            break;
        }
    }
    0.5 * (low + high)
}
