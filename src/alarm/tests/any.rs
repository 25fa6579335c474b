//! Whatever comes in.

extern crate std;

use super::*;
use proptest::prelude::*;

/// Any number at all, and often a usual one.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![any::<f32>(), 0.0_f32..1000.0]
}

fn any_report() -> impl Strategy<Value = Report> {
    let figures = (number(), number(), number());
    let peaks = proptest::collection::vec((number(), number(), any::<bool>(), 0_u8..4), 0..4);
    let whole = (number(), number(), any::<u32>(), number());
    (
        figures,
        peaks,
        whole,
        any::<u32>(),
        proptest::option::of(number()),
    )
        .prop_map(
            |((value, sd, at_most), peaks, (window_s, fps, lines, noise_px), bits, um_per_px)| {
                let figure = Some(Figure { value, sd, at_most });
                let mut report = shaking(1.0);
                let sum = &mut report.broad_band.as_mut().unwrap().sum;
                (sum.velocity_px_s, sum.displacement_px) = (figure, figure);
                report.peaks = peaks
                    .into_iter()
                    .map(|(hz, px, ambiguous, order)| Peak {
                        ambiguous,
                        harmonic: Some(order),
                        ..peak(hz, px)
                    })
                    .collect();
                Report {
                    window_s,
                    fps,
                    lines,
                    noise_px,
                    um_per_px,
                    warnings: Warnings::from_bits(bits),
                    ..report
                }
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever comes: no panic, no number that is not finite, and each change is told.
    #[test]
    fn any_reports_are_safe(reports in proptest::collection::vec(any_report(), 1..60)) {
        let measure = ToneMeasure::Velocity;
        let parts = [
            Part::Band(Band::Velocity),
            Part::Band(Band::Displacement),
            Part::Tone { from_hz: 10.0, to_hz: 500.0, measure },
            Part::Order { order: 1, measure },
        ];
        let rules = parts.into_iter().zip(["a", "b", "c", "d"]).map(|(part, name)| Rule {
            quantity: Quantity { part, scaled: true },
            warning: Some(Limit::LEARNED_WARNING),
            latch: name == "b",
            delay: 1,
            ..Rule { trip: Some(Limit::Fixed(100.0)), ..Rule::velocity(name) }
        });
        let gate = Gate {
            quantity: Rule::velocity("gate").quantity,
            above: 0.01,
            settle_windows: 0,
        };
        let mut alarms = Alarms::new(Config {
            rules: rules.collect(),
            running: Some(gate),
            learn_windows: 20,
            blind_windows: 3,
        }).unwrap();
        let mut shown = [Level::Normal; 4];
        for report in &reports {
            for event in alarms.window(report) {
                match (event.rule, event.happening) {
                    (Some(n), Happening::Level { from, to, value }) => {
                        prop_assert_eq!(shown[usize::from(n)], from);
                        shown[usize::from(n)] = to;
                        prop_assert!(value.is_none_or(f32::is_finite));
                    }
                    (Some(_), Happening::Learned { centre, spread }) => {
                        prop_assert!(centre.is_finite() && spread.is_finite());
                    }
                    _ => {}
                }
            }
            let now: std::vec::Vec<_> = alarms.statuses().map(|(_, s)| s.shown).collect();
            prop_assert_eq!(&now[..], &shown[..]);
        }
    }
}
