//! A camera that is set up, and what all files about libcamera need.

use std::io;
use std::rc::Rc;

use libcamera::camera::ActiveCamera;
use libcamera::camera_manager::CameraManager;
use libcamera::stream::Stream;

use crate::capture::{CameraError, Facts};

/// Keeps libcamera going; the last one to go stops it.
pub(super) type Manager = Rc<CameraManager>;

/// A camera that is set up and not started.
pub(super) struct Opened {
    pub(super) camera: ActiveCamera<'static>,
    pub(super) stream: Stream,
    pub(super) facts: Facts,
    /// Bytes of a frame, all planes.
    pub(super) frame_bytes: u32,
    /// libcamera's name of the pixel format.
    pub(super) format: String,
}

/// Makes an error of the operating system one of the camera: what it refused, and why.
pub(super) fn refused(what: &str) -> impl Fn(io::Error) -> CameraError + '_ {
    move |e| CameraError::Refused(format!("{what}: {e}"))
}
