//! Vibration from the rows of a rolling-shutter camera: *lines go in, peaks come out*.
//!
//! A rolling-shutter sensor exposes its rows one after the other, so a camera of 60 frames a second looks
//! at a moving surface tens of thousands of times a second. This crate finds how far each row is shifted
//! against its reference and which tones the motion is made of. It is `no_std`, never allocates, and knows
//! no camera, no serial port, no file and no clock: lines come in with their times, bytes go out.
//!
//! Data moves one way; each stage is a module that can be used alone, each arrow a small plain type:
//!
//! ```text
//!  camera::Line ─▶ tracker ─▶ timeline::Displacement ─▶ timeline ─▶ timeline::Sample ─▶ analyzer ─▶ report::Report ─▶ wire ─▶ bytes
//!                  │ ▲                                  combines rows                   │ spectrum
//!        correlates│ │reference, band, noise                                            │ tones by joint least squares
//!                  ▼ │                                                                  ▼
//!                 kernel (the inner product)                                           peaks, tracks, harmonics
//! ```
//!
//! The line path:
//!
//! - [`camera`]: [`camera::Timing`] (line time, exposure, rows) and [`camera::Line`], a row with its time.
//! - [`band`]: the reduced horizontal shearlet band, as the derivative filter that is needed of it.
//! - [`mod@reference`]: from a reference row to the coefficients of its inner product.
//! - [`kernel`]: the inner product, for each processor; the only unsafe code.
//! - [`noise`]: the noise of a pixel, measured while learning.
//! - [`tracker`]: learns the reference, finds each line's shift, knows when it is lost.
//!
//! Beside it, on another core or thread, never waited for:
//!
//! - [`timeline`]: rows become evenly spaced samples with weights, lost frames are counted.
//! - [`spectrum`]: tones from the samples that exist, with their uncertainty; [`analyzer`] windows them.
//! - [`report`]: what is said of a window, in which units.
//! - [`wire`]: a report as bytes and back; [`link`], [`outbox`], [`settings`]: a board's end of the line.
//!
//! # Example
//!
//! A surface with a sinusoidal texture stands in front of a camera of 30 frames a second and swings at
//! 7 Hz; the tracker reads its shift back:
//!
//! ```
//! use rowtone::camera::{Line, Pixels, Timing};
//! use rowtone::tracker::{Config, Outcome, StaticStorage, Tracker};
//!
//! const WIDTH: usize = 64;
//! const ROWS: usize = 8;
//! let timing = Timing::new(30_000_000, 0, ROWS as u16)?; // 30 µs from row to row
//! let mut config = Config::new(timing, WIDTH as u16);
//! config.learn_frames = 8;
//! // The caller decides where memory lives: a static on a microcontroller, a heap on a desktop.
//! let mut storage = StaticStorage::<{ WIDTH * ROWS }, ROWS, WIDTH>::new();
//! let mut tracker = Tracker::new(config, storage.lend())?;
//! let swing = |ns: i64| 0.2 * (core::f32::consts::TAU * 7.0 * ns as f32 * 1e-9).sin();
//! let mut worst: f32 = 0.0;
//! for frame in 0..60 {
//!     for row in 0..ROWS as u16 {
//!         let start_ns = i64::from(frame) * 33_333_333 + timing.start_ns(row);
//!         let pixels: [u8; WIDTH] = core::array::from_fn(|x| {
//!             let phase = (x as f32 - swing(start_ns)) * 0.6;
//!             (128.0 + 80.0 * phase.sin() + 30.0 * (1.7 * phase).cos()).round() as u8
//!         });
//!         let line = Line { frame, row, start_ns, pixels: Pixels::U8(&pixels) };
//!         if let Outcome::Measured(displacement) = tracker.push(&line) {
//!             // Each row's own reference position is unknown; here it is about the middle of the swing.
//!             worst = worst.max((displacement.shift_px - swing(displacement.time_ns)).abs());
//!         }
//!     }
//! }
//! assert!(worst < 0.05, "{worst}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![no_std]
#![deny(unsafe_code)]

pub mod camera;
pub mod kernel;
pub mod link;
mod math;
pub mod pipeline;
pub mod reference;
pub mod report;
pub mod spectrum;
pub mod timeline;
pub mod tracker;
pub mod wire;
