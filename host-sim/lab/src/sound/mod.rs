//! Sounds with known truth: how well each way of filling recovers them.
//!
//! | file | what it does |
//! | --- | --- |
//! | [`agreement`] | gain, delay and signal-to-noise ratio against the truth |
//! | [`stft`] | power over time and frequency |
//! | [`sounds`], [`table`] | speech and music, and how well each method recovers them |

pub mod agreement;
pub mod sounds;
pub mod stft;
pub mod table;
