//! What vibrates where: amplitude and phase of a tone in every tile of the picture, beyond half the frame rate.
//!
//! Contract: [`Texture::build`] learns from a mean picture how each tile of a [`Grid`] answers to a shift; [`TileSums`]
//! then takes lines and adds up, for each tile, axis and tone, what a tone would leave there. Both live in memory that the
//! caller lends, neither allocates or waits. What the sums are divided by in the end is the caller's: one tone alone is
//! [`TileSums::single`]; several are fitted together (`rowtone-measure`).
//!
//! The mathematics. A tile that is shifted by a small (u, v) has pixels p = g·(r − u·∂r/∂x − v·∂r/∂y) + noise, g the line's
//! brightness against the mean picture r. With h made of r's slopes and freed of 1 and r, a row of the tile gives the
//! *scores*
//!
//! ```text
//! s = −Σ h·(p/g − r) = M·(u, v) + noise,      M = Σ h·(∂r/∂x, ∂r/∂y).
//! ```
//!
//! A row is exposed at its own time, so a tone of f Hz leaves Σ s·cos 2πft and Σ s·sin 2πft, summed over the rows and frames
//! of the tile, whatever f is against the frame rate: a row's time within its frame turns the phase as much as it turns that
//! of the cosine. Two tones whose sum or difference is a multiple of the frame rate look alike to every row, and cannot be
//! told apart in a tile.
//!
//! Two inner products a pixel, four multiply-adds a tone and row of a tile. Lock-in detection of the rows of a tile; scores and
//! information as in the two-axis estimate of [`crate::timeline`].

mod grid;
mod slopes;
mod sums;
mod texture;

pub use grid::{Grid, GridError, MAX_TILE, MIN_TILE};
pub use sums::{MAX_TONES, SumsError, SumsStorage, TileSums, ToneSums};
pub use texture::{Texture, TextureError, TextureStorage, TileTexture};

#[cfg(test)]
mod tests;
