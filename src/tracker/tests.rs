//! A tracker in front of a simple picture: each of its parts must do what it is for. What depends on
//! noise, blur and real sensors is measured by `rowtone sweep lines` and the end-to-end tests.

mod faults;

use super::*;
use crate::camera::RawFormat;
use crate::{camera::Timing, reference::band::MAX_HALF};
extern crate std;
use std::{boxed::Box, vec::Vec};

const WIDTH: usize = 128;
const ROWS: usize = 24;
const LEARN_FRAMES: u16 = 8;
const FRAME_NS: i64 = 20_000_000;

fn timing() -> Timing {
    Timing::new(50_000_000, 400_000, ROWS as u16).unwrap()
}

/// Memory, lent to a tracker once.
struct Memory(Box<StaticStorage<{ WIDTH * ROWS }, ROWS, WIDTH>>);

impl Memory {
    fn new() -> Self {
        Self(Box::default())
    }

    fn tracker(&mut self, stride: u8) -> Tracker<'_> {
        self.tracker_in_steps(stride, u16::MAX)
    }

    /// A tracker that does no more than a microcontroller can in one line time.
    fn hurried(&mut self) -> Tracker<'_> {
        self.tracker_in_steps(1, 4)
    }

    fn tracker_in_steps(&mut self, stride: u8, columns_per_line: u16) -> Tracker<'_> {
        let config = Config {
            stride,
            columns_per_line,
            learn_frames: LEARN_FRAMES,
            ..Config::new(timing(), WIDTH as u16)
        };
        Tracker::new(config, self.0.lend()).unwrap()
    }
}

/// A surface without a period that fits the picture; another one for every `scene`.
fn surface(scene: u8, row: u16, x: f32) -> f32 {
    let at = f32::from(row) * 1.3 + f32::from(scene) * 17.0;
    120.0
        + 35.0 * libm::sinf(0.61 * x + at)
        + 25.0 * libm::sinf(0.37 * x - 2.1 * at)
        + 20.0 * libm::sinf(0.173 * x + 0.7 * at)
}

fn stripes(_: u8, _: u16, x: f32) -> f32 {
    120.0 + 60.0 * libm::sinf(core::f32::consts::TAU / 16.0 * x)
}

/// A camera that adds ±1 of noise, and what it looks at.
struct Camera {
    frame: u32,
    dice: u32,
    scene: u8,
    surface: fn(u8, u16, f32) -> f32,
    /// How its raw lines lie in memory.
    format: RawFormat,
}

impl Camera {
    fn new(surface: fn(u8, u16, f32) -> f32) -> Self {
        Self {
            frame: 0,
            dice: 1,
            scene: 0,
            surface,
            format: RawFormat::Raw8,
        }
    }

    /// Shows the tracker the next frame. `shift`: of the surface at a time in s, px; `change`: what else
    /// happens to a row.
    fn show(
        &mut self,
        tracker: &mut Tracker<'_>,
        shift: impl Fn(f32) -> f32,
        change: impl Fn(u16, &mut [u8; WIDTH]),
    ) -> Vec<Outcome> {
        let frame = self.frame;
        self.frame += 1;
        let outcomes = (0..ROWS as u16).map(|row| {
            let start_ns = i64::from(frame) * FRAME_NS + timing().start_ns(row);
            let at = shift((start_ns + 200_000) as f32 * 1e-9);
            let mut pixels = core::array::from_fn(|x| {
                self.dice = self
                    .dice
                    .wrapping_mul(1_664_525)
                    .wrapping_add(1_013_904_223);
                let noise = (self.dice >> 16) as f32 / 32768.0 - 1.0;
                libm::roundf((self.surface)(self.scene, row, x as f32 - at) + noise) as u8
            });
            change(row, &mut pixels);
            let bytes: Vec<u8> = match self.format {
                RawFormat::Packed10 => pixels
                    .chunks(4)
                    .flat_map(|p| [p[0], p[1], p[2], p[3], 99])
                    .collect(),
                RawFormat::Packed12 => pixels.chunks(2).flat_map(|p| [p[0], p[1], 99]).collect(),
                RawFormat::Raw16 => pixels.iter().flat_map(|&p| [99, p]).collect(),
                _ => pixels.to_vec(),
            };
            tracker.push(&Line {
                frame,
                row,
                start_ns,
                pixels: self.format.upper_line(&bytes, WIDTH, &mut []).unwrap(),
            })
        });
        outcomes.collect()
    }

    /// Both rounds of learning.
    fn teach(&mut self, tracker: &mut Tracker<'_>, shift: impl Fn(f32) -> f32) {
        while self.frame < u32::from(LEARN_FRAMES) * 2 {
            self.show(tracker, &shift, |_, _| ());
        }
    }
}

/// Each row's measured shift less the true one, px; none of the rows may be missing.
fn errors(outcomes: &[Outcome], shift: impl Fn(f32) -> f32) -> Vec<f32> {
    let error = |outcome: &Outcome| match outcome {
        Outcome::Measured(d) => d.shift_px - shift(d.time_ns as f32 * 1e-9),
        other => panic!("{other:?}"),
    };
    outcomes.iter().map(error).collect()
}

fn still(_: f32) -> f32 {
    0.0
}

fn tone(hz: f32, amplitude_px: f32) -> impl Fn(f32) -> f32 {
    move |t| amplitude_px * libm::sinf(core::f32::consts::TAU * hz * t + 0.4)
}

/// Largest change of any row's error from frame to frame, over `frames` frames: each row's own offset,
/// which nobody knows, is the same in all of them.
fn worst_px(camera: &mut Camera, tracker: &mut Tracker<'_>, shift: impl Fn(f32) -> f32) -> f32 {
    let first = errors(&camera.show(tracker, &shift, |_, _| ()), &shift);
    let mut worst = 0.0f32;
    for _ in 0..30 {
        let next = errors(&camera.show(tracker, &shift, |_, _| ()), &shift);
        for (a, b) in first.iter().zip(next) {
            worst = worst.max((a - b).abs());
        }
    }
    worst
}

#[test]
fn learning_puts_the_reference_at_the_middle_of_the_motion() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker(1);
    // The first frame meets the picture at 3 px.
    let swing = |t: f32| 3.0 * libm::cosf(core::f32::consts::TAU * 13.7 * t);
    camera.teach(&mut tracker, swing);
    let errors = errors(&camera.show(&mut tracker, swing, |_, _| ()), swing);
    // Of 8 frames the mean of the motion is not quite 0.
    assert!(errors.iter().all(|e| e.abs() < 1.0), "{errors:?}");
}

#[test]
fn swift_motion_is_followed_row_by_row() {
    for (hz, amplitude_px) in [(7.3, 4.0), (43.7, 4.0), (213.7, 4.0), (11.3, 15.0)] {
        let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
        let mut tracker = memory.tracker(1);
        let swing = tone(hz, amplitude_px);
        camera.teach(&mut tracker, &swing);
        let worst = worst_px(&mut camera, &mut tracker, &swing);
        assert!(worst < 0.15, "{amplitude_px} px at {hz} Hz: {worst} px");
    }
}

#[test]
fn a_stripe_is_not_taken_for_its_neighbour() {
    for hz in [7.3, 33.1, 43.7, 119.3] {
        let (mut memory, mut camera) = (Memory::new(), Camera::new(stripes));
        let mut tracker = memory.tracker(1);
        let swing = tone(hz, 4.0);
        camera.teach(&mut tracker, &swing);
        let worst = worst_px(&mut camera, &mut tracker, &swing);
        assert!(worst < 0.15, "{hz} Hz: {worst} px");
    }
}

#[test]
fn a_jump_is_found_in_the_line_in_which_it_happens() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker(1);
    camera.teach(&mut tracker, still);
    for to_px in [11.0, -23.0, 0.0] {
        let at = move |_: f32| to_px;
        let errors = errors(&camera.show(&mut tracker, at, |_, _| ()), at);
        // What was learned standing still has no margin: what leaves the picture takes coefficients along.
        assert!(errors.iter().all(|e| e.abs() < 1.0), "{to_px}: {errors:?}");
    }
}

#[test]
fn a_hand_is_flagged_and_poisons_nothing() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker(1);
    camera.teach(&mut tracker, still);
    camera.show(&mut tracker, still, |_, _| ());
    let before = tracker.store.buffers().mean.to_vec();
    let hand = |_: u16, pixels: &mut [u8; WIDTH]| pixels[20..80].fill(90);
    for _ in 0..20 {
        let outcomes = camera.show(&mut tracker, still, hand);
        assert!(
            outcomes.iter().all(|o| *o == Outcome::Occluded),
            "{outcomes:?}"
        );
    }
    assert!(tracker.store.buffers().mean == &before[..]);
    // Gone: the very next line counts again.
    let after = errors(&camera.show(&mut tracker, still, |_, _| ()), still);
    assert!(after.iter().all(|e| e.abs() < 0.1), "{after:?}");
    assert_eq!(tracker.counts().relearned, 0);
}

#[test]
fn another_scene_is_learned_anew_and_told() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker(1);
    camera.teach(&mut tracker, still);
    camera.scene = 1;
    let mut frames = 0;
    while tracker.counts().relearned == 0 {
        camera.show(&mut tracker, still, |_, _| ());
        frames += 1;
        assert!(frames < 100, "not noticed in 2 s");
    }
    // 1.5 s, so that a hand is not taken for a scene.
    assert!(frames > 70, "{frames} frames");
    camera.frame = 0;
    camera.teach(&mut tracker, still);
    let outcomes = camera.show(&mut tracker, still, |_, _| ());
    let errors = errors(&outcomes, still);
    assert!(errors.iter().all(|e| e.abs() < 0.1), "{errors:?}");
    assert_eq!(tracker.counts().relearned, 1);
}

#[test]
fn a_creeping_picture_is_followed_beyond_where_its_reference_was() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker(1);
    let creep = |t: f32| 0.5 * t;
    camera.teach(&mut tracker, creep);
    let first = errors(&camera.show(&mut tracker, creep, |_, _| ()), creep);
    let mut last = Vec::new();
    for _ in 0..500 {
        last = errors(&camera.show(&mut tracker, creep, |_, _| ()), creep);
    }
    // 5 px on. The reference takes in a little of the picture all the time, half a pixel behind it.
    assert!(tracker.store.anchor_px() >= 3.0);
    for (a, b) in first.iter().zip(&last) {
        assert!((a - b).abs() < 0.2, "{a} {b}");
    }
}

#[test]
fn dead_columns_are_left_out() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker(1);
    let swing = tone(13.7, 0.4);
    let dead = |_: u16, pixels: &mut [u8; WIDTH]| pixels[40] = 255;
    for _ in 0..2 * LEARN_FRAMES {
        camera.show(&mut tracker, &swing, dead);
    }
    let outcomes = camera.show(&mut tracker, &swing, dead);
    errors(&outcomes, &swing);
    let reach = MAX_HALF;
    let masked: Vec<usize> = (0..WIDTH)
        .filter(|&x| tracker.store.buffers().mask[x] == 0)
        .collect();
    assert_eq!(masked, (40 - reach..=40 + reach).collect::<Vec<_>>());
    for row in tracker.store.buffers().coefficients.chunks(WIDTH) {
        assert_eq!(row[40], 0);
    }
}

#[test]
fn a_shift_beyond_all_bounds_overflows_nothing() {
    for stride in [1, 2] {
        let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
        let mut tracker = memory.tracker(stride);
        camera.teach(&mut tracker, still);
        let before = tracker.store.buffers().mean.to_vec();
        let line = [100u8; WIDTH];
        for huge in [2e9, 5e9, 1e19, f32::MAX, f32::INFINITY] {
            for huge in [huge, -huge] {
                if let Ok(shift_px) = tracker.correlate(3, &mut &line[..], huge, None) {
                    assert!(shift_px.abs() <= WIDTH as f32);
                }
                assert!(tracker.residual(3, &line, huge).is_none());
                tracker.store.follow_row(3, &line, [huge, 0.0], 1.0, false);
                tracker.measure_noise(3, &line, huge, 9);
            }
        }
        assert!(tracker.store.buffers().mean == &before[..]);
        let errors = errors(&camera.show(&mut tracker, still, |_, _| ()), still);
        assert!(errors.iter().all(|e| e.abs() < 0.1), "{errors:?}");
    }
}

#[test]
fn in_a_hurry_a_jump_is_found_within_three_frames() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.hurried();
    camera.teach(&mut tracker, still);
    for to_px in [11.0, -23.0, 0.0] {
        let at = move |_: f32| to_px;
        for _ in 0..3 {
            let outcomes = camera.show(&mut tracker, at, |_, _| ());
            let wrong = |o: &&Outcome| matches!(o, Outcome::Measured(d) if (d.shift_px - to_px).abs() >= 1.0);
            assert_eq!(outcomes.iter().find(wrong), None, "{to_px}");
        }
        let errors = errors(&camera.show(&mut tracker, at, |_, _| ()), at);
        assert!(errors.iter().all(|e| e.abs() < 1.0), "{to_px}: {errors:?}");
    }
}

#[test]
fn in_a_hurry_a_hand_is_forgotten_within_three_frames() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.hurried();
    camera.teach(&mut tracker, still);
    let hand = |_: u16, pixels: &mut [u8; WIDTH]| pixels[20..80].fill(90);
    for _ in 0..20 {
        let outcomes = camera.show(&mut tracker, still, hand);
        // A frame's first line is not looked at, unless it surprises.
        let measured = |o: &&Outcome| matches!(o, Outcome::Measured(_));
        assert!(outcomes.iter().filter(measured).count() <= 1);
    }
    for _ in 0..3 {
        camera.show(&mut tracker, still, |_, _| ());
    }
    let after = errors(&camera.show(&mut tracker, still, |_, _| ()), still);
    assert!(after.iter().all(|e| e.abs() < 0.1), "{after:?}");
    assert_eq!(tracker.counts().relearned, 0);
}

#[test]
fn in_a_hurry_a_creeping_picture_is_followed_row_by_row() {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.hurried();
    let creep = |t: f32| 0.5 * t;
    camera.teach(&mut tracker, creep);
    let first = errors(&camera.show(&mut tracker, creep, |_, _| ()), creep);
    let mut built = tracker.store.buffers().tables.to_vec();
    let mut rebuilt = 0;
    for _ in 0..500 {
        // No frame is left out while the reference is moved.
        let now = errors(&camera.show(&mut tracker, creep, |_, _| ()), creep);
        for (a, b) in first.iter().zip(&now) {
            assert!((a - b).abs() < 0.3, "{a} {b}");
        }
        rebuilt += (built.iter().zip(&*tracker.store.buffers().tables))
            .filter(|(a, b)| a != b)
            .count();
        built.copy_from_slice(tracker.store.buffers().tables);
    }
    assert!(tracker.store.anchor_px() >= 3.0);
    assert!(rebuilt > 10, "{rebuilt} rows");
}

#[test]
fn half_the_light_tells_as_much_of_a_lamp() {
    // 30 % at 91 Hz, so another light in every frame, before a tone of 0.4 px: light that is told wrongly is a wrong scale, a share of the shift.
    let shift = tone(11.0, 0.4);
    for columns_per_line in [u16::MAX, 4] {
        let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
        let mut tracker = memory.tracker_in_steps(1, columns_per_line);
        let mut before: Option<Vec<f32>> = None;
        let mut worst = 0.0f32;
        for frame in 0..u32::from(LEARN_FRAMES) * 2 + 25 {
            let flicker = |row: u16, pixels: &mut [u8; WIDTH]| {
                let ns = i64::from(frame) * FRAME_NS + timing().start_ns(row);
                let light = 1.0 + 0.3 * libm::sinf(core::f32::consts::TAU * 91e-9 * ns as f32);
                for p in pixels {
                    *p = libm::roundf(0.7 * light * f32::from(*p)) as u8;
                }
            };
            let outcomes = camera.show(&mut tracker, &shift, flicker);
            if frame < u32::from(LEARN_FRAMES) * 2 {
                continue;
            }
            let now = errors(&outcomes, &shift);
            if let Some(before) = &before {
                let changes = now.iter().zip(before).map(|(a, b)| (a - b).abs());
                worst = changes.fold(worst, f32::max);
            }
            before = Some(now);
        }
        // Some five standard deviations of two rows, 0.009 px each.
        assert!(worst < 0.06, "{columns_per_line}: {worst} px");
    }
}

#[test]
fn in_a_hurry_swift_motion_is_followed_row_by_row() {
    for (hz, amplitude_px) in [(7.3, 4.0), (43.7, 4.0), (213.7, 4.0)] {
        let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
        let mut tracker = memory.hurried();
        let swing = tone(hz, amplitude_px);
        camera.teach(&mut tracker, &swing);
        let (mut missing, mut worst) = (0, 0.0f32);
        for _ in 0..30 {
            for outcome in camera.show(&mut tracker, &swing, |_, _| ()) {
                match outcome {
                    Outcome::Measured(d) => {
                        let error = d.shift_px - swing(d.time_ns as f32 * 1e-9);
                        worst = worst.max(error.abs());
                    }
                    _ => missing += 1,
                }
            }
        }
        // Of 720 lines; a row's own offset, which is in the error, depends on where it was learned.
        assert!(
            missing < 36,
            "{amplitude_px} px at {hz} Hz: {missing} lines missing"
        );
        assert!(worst < 1.0, "{amplitude_px} px at {hz} Hz: {worst} px");
    }
}

/// Learning, small and large motion, a hand and a jump: wherever the pixels lie, the same comes of them.
#[test]
fn pixels_measure_the_same_wherever_they_lie() {
    let outcomes = |format, room: &mut [u8]| {
        let mut memory = Memory::new();
        let mut tracker = memory.tracker(1).with_line_room(room);
        let mut camera = Camera::new(surface);
        camera.format = format;
        camera.teach(&mut tracker, tone(13.0, 0.3));
        let mut all = camera.show(&mut tracker, tone(13.0, 0.3), |_, _| ());
        all.extend(camera.show(&mut tracker, tone(13.0, 6.0), |_, _| ()));
        let hand = |row: u16, pixels: &mut [u8; WIDTH]| {
            if row > 9 {
                pixels[20..80].fill(90);
            }
        };
        all.extend(camera.show(&mut tracker, still, hand));
        all.extend(camera.show(&mut tracker, |_| 9.0, |_, _| ()));
        all
    };
    let expected = outcomes(RawFormat::Raw8, &mut []);
    let measured = |all: &[Outcome]| {
        let measured = all.iter().filter(|o| matches!(o, Outcome::Measured(_)));
        measured.count()
    };
    assert!(measured(&expected) > 3 * ROWS);
    for format in [RawFormat::Packed10, RawFormat::Packed12, RawFormat::Raw16] {
        assert_eq!(outcomes(format, &mut [0; WIDTH]), expected, "{format:?}");
        let without_room = outcomes(format, &mut [0; WIDTH - 1]);
        assert!(without_room.iter().all(|o| *o == Outcome::Misfit));
    }
}
