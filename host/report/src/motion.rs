//! What a tone does, in words: which way it moves, whether all rows alike, how steady it is.

use rowtone::report::{Motion, Peak};

/// An axis on which less than this share of the other's amplitude is seen takes no part in it.
const SHARE: f64 = 0.03;
/// Nor one whose amplitude is less than so many of its standard deviations.
const SURE: f64 = 4.0;
/// An orbit that is narrower than this share of its length is a line.
const NARROW: f64 = 0.1;

/// Which way a peak moves and how, such as `along y`, `at 37°`, `orbit 0.2000 x 0.1510 px at -12°`,
/// each with what else is known of it, separated by commas. Angles are from the right downwards. Empty
/// where nothing is known but its amplitude.
pub(crate) fn words(peak: &Peak) -> String {
    let Some(motion) = &peak.motion else {
        return String::new();
    };
    let mut words: Vec<String> = direction(motion).into_iter().collect();
    if !motion.rigid {
        words.push("varies over the rows".into());
    }
    if let Some(decay_s) = motion.decay_s {
        words.push(format!("struck, falls to 1/e in {decay_s:.3} s"));
    }
    // What is less reads 0.00.
    if let Some(rate) = motion.hz_per_s.filter(|rate| rate.abs() >= 0.005) {
        let way = if rate > 0.0 { "rises" } else { "falls" };
        words.push(format!("{way} by {:.2} Hz/s", rate.abs()));
    }
    if let Some(swing) = &motion.modulation {
        words.push(match swing.of_phase {
            true => format!(
                "its phase swings by {:.2} rad at {:.2} Hz",
                swing.depth, swing.hz
            ),
            false => format!(
                "swings by {:.0} % at {:.2} Hz",
                100.0 * swing.depth,
                swing.hz
            ),
        });
    }
    if let Some(spread_hz) = motion.spread_hz {
        words.push(format!("unsteady, ± {spread_hz:.2} Hz"));
    }
    words.join(", ")
}

/// The phase of the larger axis to a tenth of a degree, never -0.
pub(crate) fn phase_degrees(motion: &Motion) -> f64 {
    let of_y = motion.y_px > motion.x_px;
    let phase = motion.y_phase_rad.filter(|_| of_y);
    let phase = f64::from(phase.unwrap_or(motion.phase_rad)).to_degrees();
    (phase * 10.0).round() / 10.0 + 0.0
}

/// The direction or the orbit; `None` where one axis alone is measured.
fn direction(motion: &Motion) -> Option<String> {
    if let Some(across) = motion.across_rad {
        return Some(format!("across its edges, at {}°", degrees(across.into())));
    }
    let (x, y) = (f64::from(motion.x_px?), f64::from(motion.y_px?));
    let seen = |px: f64, sd: Option<f32>, other: f64| {
        px > SHARE * other && px > SURE * f64::from(sd.unwrap_or(0.0))
    };
    match (seen(x, motion.x_px_sd, y), seen(y, motion.y_px_sd, x)) {
        (false, false) => None,
        (true, false) => Some("along x".into()),
        (false, true) => Some("along y".into()),
        (true, true) => {
            let late = f64::from(motion.y_phase_rad.unwrap_or(motion.phase_rad) - motion.phase_rad);
            let [long, short, angle] = orbit(x, y, late);
            let at = degrees(angle);
            Some(match short < NARROW * long {
                true => format!("at {at}°"),
                false => format!("orbit {long:.4} x {short:.4} px at {at}°"),
            })
        }
    }
}

/// Half axes of the ellipse of x·sin(wt) and y·sin(wt + late), the longer one first, and its angle, rad.
fn orbit(x: f64, y: f64, late: f64) -> [f64; 3] {
    // Stokes parameters of the two oscillations.
    let (sum, difference) = (x * x + y * y, x * x - y * y);
    let cross = 2.0 * x * y * late.cos();
    let root = difference.hypot(cross);
    let axis = |squared: f64| (0.5 * squared).max(0.0).sqrt();
    [
        axis(sum + root),
        axis(sum - root),
        0.5 * cross.atan2(difference),
    ]
}

/// Whole degrees, never -0, in -89 to 90.
fn degrees(radians: f64) -> i32 {
    let degrees = radians.to_degrees().round() as i32;
    if degrees <= -90 {
        degrees + 180
    } else {
        degrees
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone::report::Modulation;

    fn moving(x_px: f32, y_px: f32, late: f32) -> Motion {
        Motion {
            x_px: Some(x_px),
            x_px_sd: Some(0.0002),
            y_px: Some(y_px),
            y_px_sd: Some(0.0002),
            phase_rad: 0.3,
            y_phase_rad: Some(0.3 + late),
            ..Motion::STEADY
        }
    }

    fn said(motion: Motion) -> String {
        let mut peak = crate::example(None).peaks[0];
        peak.motion = Some(motion);
        words(&peak)
    }

    #[test]
    fn a_direction_is_told_in_words() {
        assert_eq!(said(moving(0.2, 0.0003, 1.0)), "along x");
        assert_eq!(said(moving(0.0003, 0.2, 1.0)), "along y");
        assert_eq!(said(moving(0.0001, 0.0002, 1.0)), "");
        assert_eq!(said(moving(0.2, 0.2, 0.0)), "at 45°");
        let opposite = core::f32::consts::PI;
        assert_eq!(said(moving(0.3, 0.1, opposite)), "at -18°");
        let quarter = core::f32::consts::FRAC_PI_2;
        assert_eq!(
            said(moving(0.2, 0.1, quarter)),
            "orbit 0.2000 x 0.1000 px at 0°"
        );
        let across = Motion {
            x_px: None,
            y_px: None,
            across_rad: Some(-core::f32::consts::FRAC_PI_6),
            ..moving(0.0, 0.0, 0.0)
        };
        assert_eq!(said(across), "across its edges, at -30°");
        // Along the rows alone: nothing to say of a direction.
        let alone = Motion {
            y_px: None,
            ..moving(0.2, 0.0, 0.0)
        };
        assert_eq!(said(alone), "");
    }

    #[test]
    fn a_phase_is_that_of_the_larger_axis() {
        let told = |x, y| phase_degrees(&moving(x, y, 0.2));
        assert_eq!([told(0.3, 0.1), told(0.1, 0.3)], [17.2, 28.6]);
        let nothing = Motion {
            phase_rad: -1e-4,
            ..moving(0.3, 0.1, 0.2)
        };
        assert!(phase_degrees(&nothing).is_sign_positive());
    }

    #[test]
    fn what_else_is_known_follows() {
        let bent = Motion {
            rigid: false,
            decay_s: Some(0.1),
            hz_per_s: Some(-3.25),
            modulation: Some(Modulation {
                hz: 5.0,
                depth: 0.3,
                of_phase: false,
            }),
            spread_hz: Some(0.4),
            ..moving(0.2, 0.0, 0.0)
        };
        assert_eq!(
            said(bent),
            "along x, varies over the rows, struck, falls to 1/e in 0.100 s, falls by 3.25 Hz/s, \
             swings by 30 % at 5.00 Hz, unsteady, ± 0.40 Hz"
        );
    }

    #[test]
    fn an_orbit_holds_the_motion_in_every_direction() {
        for k in 0..200 {
            let late = f64::from(k) * 0.05;
            let (x, y) = (0.1 + f64::from(k % 7) * 0.05, 0.4 - f64::from(k % 5) * 0.07);
            let [long, short, angle] = orbit(x, y, late);
            // Along the long half axis the two oscillations add up to its length.
            let (c, s) = (angle.cos() * x, angle.sin() * y);
            let along = (c * c + s * s + 2.0 * c * s * late.cos()).sqrt();
            assert!((along - long).abs() < 1e-9, "{along} {long}");
            // The area of an ellipse by its half axes and by its two oscillations.
            assert!((long * short - (x * y * late.sin()).abs()).abs() < 1e-7);
        }
    }
}
