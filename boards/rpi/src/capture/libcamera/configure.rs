//! Which mode and format to ask for, and the controls that keep a picture as it is.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::mpsc::sync_channel;

use libcamera::camera::{Camera, CameraConfiguration};
use libcamera::control::{ControlEntry, ControlList};
use libcamera::controls::{
    AeEnable, AfMode, AnalogueGain, AwbEnable, ExposureTime, FrameDurationLimits, LensPosition,
};
use libcamera::geometry::Size;
use libcamera::pixel_format::PixelFormat;
use libcamera::stream::StreamRole;
use libcamera::utils::UniquePtr;

use super::buffers::{self, BUFFERS};
use super::opened::{Manager, Opened, refused};
use super::running::Capture;
use crate::capture::{CameraError, Facts, Shape, format, v4l2};
use crate::config::{Config, StreamWish};
use crate::mode::{Needs, Offer, choose};
use crate::sensor;

/// The streams' role, and the modes that the camera offers there.
pub(super) fn offers(camera: &Camera<'_>, wish: StreamWish) -> (StreamRole, Vec<Offer>) {
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
    let known = sensor::lookup(id, width, height).map(|m| (m, m.line_time_s(None).0));
    Some(Offer {
        width,
        height,
        line_time_s: known.map(|(_, line_time_s)| line_time_s),
        max_fps: known.map(|(m, line_time_s)| m.max_fps(line_time_s)),
    })
}

impl Opened {
    pub(super) fn new(found: &Camera<'static>, config: &Config) -> Result<Self, CameraError> {
        let wish = &config.camera;
        let (role, offers) = offers(found, wish.stream);
        let choice = choose(&offers, wish.mode, &Needs::of(config))
            .map_err(|e| CameraError::Refused(e.to_string()))?;
        let mut camera = found
            .acquire()
            .map_err(refused("it is in use by another program"))?;
        let none = || CameraError::Refused("it offers no such stream".to_owned());
        let mut configuration = camera.generate_configuration(&[role]).ok_or_else(none)?;
        ask(&mut configuration, &choice.offer).ok_or_else(none)?;
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
        let shortest_ns = shortest_frame_ns(&camera);
        Ok(Self {
            stream: set.stream().ok_or_else(none)?,
            frame_bytes: set.get_frame_size(),
            facts: Facts {
                frame_period_ns: frame_period_ns(shortest_ns, config, &choice.offer),
                shortest_frame_s: shortest_ns.map(|ns| ns as f64 * 1e-9),
                line_time: v4l2::line_time_s(&id, size.width),
                id,
                shape,
                reasons: choice.reasons,
            },
            camera,
            format: name,
        })
    }

    /// Starts it; `works` is set when the first frame comes.
    pub(super) fn start(
        mut self,
        config: &Config,
        manager: Manager,
        works: Rc<Cell<bool>>,
    ) -> Result<Capture, CameraError> {
        let mut requests = buffers::requests(&mut self)?;
        // Room for all of them: libcamera's thread never waits here.
        let (completed, queue) = sync_channel(requests.len());
        self.camera.on_request_completed(move |request| {
            let _ = completed.try_send(request);
        });
        let controls = controls(&self.camera, config, self.facts.frame_period_ns);
        let mut capture = Capture::new(self.camera, queue, self.stream, self.facts, works, manager);
        capture.start(&controls, &mut requests)?;
        Ok(capture)
    }
}

/// Asks for the chosen mode, in the best format that it comes in.
fn ask(configuration: &mut CameraConfiguration, mode: &Offer) -> Option<()> {
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

/// The shortest frame of the mode that is set up, ns, as the camera says.
fn shortest_frame_ns(camera: &Camera<'_>) -> Option<i64> {
    let limits = camera.controls().find(FrameDurationLimits::ID).ok()?;
    let us = i64::try_from(limits.min()).ok()?;
    Some(us.saturating_mul(1000)).filter(|&ns| ns > 0)
}

/// What the frames' period will be: as wished, not shorter than the camera can.
fn frame_period_ns(shortest_ns: Option<i64>, config: &Config, mode: &Offer) -> Option<i64> {
    if let Some(replay) = config.camera.replay {
        return Some(replay.frame_period_ns);
    }
    let wished = config.camera.frame_rate_hz.map(|hz| (1e9 / hz) as i64);
    let shortest = shortest_ns.or(mode.max_fps.map(|fps| (1e9 / fps) as i64));
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
) -> UniquePtr<ControlList> {
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
    if let Some(dioptres) = config.camera.focus_dioptres {
        set!(AfMode, AfMode::Manual);
        set!(LensPosition, LensPosition(dioptres));
    }
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
