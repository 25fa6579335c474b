//! The device's page: what a board or a recording says, in a browser.
//!
//! - [`live`]: what is shown; whoever measures hands it over ([`reports`], [`frames`], [`motion`]) and never waits;
//! - [`control`]: what can be changed, by whom ([`password`]);
//! - [`site`]: which address gives what ([`picture`], `shapes`, [`advice`], [`clip`], [`csv`], [`metrics`], [`state`]);
//! - [`still`]: the page as one file to hand on;
//! - [`server`]: connections, requests and answers ([`http`]), and who is let in ([`guard`]).
//!
//! ```
//! use std::sync::Arc;
//! use rowtone_page::live::Live;
//!
//! let live = Arc::new(Live::default());
//! assert!(live.reports.last().is_none());
//! live.report(&rowtone_report::example(None), rowtone_report::json::report(&rowtone_report::example(None)));
//! assert!(live.reports.last().is_some_and(|entry| entry.json.starts_with("{\"seq\":3")));
//! ```
#![deny(unsafe_code)]

pub mod advice;
pub mod clip;
pub mod control;
pub mod csv;
mod events;
pub mod frames;
pub mod guard;
pub mod http;
pub mod live;
pub mod metrics;
pub mod motion;
pub mod password;
pub mod picture;
pub mod reports;
pub mod server;
mod shapes;
pub mod site;
pub mod state;
pub mod still;
