//! Frames as cameras, drivers and rooms deliver them: each bad one costs itself and nothing else.

use super::*;

/// Frames of a recording, each changed by `fault` after what it shows; how many of the rows of the last 60 frames are
/// measured, and the largest change of a row's error over them, px.
fn recording(
    columns_per_line: u16,
    shift: impl Fn(f32) -> f32,
    fault: impl Fn(u32, u16, &mut [u8; WIDTH]),
) -> (usize, f32, Counts) {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker_in_steps(1, columns_per_line);
    let (mut measured, mut worst) = (0, 0.0f32);
    let mut first = [None; ROWS];
    for frame in 0..100 {
        let outcomes = camera.show(&mut tracker, &shift, |row, pixels| {
            fault(frame, row, pixels);
        });
        for (outcome, first) in outcomes.iter().zip(&mut first) {
            if let (Outcome::Measured(d), true) = (outcome, frame >= 40) {
                let error = d.shift_px - shift(d.time_ns as f32 * 1e-9);
                measured += 1;
                worst = worst.max((error - *first.get_or_insert(error)).abs());
            }
        }
    }
    (measured, worst, tracker.counts())
}

fn dark(frame: u32, row: u16, pixels: &mut [u8; WIDTH]) {
    for (x, p) in (0u32..).zip(pixels) {
        let dice = (frame * 7919 + u32::from(row) * 131 + x).wrapping_mul(2_654_435_761);
        *p = 4 + (dice >> 30) as u8;
    }
}

fn random(frame: u32, row: u16, pixels: &mut [u8; WIDTH]) {
    for (x, p) in (0u32..).zip(pixels) {
        let dice = (frame * 7919 + u32::from(row) * 131 + x).wrapping_mul(2_654_435_761);
        *p = (dice ^ dice >> 15)
            .wrapping_mul(2_246_822_519)
            .to_be_bytes()[0];
    }
}

#[test]
fn bad_first_frames_cost_themselves_alone() {
    type Fault = fn(u32, u16, &mut [u8; WIDTH]);
    let faults: [(&str, u32, Fault); 4] = [
        ("black", 1, |_, _, p| p.fill(0)),
        ("dark", 3, dark),
        ("random", 1, random),
        ("stale", 1, |_, _, p| p.rotate_left(24)),
    ];
    let swing = tone(13.7, 0.3);
    for columns_per_line in [u16::MAX, 4] {
        for (name, bad, fault) in faults {
            let (measured, worst, counts) = recording(columns_per_line, &swing, |frame, row, p| {
                if frame < bad {
                    fault(frame, row, p);
                }
            });
            assert_eq!(measured, 60 * ROWS, "{name}: {counts:?}");
            assert!(worst < 0.1, "{name}: {worst} px");
        }
    }
}

#[test]
fn a_frame_that_is_elsewhere_for_once_while_learning_widens_no_margin() {
    for bad in [3, 10] {
        let (measured, worst, _) = recording(u16::MAX, tone(13.7, 0.3), |frame, _, p| {
            if frame == bad {
                p.rotate_left(24);
            }
        });
        assert_eq!(measured, 60 * ROWS, "frame {bad}");
        assert!(worst < 0.1, "frame {bad}: {worst} px");
    }
}

#[test]
fn unlit_frames_are_left_out() {
    for columns_per_line in [u16::MAX, 4] {
        let (measured, worst, counts) = recording(
            columns_per_line,
            tone(13.7, 0.3),
            |frame, row, p| match frame {
                50..55 => p.fill(0),
                70..72 => dark(frame, row, p),
                _ => {}
            },
        );
        assert_eq!(measured, (60 - 7) * ROWS);
        assert_eq!(counts.unlit, 7 * ROWS as u64, "{counts:?}");
        assert_eq!((counts.occluded, counts.relearned), (0, 0));
        assert!(worst < 0.1, "{worst} px");
    }
}

/// A camera whose frames before `from` are fresh, and of those after it only one in `every`.
fn copies(columns_per_line: u16, from: u32, every: u32) -> (usize, f32, Counts) {
    let (mut memory, mut camera) = (Memory::new(), Camera::new(surface));
    let mut tracker = memory.tracker_in_steps(1, columns_per_line);
    let swing = tone(13.7, 0.4);
    let last = std::cell::RefCell::new([[0u8; WIDTH]; ROWS]);
    let (mut measured, mut worst) = (0, 0.0f32);
    let mut first = [None; ROWS];
    for frame in 0..100 {
        let fresh = frame < from || frame % every == 0;
        let outcomes = camera.show(&mut tracker, &swing, |row, pixels| {
            let kept = &mut last.borrow_mut()[usize::from(row)];
            if fresh {
                *kept = *pixels;
            } else {
                *pixels = *kept;
            }
        });
        for (outcome, first) in outcomes.iter().zip(&mut first) {
            if let (Outcome::Measured(d), true) = (outcome, frame >= 40) {
                let error = d.shift_px - swing(d.time_ns as f32 * 1e-9);
                measured += 1;
                worst = worst.max((error - *first.get_or_insert(error)).abs());
            }
        }
    }
    (measured, worst, tracker.counts())
}

#[test]
fn copies_are_no_measurements_and_are_counted() {
    for columns_per_line in [u16::MAX, 4] {
        let (measured, worst, counts) = copies(columns_per_line, 0, 2);
        assert_eq!(measured, 30 * ROWS, "{counts:?}");
        // The last frame has not ended.
        assert_eq!(counts.repeated_frames, 49);
        assert!(worst < 0.12, "{worst} px");
        let (measured, _, counts) = copies(columns_per_line, 60, 10_000);
        assert_eq!((measured, counts.repeated_frames), (20 * ROWS, 39));
        let (measured, _, counts) = copies(columns_per_line, 100, 1);
        assert_eq!((measured, counts.repeated_frames), (60 * ROWS, 0));
    }
}

#[test]
fn a_soft_shadow_that_passes_while_learning_leaves_the_rest_right() {
    // Half the light on one side of an edge 16 px wide, which crosses the picture in the first 60 frames.
    for columns_per_line in [u16::MAX, 4] {
        let (measured, worst, counts) =
            recording(columns_per_line, tone(13.7, 0.3), |frame, _, p| {
                let edge = 3.0 * frame as f32 - 16.0;
                for (x, p) in (0u8..).zip(p) {
                    let lit = (0.5 + (f32::from(x) - edge) / 16.0).clamp(0.0, 1.0);
                    let lit = if frame < 60 { lit } else { 1.0 };
                    *p = libm::roundf((0.7 + 0.3 * lit) * f32::from(*p)) as u8;
                }
            });
        assert!(measured > 55 * ROWS, "{measured} {counts:?}");
        assert!(worst < 0.15, "{worst} px");
    }
}

#[test]
fn pixels_that_stand_still_are_left_out_of_their_rows() {
    for columns_per_line in [u16::MAX, 4] {
        let (measured, worst, _) =
            recording(columns_per_line, tone(13.7, 0.35), |_, row, p| match row {
                14 => p[50] = 255,
                17 => p[90] = 240,
                20 => (p[40], p[70]) = (0, 250),
                _ => {}
            });
        assert_eq!(measured, 60 * ROWS);
        assert!(worst < 0.1, "{columns_per_line}: {worst} px");
    }
}
