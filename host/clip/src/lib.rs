//! Videos in: any video file and standard input as frames of lines.
//!
//! [`CameraOptions`] say what is known of the camera; [`Feed::open`] checks them against the file and starts reading;
//! [`Feed::next_frame`] delivers [`Frame`]s, and a frame hands out the core's lines. Y4M is read by this
//! crate itself ([`y4m`]); every other video goes through the program ffmpeg ([`ffmpeg`]). What the clip
//! knows that its reports must say, such as times that were rounded, is in [`Camera::warnings`].

mod bytes;
mod calibration;
mod camera;
mod clock;
mod decoded;
mod error;
mod feed;
pub mod ffmpeg;
mod frame;
mod frame_read;
pub mod grid;
mod header;
mod mapped;
mod option_error;
mod options;
mod part;
pub mod picture;
mod pixel_format;
#[cfg(target_os = "linux")]
mod populate;
pub mod pts;
mod recording;
pub mod ring;
mod source;
mod window;
pub mod y4m;

pub use camera::Camera;
pub use clock::{Clock, Stamped, Times};
pub use error::{ClipError, InputError};
pub use feed::Feed;
pub use frame::Frame;
pub use header::{FRAME_RATES_HZ, Header, HeaderError};
pub use option_error::OptionError;
pub use options::CameraOptions;
pub use part::{Rect, Roi, Turn};
pub use pixel_format::PixelFormat;
pub use recording::About;
pub use source::Coding;
