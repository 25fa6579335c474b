//! Frames from libcamera, read where the camera wrote them.
//!
//! As many requests as there are buffers go round: libcamera completes one on a thread of its own and puts it into a
//! queue (which can never hold more than those), [`Source::next`] lends its bytes and gives it back. When all
//! of them wait here the camera has nowhere to write and drops frames, which shows as a gap.
//!
//! On a Raspberry Pi buffers come from libcamera's allocator. Where there is no dma-heap they are made of ordinary
//! memory. libcamera allows one [`Cameras`] a process.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use libcamera::camera::{ActiveCamera, Camera, CameraConfiguration};
use libcamera::camera_manager::CameraManager;
use libcamera::control::ControlList;
use libcamera::controls::{
    AeEnable, AnalogueGain, AwbEnable, ExposureTime, FrameDurationLimits, SensorTimestamp,
};
use libcamera::framebuffer::{
    AsFrameBuffer, FrameBufferPlane, FrameMetadataStatus, OwnedFrameBuffer,
};
use libcamera::framebuffer_allocator::{FrameBuffer, FrameBufferAllocator};
use libcamera::framebuffer_map::MemoryMappedFrameBuffer;
use libcamera::geometry::Size;
use libcamera::pixel_format::PixelFormat;
use libcamera::request::{Request, RequestStatus, ReuseFlag};
use libcamera::stream::{Stream, StreamRole};

use super::{CameraError, Facts, Frame, Shape, Source, format, v4l2};
use crate::config::{Config, StreamWish};
use crate::mode::{Needs, Offer, choose};
use crate::sensor;
use crate::system::memory_file;

/// Buffers that go round.
const BUFFERS: u32 = 6;

type Allocated = MemoryMappedFrameBuffer<FrameBuffer>;
type Owned = MemoryMappedFrameBuffer<OwnedFrameBuffer>;

fn refused(what: &str) -> impl Fn(io::Error) -> CameraError + '_ {
    move |e| CameraError::Refused(format!("{what}: {e}"))
}

/// The cameras of this machine.
pub struct Cameras {
    manager: Rc<RefCell<CameraManager>>,
    /// The last opening failed although the camera was there.
    stuck: bool,
}

impl Cameras {
    /// Starts libcamera. Once a process.
    ///
    /// # Errors
    /// [`CameraError::Refused`] when it does not start.
    pub fn new() -> Result<Self, CameraError> {
        let manager = CameraManager::new().map_err(refused("libcamera does not start"))?;
        Ok(Self {
            manager: Rc::new(RefCell::new(manager)),
            stuck: false,
        })
    }

    /// Their names.
    pub fn names(&self) -> Vec<String> {
        let cameras = self.manager.borrow().cameras();
        (0..cameras.len())
            .filter_map(|i| cameras.get(i).map(|c| c.id().to_owned()))
            .collect()
    }

    /// The modes of the camera that would be opened.
    ///
    /// # Errors
    /// As [`Cameras::open`].
    pub fn offers(&self, config: &Config) -> Result<Vec<Offer>, CameraError> {
        let camera = self.find(config.camera.id.as_deref())?;
        Ok(offers(&camera, config.camera.stream).1)
    }

    fn find(&self, wanted: Option<&str>) -> Result<Camera<'static>, CameraError> {
        let cameras = self.manager.borrow().cameras();
        (0..cameras.len())
            .filter_map(|i| cameras.get(i))
            .find(|camera| wanted.is_none_or(|part| camera.id().contains(part)))
            .ok_or_else(|| CameraError::Missing {
                wanted: wanted.map(str::to_owned),
                found: self.names(),
            })
    }

    /// Opens, sets up and starts a camera. libcamera itself sees cameras come and go; it is restarted only where a
    /// camera that is there could not be opened the last time.
    ///
    /// # Errors
    /// [`CameraError`] when there is none, or it cannot be used as configured.
    pub fn open(&mut self, config: &Config) -> Result<Box<dyn Source>, CameraError> {
        if std::mem::take(&mut self.stuck) {
            let mut manager = self.manager.borrow_mut();
            let restarted = manager.restart();
            restarted.map_err(refused("libcamera does not restart"))?;
        }
        let camera = self.find(config.camera.id.as_deref())?;
        let opened = Opened::new(&camera, config);
        let opened = opened.and_then(|opened| opened.start(config, self.manager.clone()));
        self.stuck = opened.is_err();
        Ok(Box::new(opened?))
    }
}

/// The streams' role, and the modes that the camera offers there.
fn offers(camera: &Camera<'_>, wish: StreamWish) -> (StreamRole, Vec<Offer>) {
    let list = |role| {
        let configuration = camera.generate_configuration(&[role])?;
        let stream = configuration.get(0)?;
        let formats = stream.formats();
        let mut sizes: Vec<Size> = formats
            .pixel_formats()
            .into_iter()
            .filter(|f| format::read_as(&f.to_string()).is_some())
            .flat_map(|f| formats.sizes(f))
            .collect();
        sizes.sort_by_key(|s| (s.width, s.height));
        sizes.dedup_by_key(|s| (s.width, s.height));
        if sizes.is_empty() {
            sizes.push(stream.get_size());
        }
        let offers: Vec<_> = sizes
            .iter()
            .filter_map(|s| offer(camera.id(), *s))
            .collect();
        (!offers.is_empty()).then_some(offers)
    };
    if wish == StreamWish::Raw
        && let Some(offers) = list(StreamRole::Raw)
    {
        return (StreamRole::Raw, offers);
    }
    let role = StreamRole::VideoRecording;
    (role, list(role).unwrap_or_default())
}

fn offer(id: &str, size: Size) -> Option<Offer> {
    let (width, height) = (size.width.try_into().ok()?, size.height.try_into().ok()?);
    let known = sensor::lookup(id, width, height);
    Some(Offer {
        width,
        height,
        line_time_s: known.map(|m| f64::from(m.line_time_ps) * 1e-12),
        max_fps: known.map(|m| m.max_fps.into()),
    })
}

/// A camera that is set up and not started.
struct Opened {
    camera: ActiveCamera<'static>,
    stream: Stream,
    facts: Facts,
    frame_bytes: u32,
    name: String,
}

impl Opened {
    fn new(found: &Camera<'static>, config: &Config) -> Result<Self, CameraError> {
        let wish = &config.camera;
        let (role, offers) = offers(found, wish.stream);
        let reach = config.settings.roi.map_or((0, 0), |r| {
            (r.x.saturating_add(r.width), r.y.saturating_add(r.height))
        });
        let needs = Needs {
            highest_hz: config.highest_hz().into(),
            reach,
        };
        let choice =
            choose(&offers, wish.mode, &needs).map_err(|e| CameraError::Refused(e.to_string()))?;
        let mut camera = found
            .acquire()
            .map_err(refused("it is in use by another program"))?;
        let none = || CameraError::Refused("it offers no such stream".to_owned());
        let mut configuration = camera.generate_configuration(&[role]).ok_or_else(none)?;
        request(&mut configuration, &choice.offer).ok_or_else(none)?;
        if configuration.validate().is_invalid() {
            return Err(CameraError::Refused(
                "it accepts no setting of ours".to_owned(),
            ));
        }
        camera
            .configure(&mut configuration)
            .map_err(refused("it cannot be set up"))?;
        let set = configuration.get(0).ok_or_else(none)?;
        let name = set.get_pixel_format().to_string();
        let Some((format, bayer)) = format::read_as(&name) else {
            return Err(CameraError::Refused(format!(
                "pictures come as {name}, which is not read"
            )));
        };
        let size = set.get_size();
        let too_large = |_| CameraError::Refused(format!("pictures of {size:?} are too large"));
        let shape = Shape {
            width: size.width.try_into().map_err(too_large)?,
            height: size.height.try_into().map_err(too_large)?,
            stride: set.get_stride() as usize,
            format,
            bayer,
        };
        let id = camera.id().to_owned();
        let line_time = v4l2::line_time_s(&id, size.width).map(|s| (s, "the sensor's driver"));
        Ok(Self {
            stream: set.stream().ok_or_else(none)?,
            frame_bytes: set.get_frame_size(),
            facts: Facts {
                frame_period_ns: frame_period_ns(&camera, config, &choice.offer),
                id,
                shape,
                line_time,
                reasons: choice.reasons,
            },
            camera,
            name,
        })
    }

    fn start(
        mut self,
        config: &Config,
        manager: Rc<RefCell<CameraManager>>,
    ) -> Result<Capture, CameraError> {
        let mut requests = self.requests()?;
        let (completed, queue) = channel();
        // Bounded all the same: no more requests than buffers exist.
        self.camera.on_request_completed(move |request| {
            let _ = completed.send(request);
        });
        let gone = Arc::new(AtomicBool::new(false));
        let flag = gone.clone();
        self.camera
            .on_disconnected(move || flag.store(true, Ordering::Relaxed));
        let controls = controls(&self.camera, config, self.facts.frame_period_ns);
        let started = self.camera.start(Some(&controls));
        started.map_err(refused("it does not start"))?;
        for request in requests.drain(..) {
            let queued = self.camera.queue_request(request);
            queued.map_err(|(_, e)| refused("it takes no request")(e))?;
        }
        Ok(Capture {
            camera: self.camera,
            queue,
            stream: self.stream,
            facts: self.facts,
            gone,
            wanted_period_ns: None,
            _manager: manager,
        })
    }

    /// One request a buffer.
    fn requests(&mut self) -> Result<Vec<Request>, CameraError> {
        let mut allocator = FrameBufferAllocator::new(&self.camera);
        let mut requests = Vec::new();
        match allocator.alloc(&self.stream) {
            Ok(buffers) => {
                for buffer in buffers {
                    requests.push(self.request(buffer)?);
                }
            }
            // No dma-heap: ordinary memory, which the virtual pipeline takes.
            Err(_) => {
                for _ in 0..BUFFERS {
                    let buffer = self.own_buffer().map_err(refused("no memory for frames"))?;
                    requests.push(self.request(buffer)?);
                }
            }
        }
        Ok(requests)
    }

    fn request<B: AsFrameBuffer + 'static>(&mut self, buffer: B) -> Result<Request, CameraError> {
        let mapped = MemoryMappedFrameBuffer::new(buffer)
            .map_err(|e| CameraError::Refused(format!("a buffer cannot be mapped: {e}")))?;
        let mut request = self
            .camera
            .create_request(None)
            .ok_or_else(|| CameraError::Refused("it makes no requests".to_owned()))?;
        let added = request.add_buffer(&self.stream, mapped);
        added.map_err(refused("it takes no buffer"))?;
        Ok(request)
    }

    fn own_buffer(&self) -> io::Result<OwnedFrameBuffer> {
        let luma = (self.facts.shape.stride * usize::from(self.facts.shape.height)) as u32;
        let file = memory_file(self.frame_bytes as usize)?;
        let mut planes = Vec::new();
        // Semi-planar formats have their colours in a second plane.
        if self.name.starts_with("NV") && self.frame_bytes > luma {
            planes.push(FrameBufferPlane {
                fd: file.try_clone()?,
                offset: 0,
                length: luma,
            });
            planes.push(FrameBufferPlane {
                fd: file,
                offset: luma,
                length: self.frame_bytes - luma,
            });
        } else {
            planes.push(FrameBufferPlane {
                fd: file,
                offset: 0,
                length: self.frame_bytes,
            });
        }
        OwnedFrameBuffer::new(planes, None)
    }
}

/// Asks for the chosen mode, in the best format that it comes in.
fn request(configuration: &mut CameraConfiguration, mode: &Offer) -> Option<()> {
    let size = Size {
        width: mode.width.into(),
        height: mode.height.into(),
    };
    let mut stream = configuration.get_mut(0)?;
    let formats = stream.formats();
    let known: Vec<PixelFormat> = formats.pixel_formats().into_iter().collect();
    let names: Vec<String> = known
        .iter()
        .filter(|f| {
            let mut sizes = formats.sizes(**f).into_iter();
            sizes.any(|s| (s.width, s.height) == (size.width, size.height))
        })
        .map(ToString::to_string)
        .collect();
    let best = format::best(names.iter().map(String::as_str));
    let best = best.and_then(|best| known.iter().find(|f| f.to_string() == best).copied());
    if let Some(best) = best {
        stream.set_pixel_format(best);
    }
    stream.set_size(size);
    stream.set_buffer_count(BUFFERS);
    Some(())
}

/// What the frames' period will be: as wished, not shorter than the camera can.
fn frame_period_ns(camera: &Camera<'_>, config: &Config, mode: &Offer) -> Option<i64> {
    if let Some(replay) = config.camera.replay {
        return Some(replay.frame_period_ns);
    }
    let wished = config.camera.frame_rate_hz.map(|hz| (1e9 / hz) as i64);
    let limits = camera
        .controls()
        .find(<FrameDurationLimits as libcamera::control::ControlEntry>::ID);
    let shortest = limits
        .ok()
        .and_then(|info| i64::try_from(info.min()).ok())
        .map(|us| us * 1000)
        .or(mode.max_fps.map(|fps| (1e9 / fps) as i64))
        .filter(|&ns| ns > 0);
    match (wished, shortest) {
        (Some(wished), Some(shortest)) => Some(wished.max(shortest)),
        (wished, shortest) => wished.or(shortest),
    }
}

/// Everything that would change the picture by itself off; what this camera does not know is left out.
fn controls(
    camera: &Camera<'_>,
    config: &Config,
    period_ns: Option<i64>,
) -> libcamera::utils::UniquePtr<ControlList> {
    use libcamera::control::ControlEntry;
    let known = camera.controls();
    let mut list = ControlList::new();
    macro_rules! set {
        ($kind:ty, $value:expr) => {
            if known.count(<$kind>::ID) > 0 {
                let _ = list.set($value);
            }
        };
    }
    set!(AeEnable, AeEnable(false));
    set!(AwbEnable, AwbEnable(false));
    set!(ExposureTime, ExposureTime(config.exposure_us() as i32));
    set!(AnalogueGain, AnalogueGain(config.camera.gain));
    if let Some(us) = period_ns.map(|ns| ns / 1000) {
        set!(FrameDurationLimits, FrameDurationLimits([us, us]));
    }
    // draft::NoiseReductionMode, off; raw rows have none anyway.
    if let Some(id) = noise_reduction(camera) {
        let _ = list.set_raw(id, 0i32.into());
    }
    list
}

/// The number of the control `NoiseReductionMode`, where the camera has it.
fn noise_reduction(camera: &Camera<'_>) -> Option<u32> {
    camera.controls().into_iter().map(|(id, _)| id).find(|&id| {
        libcamera::controls::ControlId::from_id(id)
            .is_some_and(|c| c.name() == "NoiseReductionMode")
    })
}

/// A running camera.
struct Capture {
    camera: ActiveCamera<'static>,
    queue: Receiver<Request>,
    stream: Stream,
    facts: Facts,
    gone: Arc<AtomicBool>,
    wanted_period_ns: Option<i64>,
    _manager: Rc<RefCell<CameraManager>>,
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
