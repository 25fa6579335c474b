//! Samples of one window to tones, by a joint weighted fit on the samples that exist.
//!
//! Contract: `Estimator::load` takes a window (line side's memory is free again), [`Estimator::tones`] fits it and
//! gives every tone that is above the false-alarm level with its standard deviations. Nothing is allocated; all memory
//! is lent ([`EstimatorStorage`]). No input makes it panic.
//!
//! The idea (docs/spectrum.md has it at length): a periodogram of samples with gaps has ghosts at multiples of the
//! frame rate around every tone, so it is used only to propose. Tones are added one at a time from the largest of the
//! residual, tested against the energy that is left of them once every slot's unknown offset is projected away, and all
//! are refined together at the samples' exact times. The search ends at a false-alarm level.

#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns of matrices are told apart by their indices"
)]

mod alarm;
mod alias;
mod blur;
mod broadband;
mod changing;
mod cholesky;
mod claim;
mod config;
mod demodulated;
mod detect;
mod estimator;
mod fit;
mod floor;
mod follow;
mod fourier;
mod ghosts;
mod gram;
mod images;
mod judge;
mod knowing;
mod largest;
mod load;
mod memory;
mod model;
mod modulate;
mod motion;
mod notch;
mod onset;
mod order;
mod outlier;
mod parameters;
mod periodogram;
mod phase;
mod plan;
mod residual;
mod rows;
mod search;
mod shape;
mod sidebands;
mod sight;
mod small;
mod smear;
mod stand_out;
mod standing;
mod storage;
mod timebase;
mod tone;
mod tones;
mod window;
mod workspace;

pub use config::{Config, ConfigError};
pub use estimator::Estimator;
pub use follow::{Follower, name_harmonics};
pub use memory::window_bytes;
pub use plan::{FrameRatePlan, PlanError};
pub use storage::{EstimatorStorage, StaticCouplings, StaticStorage, Storage};
pub use tones::Tones;
pub use window::{FrameMark, SampleBuffer, SlotCoupling, WindowMark};
pub use workspace::Workspace;

pub(crate) use window::{follow_spread, pack_weight, skew_of};
