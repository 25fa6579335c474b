//! Videos in: Y4M files and standard input as frames of lines, with the camera options that every
//! command shares.
//!
//! [`CameraArgs`] are the options; [`Feed::open`] checks them against the file and starts reading;
//! [`Feed::next_frame`] delivers [`Frame`]s, and a frame hands out the core's lines.

mod bytes;
mod calibration;
mod clock;
mod feed;
mod frame;
mod header;
mod mapped;
mod options;
mod part;
mod pixel_format;
#[cfg(target_os = "linux")]
mod populate;
pub mod pts;
pub mod ring;
pub mod y4m;

pub use clock::{Clock, Times};
pub use feed::Feed;
pub use frame::Frame;
pub use header::Header;
pub use options::{Camera, CameraArgs};
pub use part::{Rect, Roi, Turn};
pub use pixel_format::PixelFormat;
