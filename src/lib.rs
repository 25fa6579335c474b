//! Vibration from the rows of a rolling-shutter camera: *lines go in, peaks come out*.
//!
//! A rolling-shutter sensor exposes its rows one after the other, so a camera of 60 frames a second looks
//! at a moving surface tens of thousands of times a second. This crate finds how far each row is shifted
//! against its reference and which tones the motion is made of. It is `no_std`, never allocates, and knows
//! no camera, no serial port, no file and no clock: lines come in with their times, bytes go out.
//!
//! Data moves one way, and each folder is one stage of it, in this order. [`pipeline`] is the one way in: it joins the
//! stages, decides what a report warns of, and counts what is lost.
//!
//! ```text
//! camera::Line ─▶ tracker ─▶ timeline ─▶ spectrum ─▶ report::Report ─▶ wire ─▶ bytes ─▶ link
//!                  ▲   ▲      rows to     tones and                    text, binary,
//!           reference  kernel samples     their shapes                 Modbus
//! ```
//!
//! - [`pipeline`]: the line side, the report side, and both in one for one thread.
//! - [`camera`]: [`camera::Line`], a row with its time; [`camera::Timing`] (line time, exposure, rows); raw formats.
//! - [`kernel`]: the inner product for each processor, the only unsafe code.
//! - [`mod@reference`]: what a row looks like at rest, from which the coefficients of its inner product are made.
//! - [`tracker`]: learns the reference, finds each line's displacement, knows when it is lost.
//! - [`timeline`]: displacements of rows become samples in time, with weights.
//! - [`spectrum`]: the tones in a window of samples, with their uncertainty, by joint least squares.
//! - [`shape`]: beside the pipeline, what a known tone does in every tile of the picture.
//! - [`report`]: what is said of a window, in which units.
//! - [`alarm`]: beside the pipeline, from reports to warning and trip.
//! - [`wire`]: a report as bytes and back.
//! - [`link`]: a board's end of the serial line: settings, the outbox, the Modbus server.
//!
//! Buffers are lent by the caller, configuration is plain data that is checked once, and no input makes the core
//! panic. The line side never waits: what is late is dropped, counted and said.
//!
//! # Example
//!
//! A surface stands in front of a camera of 50 frames a second and swings at 7.3 Hz. Its rows go in; a report comes out,
//! and the sentence that a board sends of it:
//!
//! ```
//! use rowtone::camera::{Line, Pixels, Timing};
//! use rowtone::pipeline::Pipeline;
//! use rowtone::timeline::Group;
//! use rowtone::wire::{Message, text};
//! use rowtone::{spectrum, tracker};
//!
//! const WIDTH: usize = 64;
//! const ROWS: usize = 16;
//! let timing = Timing::new(1_000_000_000, 0, ROWS as u16)?; // 1 ms from row to row
//! let group = Group::new(timing, 2)?; // two rows make a sample
//! // The caller decides where memory lives: a static on a microcontroller, a heap on a desktop.
//! let mut picture = tracker::StaticStorage::<{ WIDTH * ROWS }, ROWS, WIDTH>::new();
//! let mut windows = Box::new(spectrum::StaticStorage::<1024, 64, 8, 4096, 9>::new());
//! let mut pipeline = Pipeline::new(
//!     tracker::Config::new(timing, WIDTH as u16),
//!     group,
//!     spectrum::Config::default(), // windows of a second, twice a second
//!     picture.lend(),
//!     windows.lend(),
//! )?;
//! let swing_px = |ns: i64| 0.2 * (ns as f32 * 1e-9 * 7.3 * core::f32::consts::TAU).sin();
//! let mut report = None;
//! for frame in 0..150 {
//!     for row in 0..ROWS as u16 {
//!         let start_ns = i64::from(frame) * 20_000_000 + timing.start_ns(row);
//!         let pixels: [u8; WIDTH] = core::array::from_fn(|x| {
//!             let phase = (x as f32 - swing_px(start_ns)) * 0.6;
//!             (128.0 + 60.0 * phase.sin() + 30.0 * (1.7 * phase).cos()).round() as u8
//!         });
//!         let line = Line { frame, row, start_ns, pixels: Pixels::U8(&pixels) };
//!         report = pipeline.push(&line).or(report);
//!     }
//! }
//! let report = report.expect("a second of frames");
//! assert!((report.peaks[0].hz - 7.3).abs() < 0.05);
//! let mut sentence = [0; text::MAX_LINE];
//! let sentence = text::encode_to_slice(&Message::Report { session: 1, report }, &mut sentence)?;
//! assert!(sentence.starts_with(b"$RTRPT,1,")); // session 1; the peak stands as 7.3…/…
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![no_std]
#![deny(unsafe_code)]

pub mod alarm;
pub mod camera;
pub mod kernel;
pub mod link;
mod math;
pub mod pipeline;
pub mod reference;
pub mod report;
pub mod shape;
pub mod spectrum;
pub mod timeline;
pub mod tracker;
pub mod wire;
