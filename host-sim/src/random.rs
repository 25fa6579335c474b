//! Chance, as the seed has it.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// The random stream for `purpose` number `index`: streams do not depend on each other, so a frame
/// can be made without those before it.
pub(super) fn stream(seed: u64, purpose: u16, index: u32) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(u64::from(purpose) << 32 | u64::from(index));
    rng
}

/// Evenly from 0 to below 1.
pub(super) fn unit(rng: &mut impl RngCore) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
