//! Some conditions of `rowtone sweep calibration`, from the pictures on: what must be right, and what must be refused.

use rowtone_lab::calibrations::{self, Outcome, Tally, condition};

/// So many recordings of the condition of that name, from a seed on.
fn tally(name: &str, seed: u64, recordings: u64) -> Tally {
    let all = condition::all();
    let condition = all.iter().find(|c| c.name == name).expect(name);
    Tally::of(condition, seed, recordings).unwrap()
}

/// One recording each, not of the study's own seeds. Right is within 4 stated standard deviations: true values would
/// leave that once in 16 000 recordings; the seed is fixed, so this run always says the same.
#[test]
fn the_hard_ones_are_right_or_refused() {
    let all = condition::all();
    for (name, relative) in [
        ("LED 1 kHz, one second", Some(1e-5)),
        ("500 Hz", Some(1e-5)),
        ("2 kHz, exposure 100 µs", Some(1e-5)),
        ("1080 rows of 14.6 µs", Some(1e-5)),
        ("saturated", Some(1e-5)),
        ("low contrast (off: 90 %)", Some(1e-4)),
        ("very low contrast (off: 99 %)", Some(1e-3)),
        ("no contrast (off: 99.9 %)", None),
        ("gradient, one frame", Some(1e-4)),
        ("unknown light, two frame rates", Some(1e-4)),
        ("unknown light, about 440 Hz", Some(1e-4)),
        ("unknown light, one frame rate", None),
        ("tone of 0.4 px, its Hz told", Some(1e-3)),
        ("tone of 0.4 px, about 185 Hz", Some(1e-3)),
        ("no tone", None),
    ] {
        let condition = all.iter().find(|c| c.name == name).expect(name);
        let outcome = calibrations::run(condition, 9200).unwrap();
        match (outcome, relative) {
            (Outcome::Right { error, .. }, Some(most)) => {
                assert!(error.abs() < most, "{name}: {error:.1e} relative");
            }
            (Outcome::Refused(_), None) => {}
            (outcome, _) => panic!("{name}: {outcome:?}"),
        }
    }
}

/// One frame in which flashes fail: of seeds 4100 on, a fit that one dark stripe of 17 had bent was once 7.9 stated
/// deviations off. Right is within 4 of them, which true values would fail once in 800 times for 20 recordings; the
/// line time must also be as good as without the failed flashes.
#[test]
fn failed_flashes_in_one_frame_bend_nothing() {
    let tally = tally("10 % missing, one frame", 4100, 20);
    assert_eq!(tally.counts, [20, 0, 0], "{:?}", tally.reasons);
    let [error, ..] = tally.rms();
    assert!(error < 2e-5, "{error:.1e} relative");
}

/// 437.21 Hz at 29.97 fps: 17 frames see the stripes in 17 places, and rows fall on few more, so that the wave form is not
/// met in full. Of these eight recordings one was 4.1 stated deviations off.
#[test]
fn few_places_of_the_period_are_not_trusted_too_far() {
    let tally = tally("437.21 Hz: 17 places in 17 frames", 41_000, 8);
    assert_eq!(tally.counts, [8, 0, 0], "{:?}", tally.reasons);
}

/// Three places and less than two periods: a picture that is smooth is enough. Of these four recordings some were refused.
#[test]
fn a_mains_lamp_of_three_places_is_calibrated_on_a_plain_scene() {
    let tally = tally("mains lamp, 30 % flicker", 7000, 4);
    assert_eq!(tally.counts, [4, 0, 0], "{:?}", tally.reasons);
}
