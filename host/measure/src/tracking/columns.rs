//! Whether a picture can be followed along its columns.
//!
//! Along both axes each row is read against the row of the reference where the rows before it led. Where few rows know that
//! well (plates and edges over many rows, chequers) the first frames may be read against the wrong ones, and a reference
//! that was learned from those stays wrong: most of its rows are then never measured, or jump from one to the next. Along
//! the rows alone nothing of that can happen.

use super::Engine;
use rowtone_clip::Frame;

/// So many frames tell.
const FRAMES: usize = 8;
/// A picture whose rows are lost along its columns has so many times fewer of them than along the rows alone,
const FEWER: f64 = 0.9;
/// or they jump further than this from one to the next, in their own standard deviations: 1 to 2.1 in some sixty recordings
/// that can be followed, of large motions and both axes too, 4 to 10 among chequers.
const JUMP: f64 = 3.5;
/// A picture that is swift along the rows jumps too, but hardly so far.
const SWIFT: f64 = 8.0;
/// Rows at both edges are measured along the rows alone.
const EDGES: usize = 4;
/// Rows that know less of their place tell nothing of that, 1/px².
const KNOWN: f32 = 25.0;
/// Fewer pairs of rows tell nothing.
const LEAST_PAIRS: usize = 200;

/// What the user is told.
pub(super) const LOST: &str = "the picture cannot be followed along its columns: measured along the rows alone, as by --axes x; a motion along the columns may leak into it";

/// How rows follow each other in some frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Steadiness {
    /// Pairs of rows next to each other that were measured.
    pairs: usize,
    /// How far the second lies from the first, along the columns where those are measured: the median in their standard
    /// deviations, 1 of noise.
    jump: f64,
}

impl Steadiness {
    /// Of an engine that has learned its reference.
    pub(super) fn of(engine: &mut Engine<'_>, frames: &[Frame]) -> Self {
        let (mut jumps, mut pairs) = (Vec::new(), 0);
        for frame in frames.iter().take(FRAMES).take_while(|f| !f.is_cut()) {
            let mut before: Option<(u16, [f32; 2])> = None;
            engine.measure(frame, |row| {
                let known = match &row.vertical {
                    Some(down) => [down.shift_px, down.information_per_px2],
                    None => [row.shift_px, row.information_per_px2],
                };
                if let Some((number, [place_before, information_before])) = before
                    && row.row == number + 1
                {
                    pairs += 1;
                    let [place, information] = known;
                    let variance = 1.0 / information + 1.0 / information_before;
                    let jump = (place - place_before).abs() / variance.sqrt();
                    if information.min(information_before) > KNOWN {
                        jumps.push(f64::from(jump));
                    }
                }
                before = Some((row.row, known));
            });
        }
        let middle = jumps.len() / 2;
        let jump = match jumps.is_empty() {
            true => 0.0,
            false => *jumps.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745,
        };
        Self { pairs, jump }
    }

    /// Nothing is to be suspected: nearly all of so many rows were measured, and none jumps.
    pub(super) fn is_plain(&self, rows: usize, frames: usize) -> bool {
        let inner = rows.saturating_sub(EDGES + 1) * frames.min(FRAMES);
        self.pairs as f64 > FEWER * inner as f64 && self.jump < JUMP
    }

    /// Along the rows alone it goes as `self` says, along both axes as `both`: rows were lost along the columns.
    pub(super) fn tells_of_loss(&self, both: &Self) -> bool {
        let inner = self.pairs.saturating_sub(EDGES * FRAMES);
        let fewer = (both.pairs as f64) < FEWER * inner as f64;
        let lost = fewer || both.jump > JUMP;
        lost && self.jump < SWIFT && self.pairs >= LEAST_PAIRS
    }
}

#[cfg(test)]
mod tests {
    use super::Steadiness;

    #[test]
    fn rows_that_only_the_columns_lose_tell() {
        let of = |pairs, jump| Steadiness { pairs, jump };
        // Chequers of six and of ten pixels, and some whose rows all look alike; plates without edges.
        assert!(of(1912, 1.3).tells_of_loss(&of(1136, 4.2)));
        assert!(of(1912, 3.5).tells_of_loss(&of(1352, 5.4)));
        assert!(of(1200, 1.1).tells_of_loss(&of(1168, 10.3)));
        assert!(of(5817, 1.0).tells_of_loss(&of(3847, 1.9)));
        // A swift picture under a sky.
        assert!(of(2160, 4.2).tells_of_loss(&of(287, 1.1)));
        // A swift motion along both axes; a part of 40 rows; a wall without texture; fields in one frame.
        assert!(!of(1144, 0.9).tells_of_loss(&of(1112, 2.1)));
        assert!(!of(312, 1.0).tells_of_loss(&of(280, 1.0)));
        assert!(!of(24, 0.4).tells_of_loss(&of(15, 0.2)));
        assert!(!of(1908, 10.4).tells_of_loss(&of(1400, 3.0)));
        assert!(of(1880, 1.0).is_plain(240, 30) && !of(1136, 2.8).is_plain(240, 30));
    }
}
