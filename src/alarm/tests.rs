//! The alarms as a whole.

extern crate std;

use super::*;
use crate::report::{BroadBand, Figure, Measures, Peak, Warning, Warnings};

mod any;

fn figure(value: f32) -> Figure {
    Figure {
        value,
        sd: 0.02 * value,
        at_most: 1.04 * value,
    }
}

/// A window of so many mm/s.
fn shaking(mm_s: f32) -> Report {
    let sum = Measures {
        velocity_px_s: Some(figure(mm_s * 100.0)),
        ..Measures::default()
    };
    Report {
        window_s: 1.0,
        fps: 60.0,
        lines: 18_000,
        noise_px: 0.01,
        um_per_px: Some(10.0),
        velocity_mm_s_rms: Some(mm_s),
        broad_band: Some(BroadBand {
            known_to_hz: 1000.0,
            x: None,
            y: None,
            sum,
        }),
        ..Report::EMPTY
    }
}

fn spoilt(mm_s: f32) -> Report {
    Report {
        warnings: Warnings::of(Warning::Occluded),
        ..shaking(mm_s)
    }
}

fn peak(hz: f32, amplitude_px: f32) -> Peak {
    Peak {
        hz,
        hz_sd: 0.001,
        amplitude_px,
        amplitude_px_sd: 0.0001,
        snr_db: 30.0,
        ambiguous: false,
        track: 1,
        harmonic: None,
        motion: None,
    }
}

fn fixed() -> Rule {
    Rule {
        warning: Some(Limit::Fixed(4.5)),
        trip: Some(Limit::Fixed(7.1)),
        delay: 3,
        ..Rule::velocity("overall")
    }
}

fn alarms(rule: Rule) -> Alarms {
    let rules = [rule].into_iter().collect();
    Alarms::new(Config {
        rules,
        ..Config::default()
    })
    .unwrap()
}

/// Feeds so many windows and gives all that happened.
fn feed(alarms: &mut Alarms, windows: usize, report: &Report) -> std::vec::Vec<Happening> {
    let all = (0..windows).flat_map(|_| alarms.window(report));
    all.map(|event| event.happening).collect()
}

#[test]
fn a_limit_waits_and_clears_below_its_hysteresis() {
    let mut alarms = alarms(fixed());
    assert_eq!(feed(&mut alarms, 2, &shaking(5.0)), []);
    let [
        Happening::Level {
            from: Level::Normal,
            to: Level::Warning,
            value: Some(value),
        },
    ] = feed(&mut alarms, 1, &shaking(5.0))[..]
    else {
        panic!("the third raises it")
    };
    assert!((value - 5.0).abs() < 1e-5);
    // Between 4.05 and 4.5: it stays.
    assert_eq!(feed(&mut alarms, 50, &shaking(4.2)), []);
    assert_eq!(feed(&mut alarms, 2, &shaking(3.9)), []);
    assert_eq!(feed(&mut alarms, 1, &shaking(3.9)).len(), 1);
    assert_eq!(alarms.level(), Level::Normal);
    // Two windows of five are outvoted, again and again.
    for _ in 0..20 {
        assert_eq!(feed(&mut alarms, 2, &shaking(30.0)), []);
        assert_eq!(feed(&mut alarms, 3, &shaking(1.0)), []);
    }
    feed(&mut alarms, 3, &shaking(7.1));
    assert_eq!(alarms.level(), Level::Trip);
}

#[test]
fn a_window_that_could_not_measure_is_no_evidence() {
    let mut alarms = alarms(fixed());
    let no_scale = Report {
        um_per_px: None,
        ..shaking(90.0)
    };
    let unknown = Report {
        broad_band: Some(BroadBand::default()),
        ..shaking(90.0)
    };
    for report in [
        spoilt(90.0),
        no_scale,
        unknown,
        shaking(f32::NAN),
        shaking(f32::INFINITY),
    ] {
        assert_eq!(feed(&mut alarms, 10, &report), []);
    }
    feed(&mut alarms, 3, &shaking(5.0));
    assert_eq!(alarms.level(), Level::Warning);
    feed(&mut alarms, 50, &spoilt(0.0));
    assert_eq!(alarms.level(), Level::Warning);
    // What the noise hides is no more than so much: too much to clear it.
    let mut hidden = shaking(0.1);
    hidden.broad_band.as_mut().unwrap().sum.velocity_px_s = Some(Figure {
        value: 10.0,
        sd: 5.0,
        at_most: 440.0,
    });
    feed(&mut alarms, 50, &hidden);
    assert_eq!(alarms.level(), Level::Warning);
}

#[test]
fn silence_of_evidence_is_told() {
    let mut alarms = alarms(fixed());
    assert_eq!(feed(&mut alarms, 59, &spoilt(1.0)), []);
    assert_eq!(feed(&mut alarms, 100, &spoilt(1.0)), [Happening::Blind]);
    assert!(alarms.is_blind());
    assert_eq!(feed(&mut alarms, 2, &shaking(1.0)), [Happening::Sighted]);
}

#[test]
fn a_latched_alarm_stays_until_it_is_acknowledged() {
    let mut alarms = alarms(Rule {
        latch: true,
        ..fixed()
    });
    feed(&mut alarms, 5, &shaking(8.0));
    assert_eq!(feed(&mut alarms, 50, &shaking(1.0)), []);
    assert_eq!(alarms.level(), Level::Trip);
    let happened: std::vec::Vec<_> = alarms
        .acknowledge(Some(0))
        .iter()
        .map(|e| e.happening)
        .collect();
    assert_eq!(happened[0], Happening::Acknowledged);
    assert!(matches!(
        happened[1],
        Happening::Level {
            to: Level::Normal,
            ..
        }
    ));
    assert!(alarms.acknowledge(None).is_empty());
    // Acknowledged while it lasts: it clears by itself. A worse one must be acknowledged anew.
    feed(&mut alarms, 5, &shaking(5.0));
    alarms.acknowledge(None);
    assert_eq!(alarms.level(), Level::Warning);
    feed(&mut alarms, 5, &shaking(8.0));
    feed(&mut alarms, 5, &shaking(1.0));
    assert_eq!(alarms.level(), Level::Trip);
    alarms.acknowledge(None);
    feed(&mut alarms, 5, &shaking(5.0));
    alarms.acknowledge(None);
    feed(&mut alarms, 5, &shaking(1.0));
    assert_eq!(alarms.level(), Level::Normal);
}

#[test]
fn nothing_is_judged_or_learned_while_the_machine_stands() {
    let rule = Rule {
        warning: Some(Limit::LEARNED_WARNING),
        ..Rule::velocity("overall")
    };
    let running = Gate {
        quantity: rule.quantity,
        above: 1.0,
        settle_windows: 3,
    };
    let mut alarms = Alarms::new(Config {
        rules: [rule].into_iter().collect(),
        running: Some(running),
        learn_windows: 20,
        ..Config::default()
    })
    .unwrap();
    let learning = |alarms: &Alarms| alarms.statuses().next().unwrap().1.learning;
    assert_eq!(feed(&mut alarms, 100, &shaking(0.5)), []);
    assert_eq!(learning(&alarms), 20);
    // The second window starts it; three more pass until it is judged.
    assert_eq!(feed(&mut alarms, 4, &shaking(9.0)), [Happening::Started]);
    assert_eq!(learning(&alarms), 20);
    assert_eq!(feed(&mut alarms, 20, &shaking(3.0)).len(), 1);
    assert_eq!(learning(&alarms), 0);
    assert_eq!(feed(&mut alarms, 9, &shaking(3.3)), []);
    assert_eq!(feed(&mut alarms, 5, &shaking(3.4)).len(), 1);
    let stopped = feed(&mut alarms, 2, &shaking(0.2));
    assert_eq!((stopped[0], stopped.len()), (Happening::Stopped, 2));
    assert_eq!(
        (alarms.level(), alarms.is_running()),
        (Level::Normal, false)
    );
    feed(&mut alarms, 10, &shaking(3.4));
    assert_eq!(alarms.level(), Level::Warning);
    alarms.learn_again(None);
    assert_eq!(learning(&alarms), 20);
}

#[test]
fn a_baseline_outlives_a_restart() {
    let rule = Rule {
        trip: Some(Limit::Learned {
            share: 0.25,
            spreads: 4.0,
        }),
        ..Rule::velocity("overall")
    };
    let mut alarms = alarms(rule);
    let kept = Baseline {
        centre: 4.0,
        spread: 0.1,
    };
    alarms.set_baseline(0, kept);
    alarms.set_baseline(7, kept);
    let (_, status) = alarms.statuses().next().unwrap();
    assert_eq!((status.baseline, status.trip_at), (Some(kept), Some(5.0)));
    let wild = Baseline {
        centre: f32::NAN,
        spread: 0.1,
    };
    alarms.set_baseline(0, wild);
    assert_eq!(alarms.statuses().next().unwrap().1.learning, 300);
}

fn of_tone(part: Part, report: &Report) -> Reading {
    let quantity = Quantity {
        part,
        scaled: false,
    };
    quantity.of(report)
}

#[test]
fn tones_and_orders_are_found_by_their_frequency() {
    let near = |from_hz, to_hz| Part::Tone {
        from_hz,
        to_hz,
        measure: ToneMeasure::Amplitude,
    };
    let mut report = shaking(1.0);
    let mut second = peak(49.2, 0.3);
    second.harmonic = Some(2);
    report.peaks = [second, peak(87.3, 0.2), peak(88.0, 0.1)]
        .into_iter()
        .collect();
    assert_eq!(of_tone(near(87.0, 89.0), &report), Reading::Value(0.2));
    let order = |order| Part::Order {
        order,
        measure: ToneMeasure::Amplitude,
    };
    assert_eq!(of_tone(order(2), &report), Reading::Value(0.3));
    // 6 · 0.01 px · √(2/18000)
    let Reading::AtMost(most) = of_tone(order(1), &report) else {
        panic!("the first order is not in it")
    };
    assert!((most / 0.000_632_5 - 1.0).abs() < 1e-3, "{most}");
    // Beside the frame rate a tone could hide, and so could one that found no room.
    assert_eq!(of_tone(near(119.0, 121.0), &report), Reading::Unknown);
    let full = Report {
        warnings: Warnings::of(Warning::MoreTones),
        ..report.clone()
    };
    assert_eq!(of_tone(order(1), &full), Reading::Unknown);
    report.peaks[1].ambiguous = true;
    assert_eq!(of_tone(near(87.0, 89.0), &report), Reading::Unknown);
    report.peaks[0].harmonic = None;
    assert_eq!(of_tone(order(1), &report), Reading::Unknown);
    let velocity = Quantity {
        part: Part::Tone {
            from_hz: 49.0,
            to_hz: 50.0,
            measure: ToneMeasure::Velocity,
        },
        scaled: true,
    };
    // 2π · 49.2 Hz · 3 µm / √2
    let Reading::Value(mm_s) = velocity.of(&report) else {
        panic!("it is there")
    };
    assert!((mm_s - 0.6558).abs() < 1e-3, "{mm_s}");
}

#[test]
fn rules_that_cannot_be_are_refused() {
    let refused = |change: fn(&mut Rule)| {
        let mut rule = fixed();
        change(&mut rule);
        let rules = [rule].into_iter().collect();
        Alarms::new(Config {
            rules,
            ..Config::default()
        })
        .err()
    };
    assert_eq!(refused(|_| {}), None);
    assert_eq!(refused(|r| r.name.clear()), Some(RuleError::Name));
    assert_eq!(refused(|r| r.delay = 17), Some(RuleError::Delay));
    assert_eq!(
        refused(|r| r.hysteresis = f32::NAN),
        Some(RuleError::Hysteresis)
    );
    assert_eq!(
        refused(|r| r.trip = Some(Limit::Fixed(4.5))),
        Some(RuleError::Order)
    );
    assert_eq!(
        refused(|r| r.trip = Some(Limit::Fixed(f32::NAN))),
        Some(RuleError::Limit)
    );
    assert_eq!(
        refused(|r| (r.warning, r.trip) = (None, None)),
        Some(RuleError::NoLimit)
    );
    let twice = Config {
        rules: [fixed(), fixed()].into_iter().collect(),
        ..Config::default()
    };
    assert_eq!(twice.check(), Err(RuleError::Name));
}
