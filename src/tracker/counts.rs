//! Every line is counted, whatever its outcome.

/// The lines' outcomes since the tracker was made. (64 bits do not run out.)
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Measured.
    pub measured: u64,
    /// Used for learning.
    pub learning: u64,
    /// Without enough texture.
    pub no_texture: u64,
    /// Unlike their reference.
    pub occluded: u64,
    /// With less than an eighth of their reference's light.
    pub unlit: u64,
    /// Copies of the frame before.
    pub repeated: u64,
    /// Of another width, or of a row that is not there.
    pub misfit: u64,
    /// Frames all of whose lines were those of the frame before.
    pub repeated_frames: u32,
    /// How often the scene changed and the reference was learned again.
    pub relearned: u32,
}
