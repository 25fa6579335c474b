//! Any video file, through the programs ffprobe and ffmpeg.
//!
//! [`probe()`] asks ffprobe what the file holds without decoding it; [`Video`] starts ffmpeg and reads
//! the luma of every picture once, in order, with its time and type. Nothing is stretched, dithered,
//! turned, repeated or dropped on the way:
//!
//! - the luma plane is cut out of the decoder's own picture (`extractplanes=y`), so values are the
//!   file's, of 8 to 16 bits, limited or full range; RGB has no luma plane and is turned into full-range
//!   grey;
//! - `-noautorotate`: the stored rows are the sensor's, whatever the file says of display;
//! - `-fps_mode passthrough` and `-copyts`: one picture out for each one in, at the file's own times;
//! - `-autoscale 0`: a picture whose size differs is not scaled to fit but ends the reading;
//! - times and types come from the filter `showinfo` on the same decoder's standard error, so that they
//!   cannot get out of step with the pictures.
//!
//! Only local files are read (`-protocol_whitelist file`), also where a playlist names others.

mod decoder;
mod error;
mod luma;
pub mod probe;
mod programs;
mod ratio;
pub mod showinfo;
mod video;

pub use error::Error;
pub use luma::Luma;
pub use probe::{Probe, probe};
pub use ratio::Ratio;
pub use showinfo::{FrameKind, Shown};
pub use video::Video;
