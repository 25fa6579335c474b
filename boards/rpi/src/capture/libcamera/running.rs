//! A running camera.
//!
//! As many requests as there are buffers go round: libcamera completes one on a thread of its own and puts it into a
//! queue (which can never hold more than those), [`Source::next`] lends its bytes and gives it back. When all
//! of them wait here the camera has nowhere to write and drops frames, which shows as a gap.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use libcamera::camera::ActiveCamera;
use libcamera::control::ControlList;
use libcamera::controls::{FrameDurationLimits, SensorTimestamp};
use libcamera::framebuffer::{AsFrameBuffer, FrameMetadataStatus};
use libcamera::framebuffer_map::MemoryMappedFrameBuffer;
use libcamera::request::{Request, RequestStatus, ReuseFlag};
use libcamera::stream::Stream;

use super::buffers::{Allocated, Owned};
use super::opened::{Manager, refused};
use crate::capture::{CameraError, Facts, Frame, Source};

/// See the [module](self).
pub(super) struct Capture {
    camera: ActiveCamera<'static>,
    queue: Receiver<Request>,
    stream: Stream,
    facts: Facts,
    gone: Arc<AtomicBool>,
    wanted_period_ns: Option<i64>,
    /// Set by the first frame.
    works: Rc<Cell<bool>>,
    /// Goes last.
    _manager: Manager,
}

impl Capture {
    pub(super) fn new(
        mut camera: ActiveCamera<'static>,
        queue: Receiver<Request>,
        stream: Stream,
        facts: Facts,
        works: Rc<Cell<bool>>,
        manager: Manager,
    ) -> Self {
        let gone = Arc::new(AtomicBool::new(false));
        let flag = gone.clone();
        camera.on_disconnected(move || flag.store(true, Ordering::Relaxed));
        Self {
            camera,
            queue,
            stream,
            facts,
            gone,
            wanted_period_ns: None,
            works,
            _manager: manager,
        }
    }

    pub(super) fn start(
        &mut self,
        controls: &ControlList,
        requests: &mut Vec<Request>,
    ) -> Result<(), CameraError> {
        let started = self.camera.start(Some(controls));
        started.map_err(refused("it does not start"))?;
        for request in requests.drain(..) {
            let queued = self.camera.queue_request(request);
            queued.map_err(|(_, e)| refused("it takes no request")(e))?;
        }
        Ok(())
    }
}

impl Drop for Capture {
    fn drop(&mut self) {
        let _ = self.camera.stop();
        // Requests go before the camera does.
        while self.queue.try_recv().is_ok() {}
    }
}

impl Source for Capture {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn next(
        &mut self,
        patience: Duration,
        take: &mut dyn FnMut(Frame<'_>),
    ) -> Result<(), CameraError> {
        if self.gone.load(Ordering::Relaxed) {
            return Err(CameraError::Gone);
        }
        let mut request = match self.queue.recv_timeout(patience) {
            Ok(request) => request,
            Err(RecvTimeoutError::Timeout) => return Err(CameraError::Silent(patience)),
            Err(RecvTimeoutError::Disconnected) => return Err(CameraError::Gone),
        };
        self.works.set(true);
        if let Some(buffer) = request.buffer::<Allocated>(&self.stream) {
            lend(&request, buffer, take);
        } else if let Some(buffer) = request.buffer::<Owned>(&self.stream) {
            lend(&request, buffer, take);
        }
        request.reuse(ReuseFlag::REUSE_BUFFERS);
        if let Some(us) = self.wanted_period_ns.take().map(|ns| ns / 1000) {
            let _ = request.controls_mut().set(FrameDurationLimits([us, us]));
        }
        self.camera
            .queue_request(request)
            .map_err(|_| CameraError::Gone)
    }

    fn set_frame_period(&mut self, period_ns: i64) {
        self.wanted_period_ns = Some(period_ns);
    }
}

fn lend<B: AsFrameBuffer>(
    request: &Request,
    buffer: &MemoryMappedFrameBuffer<B>,
    take: &mut dyn FnMut(Frame<'_>),
) {
    let metadata = buffer.metadata();
    let status = metadata.as_ref().map(|m| m.status());
    let sequence = metadata
        .as_ref()
        .map_or(request.sequence(), |m| m.sequence());
    let start_ns = request
        .metadata()
        .get::<SensorTimestamp>()
        .map(|t| t.0)
        .ok();
    let start_ns = start_ns.or_else(|| metadata.as_ref().map(|m| m.timestamp() as i64));
    let planes = buffer.data();
    take(Frame {
        sequence,
        start_ns,
        bytes: planes.first().copied().unwrap_or_default(),
        intact: request.status() == RequestStatus::Complete
            && status == Some(FrameMetadataStatus::Success),
    });
}
