//! Amplitude over time and frequency, in bounded memory.

/// Most columns that are kept: then neighbours are merged and twice as many windows share one.
const MOST_COLUMNS: usize = 256;

/// Columns of amplitudes, one for each window or some windows, oldest first.
#[derive(Clone, Debug)]
pub(super) struct Spectrogram {
    columns: Vec<Vec<f32>>,
    /// Windows that share a column.
    per_column: usize,
    /// Windows in the newest column.
    in_newest: usize,
    /// End of the newest window, s.
    pub end_s: f64,
    /// Start of the oldest window, s.
    pub start_s: Option<f64>,
}

impl Default for Spectrogram {
    fn default() -> Self {
        Self {
            columns: Vec::new(),
            per_column: 1,
            in_newest: 0,
            end_s: 0.0,
            start_s: None,
        }
    }
}

impl Spectrogram {
    /// Adds the amplitudes of a window.
    pub(super) fn push(&mut self, amplitudes: Vec<f32>) {
        match self.columns.last_mut() {
            Some(newest) if self.in_newest < self.per_column => {
                merge(newest, &amplitudes);
                self.in_newest += 1;
            }
            _ => {
                self.columns.push(amplitudes);
                self.in_newest = 1;
            }
        }
        if self.columns.len() > MOST_COLUMNS {
            self.halve();
        }
    }

    fn halve(&mut self) {
        let mut merged = Vec::with_capacity(MOST_COLUMNS);
        for pair in self.columns.chunks(2) {
            let mut column = pair[0].clone();
            pair.get(1).inspect(|second| merge(&mut column, second));
            merged.push(column);
        }
        if self.columns.len().is_multiple_of(2) {
            self.in_newest += self.per_column;
        }
        self.per_column *= 2;
        self.columns = merged;
    }

    /// The columns.
    pub(super) fn columns(&self) -> &[Vec<f32>] {
        &self.columns
    }
}

/// The larger of both, frequency by frequency: a tone that was there for a moment stays visible.
fn merge(into: &mut [f32], other: &[f32]) {
    for (a, b) in into.iter_mut().zip(other) {
        *a = a.max(*b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_does_not_grow_and_keeps_what_was() {
        let mut spectrogram = Spectrogram::default();
        for i in 0..10_000 {
            spectrogram.push(vec![if i == 5_000 { 9.0 } else { 1.0 }]);
        }
        let columns = spectrogram.columns();
        assert!(columns.len() <= MOST_COLUMNS && columns.len() > MOST_COLUMNS / 3);
        let loud: Vec<_> = columns
            .iter()
            .enumerate()
            .filter(|(_, c)| c[0] > 1.0)
            .collect();
        assert_eq!(loud.len(), 1);
        let place = loud[0].0 as f64 / columns.len() as f64;
        assert!((place - 0.5).abs() < 0.02, "{place}");
    }
}
