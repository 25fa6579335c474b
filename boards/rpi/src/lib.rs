//! A Raspberry Pi with a camera: lines by libcamera in, peaks by UART out.
//!
//! The core does the measuring; this package brings it its lines and takes its reports away:
//!
//! ```text
//! capture ──▶ clock ──▶ lines ──▶ (one window) ──▶ session's spectrum thread ──▶ (queue) ──▶ uart
//! libcamera   lost,     tracker,                   reports                                 link: wires,
//!             late      binner                                                             settings
//! ```
//!
//! - [`config`]: the file; [`mode`] and [`sensor`]: which sensor mode, and why; [`setup`]: all of it joined;
//! - [`capture`]: frames, lent where the camera wrote them; [`clock`]: which count, and when they began;
//! - [`lines`]: the line path; [`session`]: it and the spectrum, from opening a camera to its end;
//! - [`uart`]: the output thread; [`store`]: settings kept in a file;
//! - [`page`]: what the page shows, and settings changed on it;
//! - [`run`]: the service round all that; [`doctor`]: looks at every part and says what to do;
//! - [`journal`], [`notify`], [`system`], [`backoff`], [`memory`]: small helpers.
//!
//! Everything but [`capture`]'s libcamera part (feature `libcamera`) builds and is tested anywhere.

pub mod alarms;
pub mod alive;
pub mod backoff;
pub mod capture;
pub mod clock;
pub mod config;
pub mod doctor;
pub mod gpio;
pub mod journal;
pub mod lines;
pub mod memory;
pub mod mode;
pub mod notify;
pub mod page;
pub mod run;
pub mod sensor;
pub mod session;
pub mod setup;
pub mod shared;
pub mod store;
pub mod system;
pub mod trend;
pub mod uart;
