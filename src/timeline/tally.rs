//! What became of the rows behind a sample, apart from what they measured.

use crate::report::Warnings;

/// Counts of rows, groups and frames, each of which saturates.
///
/// The line side makes one a frame and sends it along with the next sample; a window's warnings are decided from
/// the sum over its frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Frames that came, whether or not any of their rows were measured.
    pub frames: u16,
    /// Rows that were to be measured, which leaves out those that the reference was learned from.
    pub rows: u16,
    /// Of these, rows without enough texture.
    pub no_texture: u16,
    /// Of these, rows that something passed before.
    pub occluded: u16,
    /// Of these, rows with far less light than their reference.
    pub unlit: u16,
    /// Frames that were copies of the frame before.
    pub repeated_frames: u16,
    /// How often the reference was given up and learned again.
    pub relearned: u16,
    /// Groups of which too few rows were measured to make a sample.
    pub thin_groups: u16,
    /// Samples that were dropped on their way, for want of room or of time.
    pub dropped_samples: u16,
    /// Frames that were too dark or saturated.
    pub bad_light: u16,
    /// What the source of the lines warns of.
    pub notes: Warnings,
}

impl Tally {
    /// The tally of nothing.
    pub const NONE: Self = Self {
        frames: 0,
        rows: 0,
        no_texture: 0,
        occluded: 0,
        unlit: 0,
        repeated_frames: 0,
        relearned: 0,
        thin_groups: 0,
        dropped_samples: 0,
        bad_light: 0,
        notes: Warnings::NONE,
    };

    /// Adds what became of further rows.
    pub fn add(&mut self, more: &Self) {
        let add = |sum: &mut u16, more: u16| *sum = sum.saturating_add(more);
        add(&mut self.frames, more.frames);
        add(&mut self.rows, more.rows);
        add(&mut self.no_texture, more.no_texture);
        add(&mut self.occluded, more.occluded);
        add(&mut self.unlit, more.unlit);
        add(&mut self.repeated_frames, more.repeated_frames);
        add(&mut self.relearned, more.relearned);
        add(&mut self.thin_groups, more.thin_groups);
        add(&mut self.dropped_samples, more.dropped_samples);
        add(&mut self.bad_light, more.bad_light);
        self.notes = self.notes.union(more.notes);
    }
}
