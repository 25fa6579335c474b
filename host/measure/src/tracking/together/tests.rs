//! Speckle that fades out to the right, filmed at 1000 fps and coded so that what is blank creeps and blocks jump in level.

use std::f64::consts::TAU;

use rowtone::camera::Pixels;

use super::*;

const SIZE: (usize, usize) = (96, 64);

struct Still(i64, Vec<u8>);

impl Picture for Still {
    fn start_ns(&self) -> i64 {
        self.0
    }

    fn row(&self, part: &Rect, row: usize) -> Pixels<'_> {
        Pixels::U8(&self.1[(part.y + row) * SIZE.0 + part.x..][..part.width])
    }
}

/// Where the picture is at a time, px.
fn place(t: f64) -> [f64; 2] {
    [
        1.2 * (TAU * 31.97 * t).sin() + 0.05 * (TAU * 143.3 * t).sin(),
        0.3 * (TAU * 71.0 * t).cos(),
    ]
}

/// Frame `k` of a camera that takes so long from row to row, s.
fn frame(k: i64, line_s: f64) -> Still {
    let mut pixels = Vec::with_capacity(SIZE.0 * SIZE.1);
    for y in 0..SIZE.1 {
        let [right, down] = place(k as f64 * 1e-3 + line_s * y as f64);
        for x in 0..SIZE.0 {
            let (u, v) = (x as f64 - right, y as f64 - down);
            let speckle = (0.61 * u + 0.2 * v).sin() + (0.33 * u - 0.47 * v).cos();
            let chance = (k as usize * 7919 + (y / 16) * 131 + (x / 16) * 17) % 13;
            let level = chance as f64 - 6.0;
            let fades = 40.0 * (-((u - 30.0) / 20.0).powi(2)).exp();
            let creeps = if x < 64 { 0 } else { (x + k as usize / 40) % 3 };
            let light = 110.0 + fades * speckle + creeps as f64;
            pixels.push((light + 0.3 * level).round() as u8);
        }
    }
    Still(k * 1_000_000, pixels)
}

/// Largest error of the rows of 40 frames along x and y, px, by a camera of this line time, ns.
fn worst(line_ns: u32) -> [f64; 2] {
    let line_s = f64::from(line_ns) * 1e-9;
    let timing = Timing::new(line_ns * 1000, 0, SIZE.1 as u16).unwrap();
    let frames: Vec<Still> = (0..100).map(|k| frame(k, line_s)).collect();
    let whole = (Rect::whole(SIZE.0, SIZE.1), 0..SIZE.1);
    let mut together = Together::learn(whole, (timing, Axes::Xy), None, &frames[..64]);
    let mut off: [Vec<f64>; 2] = Default::default();
    let mut rows = Vec::new();
    for (number, frame) in (0u32..).zip(&frames).skip(60) {
        rows.clear();
        let became = together.measure((number, frame), &mut rows);
        assert_eq!((became, rows.len()), (Became::Measured, SIZE.1), "{number}");
        // All rows together, as a sample takes them.
        let (mut information, mut sums) = ([0.0; 2], [0.0; 2]);
        for row in &rows {
            let v = row.vertical.unwrap();
            let [right, down] = place(row.time_ns as f64 * 1e-9);
            let x = f64::from(row.shift_px - v.coupling * v.shift_px) - right;
            let y = f64::from(v.shift_px) - down;
            let knows = [row.information_per_px2, v.information_per_px2].map(f64::from);
            for (axis, off) in [x, y].into_iter().enumerate() {
                information[axis] += knows[axis];
                sums[axis] += knows[axis] * off;
            }
        }
        for axis in 0..2 {
            off[axis].push(sums[axis] / information[axis]);
        }
    }
    off.map(|off| {
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        off.iter().fold(0.0, |a: f64, o| a.max((o - mean).abs()))
    })
}

#[test]
fn blocks_that_jump_in_level_and_blank_ones_do_not_lead_astray() {
    for line_ns in [0, 10_000] {
        let [x, y] = worst(line_ns);
        assert!(x < 0.02 && y < 0.02, "{line_ns} ns: {x} {y}");
    }
}

#[test]
fn a_copy_counts_nothing_and_another_scene_is_lost() {
    let timing = Timing::new(0, 0, SIZE.1 as u16).unwrap();
    let frames: Vec<Still> = (0..64).map(|k| frame(k, 0.0)).collect();
    let whole = (Rect::whole(SIZE.0, SIZE.1), 0..SIZE.1);
    let mut together = Together::learn(whole, (timing, Axes::Xy), None, &frames);
    let mut became = |frame: &Still| together.measure((0, frame), &mut Vec::new());
    for frame in &frames {
        assert_eq!(became(frame), Became::Measured);
    }
    assert_eq!(became(&frames[63]), Became::Repeated);
    let mut other = frame(64, 0.0);
    let hash = |k: usize| (k.wrapping_mul(2_654_435_761) >> 7) as u8;
    other
        .1
        .iter_mut()
        .enumerate()
        .for_each(|(k, p)| *p = hash(k));
    assert_eq!(became(&other), Became::Lost);
    assert_eq!(became(&frame(65, 0.0)), Became::Measured);
}
