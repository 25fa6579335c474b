//! Machines that bend, turn and move in parts, and cameras with faults: from the pictures to the report.
//!
//! Contract: a [`Kind`](case::Kind) draws a [`Recording`](case::Recording) with its truth from a seed;
//! [`Score`](score::Score) measures recordings as `rowtone analyze` does and counts what is right.

pub mod case;
pub mod score;
