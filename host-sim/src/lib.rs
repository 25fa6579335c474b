//! A simulated rolling-shutter camera that looks at a simulated machine.
//!
//! Contract: a [`Config`] is plain data; [`Camera::new`] checks it once and prepares everything
//! that does not depend on time; after that a frame is a function of its number alone, so frames
//! may be rendered in any order or on several threads, and the same configuration gives the same
//! bytes every time. The true displacement is known at any instant ([`Camera::displacement_px`])
//! and as a row of the camera saw it ([`Camera::row_truth`]).
//!
//! What a row goes through, in the order of the physics:
//!
//! 1. [`scene`]: how much light each point of the object reflects, as a periodic strip;
//! 2. [`texture`]: blurred by lens and pixel area, kept eight times finer than the pixels;
//! 3. [`exposure`]: integrated over the row's own exposure interval while the object moves
//!    ([`motion`], and not everywhere alike: [`Mode`]) and the light changes ([`light`]);
//! 4. the sensor's [`Defects`]; [`noise`]: shot noise, read noise, quantisation, saturation.
//!
//! [`schedule`] says when each frame starts, which are lost and which come late; [`crlb`] how well
//! any estimator could know the displacement of a row; [`truth`] writes it all down.
//!
//! ```
//! use host_sim::{Camera, Config, Tone};
//!
//! let mut config = Config::default();
//! config.sensor.cols = 64;
//! config.sensor.rows = 32;
//! config.frames = 3;
//! config.motion.tones.push(Tone { hz: 49.2, amplitude_px: 0.4, phase_rad: 0.3 });
//! let camera = Camera::new(config)?;
//! for frame in camera.frames() {
//!     let line = frame.line(0).expect("the frame has rows");
//!     assert_eq!(line.pixels.len(), 64);
//! }
//! # Ok::<(), host_sim::SimError>(())
//! ```

pub mod camera;
pub mod config;
pub mod crlb;
mod defects;
mod error;
pub mod exposure;
mod field;
mod frame;
pub mod light;
pub mod motion;
pub mod noise;
pub mod parallel;
mod pattern;
mod plane;
pub mod preset;
mod random;
mod rect;
pub mod scene;
pub mod schedule;
mod sound;
mod startup;
pub mod texture;
pub mod truth;
pub mod y4m;

pub use camera::{Camera, RowTruth};
pub use config::{
    Config, Disturbances, Faults, FirstFrame, Hand, Optics, RateChange, Sensor, Shadow,
};
pub use defects::Defects;
pub use error::SimError;
pub use field::{Mode, Shape, Term, Wave};
pub use frame::{Frame, PixelBuffer};
pub use light::{Flicker, Led, Light};
pub use motion::{Chirp, Motion, Step, Tone};
pub use preset::Preset;
pub use rect::Rect;
pub use scene::Scene;
pub use sound::Sound;
pub use truth::Truth;
