//! Frames from libcamera, read where the camera wrote them.
//!
//! - this file: finds cameras, opens one, starts libcamera anew where that is the last hope;
//! - [`configure`]: which mode and format, and the controls that keep a picture as it is;
//! - [`opened`]: a camera that is set up;
//! - [`buffers`]: where frames are written to;
//! - [`running`]: the frames themselves.
//!
//! libcamera allows one manager a process at a time (a second one aborts the process), so there is one [`Cameras`],
//! and only that starts another, after the first has gone. Starting the *same* manager object again is no use: its
//! `start` returns before the cameras are there (libcamera 0.7.2, camera_manager.cpp: `initialized_` stays set).

mod buffers;
mod configure;
mod opened;
mod running;

use std::cell::Cell;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};

use libcamera::camera::Camera;
use libcamera::camera_manager::CameraManager;

use self::opened::{Manager, Opened, refused};
use super::{CameraError, Source};
use crate::config::Config;
use crate::mode::Offer;

/// A [`Cameras`] exists.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// The cameras of this machine.
pub struct Cameras {
    /// `None` after a start that failed.
    manager: Option<Manager>,
    /// The last camera opened gave frames, or none was opened yet.
    works: Rc<Cell<bool>>,
}

impl Cameras {
    /// Starts libcamera.
    ///
    /// # Errors
    /// [`CameraError::Refused`] when it does not start, or while there is another one.
    pub fn new() -> Result<Self, CameraError> {
        if TAKEN.swap(true, Ordering::AcqRel) {
            return Err(CameraError::Refused(
                "libcamera is in use by this program already".to_owned(),
            ));
        }
        let mut cameras = Self {
            manager: None,
            works: Rc::new(Cell::new(true)),
        };
        cameras.restart()?;
        Ok(cameras)
    }

    /// Ends libcamera and starts it anew, so that it looks for cameras from the beginning.
    ///
    /// # Errors
    /// [`CameraError::Refused`] while a camera is open, or when it does not start.
    pub fn restart(&mut self) -> Result<(), CameraError> {
        if let Some(manager) = self.manager.take() {
            // Two at once abort the process.
            if let Err(shared) = Rc::try_unwrap(manager) {
                self.manager = Some(shared);
                return Err(CameraError::Refused(
                    "libcamera cannot be started anew while a camera is open".to_owned(),
                ));
            }
        }
        let manager = CameraManager::new().map_err(refused("libcamera does not start"))?;
        self.manager = Some(Rc::new(manager));
        Ok(())
    }

    /// Their names.
    pub fn names(&self) -> Vec<String> {
        let Some(manager) = &self.manager else {
            return Vec::new();
        };
        let cameras = manager.cameras();
        (0..cameras.len())
            .filter_map(|i| cameras.get(i).map(|c| c.id().to_owned()))
            .collect()
    }

    /// The modes of the camera that would be opened.
    ///
    /// # Errors
    /// As [`Cameras::open`].
    pub fn offers(&self, config: &Config) -> Result<Vec<Offer>, CameraError> {
        let (camera, _) = self.find(config.camera.id.as_deref())?;
        Ok(configure::offers(&camera, config.camera.stream).1)
    }

    fn find(&self, wanted: Option<&str>) -> Result<(Camera<'static>, Manager), CameraError> {
        let manager = self.manager.as_ref();
        let cameras = manager.map(|manager| manager.cameras());
        cameras
            .iter()
            .flat_map(|cameras| (0..cameras.len()).filter_map(|i| cameras.get(i)))
            .find(|camera| wanted.is_none_or(|part| camera.id().contains(part)))
            .zip(manager.cloned())
            .ok_or_else(|| CameraError::Missing {
                wanted: wanted.map(str::to_owned),
                found: self.names(),
            })
    }

    /// Opens, sets up and starts a camera. libcamera itself sees cameras come and go; it is started anew only after
    /// a camera that was there could not be opened, or gave no frame.
    ///
    /// # Errors
    /// [`CameraError`] when there is none, or it cannot be used as configured.
    pub fn open(&mut self, config: &Config) -> Result<Box<dyn Source>, CameraError> {
        if self.manager.is_none() || !self.works.get() {
            self.restart()?;
            self.works = Rc::new(Cell::new(true));
        }
        let (camera, manager) = self.find(config.camera.id.as_deref())?;
        // Until the first frame says otherwise.
        self.works.set(false);
        let capture = Opened::new(&camera, config)?.start(config, manager, self.works.clone())?;
        Ok(Box::new(capture))
    }
}

impl Drop for Cameras {
    fn drop(&mut self) {
        // A camera that is still open keeps libcamera running, and another one must not be started beside it.
        let ended = self
            .manager
            .take()
            .is_none_or(|m| Rc::try_unwrap(m).is_ok());
        if ended {
            TAKEN.store(false, Ordering::Release);
        }
    }
}
