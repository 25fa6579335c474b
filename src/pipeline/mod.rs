//! The one way into the core: lines go in, reports come out.
//!
//! ```text
//!             line side                            report side
//! line ──▶ tracker ──▶ binner ──▶ reading ──▶ collector ──▶ reporter ──▶ report
//!          light, tally            (queue)     (ring)        (spectrum)
//! ```
//!
//! Contract: the [`LineSide`] takes every line as it comes and never waits; where a group of rows is complete it gives a
//! [`Reading`]. Readings go to the report side. On one thread that is a [`ReportSide`], or all in one a
//! [`Pipeline`]. To compute on another core or thread, use the report side's halves: a [`Collector`] takes
//! readings, and where its [`Collector::push`] says that a window is complete, [`Collector::hand_over`] copies it
//! into a [`Reporter`], which computes it at leisure. A window that nobody takes before the next push is dropped,
//! counted and said.
//!
//! A window is made of whole frames: those whose first row starts within it.
//!
//! What a window warns of is decided here, once, over all of its frames (`warn.rs`). The line side sends a tally of what became
//! of each frame's rows along with its samples, so that a window knows of its first half as much as of its
//! second, on whichever core it is collected.

mod collector;
mod elsewhere;
mod light;
mod line_side;
mod reading;
mod report_side;
mod reporter;
mod silence;
mod warn;
mod whole;

pub use collector::Collector;
pub use light::Light;
pub use line_side::LineSide;
pub use reading::Reading;
pub use report_side::ReportSide;
pub use reporter::Reporter;
pub use silence::Silence;
pub use whole::{Pipeline, PipelineError};
