//! Both axes from every row, on scenes whose motion and Cramér–Rao bound are known exactly.

#[path = "planar/scene.rs"]
mod scene;

use rowtone::camera::{Line, Pixels, Timing};
use rowtone::tracker::{Axes, Config, Outcome, StaticStorage, StaticVerticalStorage, Tracker};
use scene::{Scene, Texture};

const WIDTH: usize = 160;
const ROWS: usize = 96;

/// One line that was measured: frame, row, first and second measurement with their informations, κ.
struct Measured {
    row: usize,
    motion: [f64; 2],
    shift: [f64; 2],
    information: [f64; 2],
    coupling: f64,
}

fn measure(scene: &mut Scene, axes: Axes, learn: u16, frames: u32) -> Vec<Measured> {
    let timing = Timing::new((scene.line_s * 1e12) as u32, 0, ROWS as u16).unwrap();
    let mut config = Config::new(timing, WIDTH as u16);
    config.learn_frames = learn;
    config.axes = axes;
    let mut storage = Box::new(StaticStorage::<{ WIDTH * ROWS }, ROWS, WIDTH>::new());
    let mut vertical = Box::new(StaticVerticalStorage::<{ WIDTH * ROWS }, ROWS, WIDTH>::new());
    let lent = storage.lend().with_vertical(vertical.lend());
    let mut tracker = Tracker::new(config, lent).unwrap();
    let mut measured = Vec::new();
    for frame in 0..u32::from(learn) * 2 + frames {
        for row in 0..ROWS {
            let pixels = scene.row(frame, row);
            let start_s = scene.start_s(frame, row);
            let line = Line {
                frame,
                row: row as u16,
                start_ns: (start_s * 1e9) as i64,
                pixels: Pixels::U8(&pixels),
            };
            if let Outcome::Measured(d) = tracker.push(&line) {
                let v = d.vertical.unwrap_or_default();
                measured.push(Measured {
                    row,
                    motion: scene.motion(start_s),
                    shift: [d.shift_px.into(), v.shift_px.into()],
                    information: [d.information_per_px2.into(), v.information_per_px2.into()],
                    coupling: v.coupling.into(),
                });
            }
        }
    }
    measured
}

/// What all rows make of the motion, and how noisy they are.
#[derive(Debug)]
struct Fit {
    /// Measured x and y for each px of true x and y.
    gain: [[f64; 2]; 2],
    /// Mean square of what is left of each measurement, times the information that it claims.
    chi2: [f64; 2],
    /// Root mean square of noise of x and y, each row in units of its two-axis bound.
    ratio: [f64; 2],
    /// λ_min/λ_max of the sum of all informations.
    conditioned: f64,
    rows: usize,
    /// Standard deviations of the four gains, as the informations say.
    sd: [f64; 4],
}

fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> [f64; N] {
    for k in 0..N {
        for i in 0..N {
            if i != k {
                let f = a[i][k] / a[k][k];
                let pivot = a[k];
                for (own, pivot) in a[i].iter_mut().zip(pivot) {
                    *own -= f * pivot;
                }
                b[i] -= f * b[k];
            }
        }
    }
    core::array::from_fn(|k| b[k] / a[k][k])
}

fn fit(scene: &Scene, mut lines: Vec<Measured>) -> Fit {
    // Each row's own place is unknown: means over the frames go, of everything.
    for row in 0..ROWS {
        let mut mean = [0.0; 4];
        let mut n = 0.0;
        let of = |m: &Measured| [m.motion[0], m.motion[1], m.shift[0], m.shift[1]];
        for m in lines.iter().filter(|m| m.row == row) {
            let own = of(m);
            (0..4).for_each(|k| mean[k] += own[k]);
            n += 1.0;
        }
        for m in lines.iter_mut().filter(|m| m.row == row) {
            for k in 0..2 {
                m.motion[k] -= mean[k] / n;
                m.shift[k] -= mean[2 + k] / n;
            }
        }
    }
    // Unknown: x of x, x of y, y of x, y of y.
    let (mut a, mut b) = ([[0.0; 4]; 4], [0.0; 4]);
    let mut j = [0.0f64; 3];
    for m in &lines {
        let [u, v] = m.motion;
        let k = m.coupling;
        for (basis, shift, information) in [
            ([u, v, k * u, k * v], m.shift[0], m.information[0]),
            ([0.0, 0.0, u, v], m.shift[1], m.information[1]),
        ] {
            for r in 0..4 {
                for c in 0..4 {
                    a[r][c] += information * basis[r] * basis[c];
                }
                b[r] += information * basis[r] * shift;
            }
        }
        j[0] += m.information[0];
        j[1] += k * m.information[0];
        j[2] += k * k * m.information[0] + m.information[1];
    }
    // Where nothing moves, or nothing is known, nothing is read.
    (0..4).for_each(|k| a[k][k] += 1e-9 + 1e-9 * a[k][k]);
    let g = solve(a, b);
    let sd = core::array::from_fn(|k| {
        let mut unit = [0.0; 4];
        unit[k] = 1.0;
        solve(a, unit)[k].sqrt().min(9.0)
    });
    let (mut chi2, mut sums) = ([0.0; 2], [0.0; 2]);
    let (mut ratio, mut counted) = ([0.0; 2], 0.0);
    for row in 0..ROWS {
        let [xx, xy, yy] = scene.information(row);
        let det = xx * yy - xy * xy;
        let bound = [yy / det, xx / det];
        let (mut square, mut n) = ([0.0; 2], 0.0);
        for m in lines.iter().filter(|m| m.row == row) {
            let [u, v] = m.motion;
            let x = g[0] * u + g[1] * v;
            let y = g[2] * u + g[3] * v;
            let left = [m.shift[0] - x - m.coupling * y, m.shift[1] - y];
            for k in 0..2 {
                if m.information[k] > 0.0 {
                    chi2[k] += left[k] * left[k] * m.information[k];
                    sums[k] += 1.0;
                }
            }
            if m.information[1] > 0.0 {
                square[0] += (left[0] - m.coupling * left[1]).powi(2);
                square[1] += left[1].powi(2);
                n += 1.0;
            }
        }
        if n > 1.0 {
            // Weak rows would tell of nothing else.
            (0..2).for_each(|k| ratio[k] += square[k] / (n - 1.0) / bound[k]);
            counted += 1.0;
        }
    }
    let half = 0.5 * (j[0] + j[2]);
    let root = (0.25 * (j[0] - j[2]).powi(2) + j[1] * j[1]).sqrt();
    Fit {
        gain: [[g[0], g[1]], [g[2], g[3]]],
        chi2: [chi2[0] / sums[0], chi2[1] / sums[1]],
        ratio: ratio.map(|r| (r / counted).sqrt()),
        conditioned: (half - root) / (half + root),
        rows: counted as usize,
        sd,
    }
}

fn of(texture: Texture, x: f64, y: f64, axes: Axes) -> Fit {
    let mut scene = Scene::new(texture, WIDTH, 3);
    scene.tones = [vec![(97.3, x, 0.3)], vec![(71.3, y, 1.1)]];
    let lines = measure(&mut scene, axes, 30, 40);
    fit(&scene, lines)
}

/// Rows reach their two-axis bound (1.10 times it is asked for; the figure itself is known to 1.5 %, from 3700 rows), say what
/// they know (χ² of 1, to 4 %), and neither axis leaks into the other by more than 0.5 % or three standard deviations.
/// Seeds are fixed: nothing is left to chance.
#[test]
fn rows_reach_the_bound_along_both_axes() {
    for (texture, x, y) in [
        (Texture::Even, 0.1, 0.1),
        (Texture::Even, 0.0, 0.4),
        (Texture::Even, 0.4, 0.4),
        (Texture::Leaning(0.52), 0.2, 0.2),
        (Texture::Leaning(1.4), 0.2, 0.0),
    ] {
        let fit = of(texture, x, y, Axes::Xy);
        println!("{texture:?} {x} {y}: {fit:.4?}");
        assert!(fit.conditioned > 0.05, "{}", fit.conditioned);
        assert_eq!(fit.rows, ROWS - 4);
        for k in 0..2 {
            assert!(fit.ratio[k] < 1.1, "noise along {k}: {}", fit.ratio[k]);
            assert!(
                (0.75..1.15).contains(&fit.chi2[k]),
                "claimed along {k}: {}",
                fit.chi2[k]
            );
            let moves = [x, y];
            for of in (0..2).filter(|&of| moves[of] > 0.0) {
                let expected = if k == of { 1.0 } else { 0.0 };
                let off = (fit.gain[k][of] - expected).abs();
                assert!(off < 0.005 + 3.0 * fit.sd[2 * k + of], "{k} of {of}: {off}");
            }
        }
    }
}

/// Motion by whole rows is read against the row that is seen: the gain stays within 1.5 %, and it leaks into the other axis by no
/// more than 0.5 %.
#[test]
fn motion_by_whole_rows_is_followed() {
    for (texture, x, y) in [
        (Texture::Even, 0.0, 1.0),
        (Texture::Leaning(0.52), 0.0, 1.0),
    ] {
        let fit = of(texture, x, y, Axes::Xy);
        println!("{texture:?} {x} {y}: {fit:.4?}");
        assert!((fit.gain[1][1] - 1.0).abs() < 0.015, "{:?}", fit.gain);
        assert!(fit.gain[0][1].abs() < 0.005, "{:?}", fit.gain);
        assert!(
            x == 0.0 || (fit.gain[0][0] - 1.0).abs() < 0.01,
            "{:?}",
            fit.gain
        );
    }
}

/// What all edges leave unknown is not made up: only the motion across them is read, and the direction is that of the edges.
#[test]
fn edges_that_lean_one_way_tell_one_direction() {
    let fit = of(Texture::OneWay(0.52), 0.2, 0.2, Axes::Xy);
    println!("{fit:.4?}");
    assert!(fit.conditioned < 3e-3, "{}", fit.conditioned);
    assert!((0.9..1.1).contains(&fit.chi2[0]), "{}", fit.chi2[0]);
    assert_eq!(fit.rows, 0);
}

/// Along the rows alone, motion along the columns leaks in: that is what the other way is for.
#[test]
fn along_rows_alone_the_other_axis_leaks_in() {
    let fit = of(Texture::Leaning(0.52), 0.2, 0.2, Axes::X);
    assert!(fit.gain[0][1] > 0.4, "{:?}", fit.gain);
}
