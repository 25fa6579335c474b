//! `rowtone calibrate --from-vibration` where a tone turns by less than a period from the first row to the last: pictures
//! made here, a pattern that moves along the rows, each row read when it is its turn.

use rowtone_calibrate::Calibration;
use rowtone_calibrate::file::RollingName;
use rowtone_calibrate::rows::Recording;
use rowtone_calibrate::tone::motion::Watcher;
use rowtone_calibrate::tone::{About, NoTone, calibrate};
use rowtone_chance::{Chance, SplitMix};
use std::f64::consts::TAU;

const WIDTH: usize = 48;

/// A camera before something that vibrates: a prong that bends, its tip up, its foot still.
struct Film {
    rows: usize,
    frames: usize,
    fps: f64,
    line_time_s: f64,
    /// Hz and amplitude at the tip, px.
    tones: Vec<(f64, f64)>,
    is_upward: bool,
}

impl Film {
    fn displacement(&self, frame: usize, row: usize) -> f64 {
        let order = if self.is_upward {
            self.rows - 1 - row
        } else {
            row
        };
        let t = frame as f64 / self.fps + order as f64 * self.line_time_s;
        let tones = self.tones.iter().map(|(hz, px)| px * (TAU * hz * t).sin());
        // It bends: the second half of the rows moves the other way.
        let bend = 1.0 - 1.5 * row as f64 / self.rows as f64;
        bend * tones.sum::<f64>()
    }

    fn calibrate(&self, about: About) -> Result<Calibration, NoTone> {
        let mut chance = SplitMix(7);
        let mut watcher = Watcher::new(WIDTH, self.rows);
        for n in 0..self.frames {
            let mut picture = Vec::with_capacity(WIDTH * self.rows);
            for y in 0..self.rows {
                let x0 = self.displacement(n, y) + 3.0 * (0.05 * y as f64).sin();
                picture.extend((0..WIDTH).map(|x| {
                    let value = 120.0 + 80.0 * (0.45 * (x as f64 - x0)).sin();
                    (value + chance.normal_between()).round() as u16
                }));
            }
            watcher.push(&picture);
        }
        let recording = Recording {
            times_s: Some((0..self.frames).map(|n| n as f64 / self.fps).collect()),
            fps: Some(self.fps),
            picture_rows: Some(self.rows),
            ..Recording::default()
        };
        calibrate(&watcher.finish(), &recording, about).map(|found| found.0)
    }
}

fn slow_motion() -> Film {
    Film {
        rows: 96,
        frames: 300,
        fps: 240.0,
        line_time_s: 36e-6,
        tones: vec![(32.3, 0.6)],
        is_upward: false,
    }
}

fn is_right(c: &Calibration, film: &Film) {
    let off = c.line_time_s - film.line_time_s;
    assert!(off.abs() < 5.0 * c.line_time_s_sd, "{c:?}");
    assert!(off.abs() < 0.01 * film.line_time_s, "{c:?}");
}

/// 0.11 periods in a frame: nothing but the tone itself is needed.
#[test]
fn a_ninth_of_a_period_in_slow_motion_is_enough() {
    let film = slow_motion();
    let c = film.calibrate(About::Nothing).unwrap();
    is_right(&c, &film);
    assert_eq!(c.rolling, Some(RollingName::Down));
    assert!((c.light_hz - 32.3).abs() < 5.0 * c.light_hz_sd, "{c:?}");
}

/// At 60 frames a second many line times make one tone; a second tone leaves one, and so does a guess.
#[test]
fn a_second_tone_or_a_guess_leaves_one_line_time() {
    let one = Film {
        rows: 96,
        frames: 180,
        fps: 60.0,
        line_time_s: 150e-6,
        tones: vec![(49.2, 0.5)],
        is_upward: false,
    };
    let Err(NoTone::Ambiguous { readings }) = one.calibrate(About::Nothing) else {
        panic!("one tone");
    };
    assert!(readings.iter().any(|r| (r.1 / 150e-6 - 1.0).abs() < 0.01));
    is_right(&one.calibrate(About::Near(50.0)).unwrap(), &one);
    is_right(&one.calibrate(About::Exactly(49.2)).unwrap(), &one);
    let two = Film {
        tones: vec![(49.2, 0.5), (137.1, 0.2)],
        ..one
    };
    is_right(&two.calibrate(About::Nothing).unwrap(), &two);
}

#[test]
fn rows_read_upwards_are_told() {
    let film = Film {
        is_upward: true,
        ..slow_motion()
    };
    let c = film.calibrate(About::Nothing).unwrap();
    is_right(&c, &film);
    assert_eq!(c.rolling, Some(RollingName::Up));
}

#[test]
fn what_tells_nothing_is_refused_in_its_own_words() {
    let still = Film {
        tones: vec![],
        ..slow_motion()
    };
    assert_eq!(still.calibrate(About::Nothing), Err(NoTone::NothingSteady));
    let global = Film {
        line_time_s: 0.0,
        ..slow_motion()
    };
    let refusal = global.calibrate(About::Nothing).unwrap_err();
    assert!(matches!(refusal, NoTone::AtOnce { .. }), "{refusal}");
    let refusal = slow_motion().calibrate(About::Exactly(77.0)).unwrap_err();
    assert!(matches!(refusal, NoTone::NotThere { .. }), "{refusal}");
    for refusal in [
        refusal,
        NoTone::NothingSteady,
        NoTone::NoTexture,
        NoTone::NoTimes,
    ] {
        assert!(!refusal.to_string().contains("light"), "{refusal}");
    }
}
