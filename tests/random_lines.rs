//! Nothing that a camera can send makes the core panic: random bytes as lines of any width, row, frame and
//! time, under any configuration, through the whole chain. Tests run with overflow checks, so a sum that
//! leaves its type fails here too.

use proptest::{collection, prelude::*, sample};
use rowtone::camera::RawFormat;
use rowtone::camera::{Line, Pixels, Timing};
use rowtone::kernel::Kernel;
use rowtone::pipeline::{LineSide, ReportSide};
use rowtone::reference::band::Level;
use rowtone::spectrum;
use rowtone::timeline::{Binner, Displacement, Group};
use rowtone::tracker::{self, Axes, Config, Outcome};
use rowtone::wire::{Message, binary, text};
use rowtone_chance::{Chance, XorShiftStar};

struct Dice(XorShiftStar);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0.next()
    }

    fn below(&mut self, end: u64) -> u64 {
        (self.roll() >> 16) % end.max(1)
    }
}

/// What the lines look like.
#[derive(Clone, Copy, Debug)]
enum Look {
    /// Every pixel by chance.
    Noise,
    /// Black, white or half, whole lines or pixels by chance.
    Extreme,
    /// The same picture always: what learning likes, with a jump now and then.
    Picture,
    /// Nearly nothing: a count or two.
    Dim,
}

fn fill(dice: &mut Dice, look: Look, picture: &[u16], most: u16, line: &mut [u16]) {
    let flat = [0, most, most / 2][dice.below(3) as usize];
    let whole_line = dice.below(2) == 0;
    let jump = match dice.below(20) {
        0 => dice.below(line.len() as u64 + 1) as usize,
        _ => dice.below(3) as usize,
    };
    for (x, p) in line.iter_mut().enumerate() {
        *p = match look {
            Look::Noise => dice.roll() as u16,
            Look::Extreme if whole_line => flat,
            Look::Extreme => [0, most][dice.below(2) as usize],
            Look::Picture => {
                picture[(x + jump) % picture.len()].saturating_add(dice.below(3) as u16)
            }
            Look::Dim => dice.below(2) as u16,
        }
        .min(most);
    }
}

prop_compose! {
    fn any_config()(
        (line_time_ps, exposure_ns) in prop_oneof![
            Just((0, 0)), Just((20_000_000, 100_000)), any::<(u32, u32)>()
        ],
        rows in prop_oneof![1u16..4, 1u16..40], spare_rows in 0u16..3,
        width in prop_oneof![Just(16u16), 16u16..50, Just(257), Just(700)],
        bits in 8u8..=16, stride in 1u8..=2,
        learn_frames in prop_oneof![Just(1u16), 1u16..8],
        level in prop_oneof![Just(None), sample::select(Level::ALL.to_vec()).prop_map(Some)],
        search_px in prop_oneof![Just(0u16), Just(48), any::<u16>()],
        columns_per_line in prop_oneof![Just(0u16), Just(7), Just(u16::MAX)],
        kernel in sample::select(Kernel::all().collect::<Vec<_>>()),
        axes in sample::select(vec![Axes::X, Axes::Xy]),
    ) -> Config {
        let timing = Timing::new(line_time_ps, exposure_ns, rows + spare_rows).unwrap();
        Config { timing, width, rows, bits, stride, learn_frames, level, search_px, columns_per_line, kernel, axes }
    }
}

fn any_look() -> impl Strategy<Value = Look> {
    sample::select(vec![
        Look::Noise,
        Look::Extreme,
        Look::Picture,
        Look::Picture,
        Look::Dim,
    ])
}

/// One of ordinary, random and extreme.
fn time_of(dice: &mut Dice, ordinary: i64) -> i64 {
    match dice.below(400) {
        0 => i64::MIN,
        1 => i64::MAX,
        2 => dice.roll() as i64,
        3 => 0,
        _ => ordinary,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(160))]

    #[test]
    fn no_line_makes_the_chain_panic(
        config in any_config(), looks in collection::vec(any_look(), 1..4),
        mask in any::<u8>(), seed in 1u64.., first_frame in prop_oneof![Just(0u32), any::<u32>()],
        rows_per_sample in 1u16..8, wild in any::<bool>(), scattered in any::<bool>(), room in 0usize..300,
    ) {
        let mut dice = Dice(XorShiftStar(seed));
        let (width, rows) = (usize::from(config.width), usize::from(config.rows));
        let columns = (0..width).map(|_| match mask {
            0..100 => 255,
            100..200 => dice.roll() as u8,
            _ => 0,
        });
        let mut memory = Box::new(tracker::StaticStorage::<{ 700 * 40 }, 40, 700>::new());
        let mut vertical = Box::new(tracker::StaticVerticalStorage::<{ 700 * 40 }, 40, 700>::new());
        let lent = memory.lend().with_vertical(vertical.lend());
        lent.mask.iter_mut().zip(columns).for_each(|(weight, given)| *weight = given);
        let mut room = vec![0; room];
        let timing = config.timing;
        let group = Group::new(timing, rows_per_sample.min(timing.rows())).unwrap();
        let mut storage = Box::new(spectrum::StaticStorage::<1024, 64, 64, 256, 4>::new());
        let spectrum = spectrum::Config { window_ns: 300_000_000, hop_ns: 150_000_000, ..Default::default() };
        let mut lines = LineSide::new(config, group, lent).unwrap().with_line_room(&mut room);
        let mut reports = ReportSide::new(spectrum, group, storage.lend()).unwrap();
        let picture: Vec<u16> = (0..width + 40).map(|_| dice.roll() as u16 >> (16 - config.bits)).collect();
        let most = ((1u32 << config.bits) - 1) as u16;
        let mut pixels = vec![0u16; width];
        let mut frame = first_frame;
        for n in 0..45 {
            let look = looks[n * looks.len() / 45];
            for y in 0..rows {
                let row = if wild && dice.below(50) == 0 { dice.roll() as u16 } else { y as u16 };
                fill(&mut dice, look, &picture, if wild { u16::MAX } else { most }, &mut pixels);
                let bytes: Vec<u8>;
                let shorter = if wild && dice.below(50) == 0 { dice.below(width as u64) as usize } else { width };
                let seen = match config.bits == 8 || wild && dice.below(4) == 0 {
                    true => {
                        let words = pixels[..shorter].iter();
                        let format = [RawFormat::Raw8, RawFormat::Raw16][usize::from(scattered)];
                        bytes = match format {
                            RawFormat::Raw16 => words.flat_map(|&p| (p << 8).to_le_bytes()).collect(),
                            _ => words.map(|&p| p as u8).collect(),
                        };
                        format.upper_line(&bytes, shorter, &mut []).unwrap()
                    }
                    false => Pixels::U16(&pixels[..shorter]),
                };
                let ordinary = (n as i64) * 20_000_000 + timing.start_ns(row);
                let start_ns = if wild { time_of(&mut dice, ordinary) } else { ordinary };
                let line = Line { frame, row, start_ns, pixels: seen };
                // Row by row in even frames, in one go in odd ones.
                let reading = if frame % 2 == 0 {
                    let Outcome::Measured(d) = lines.push_row(&line) else { continue };
                    prop_assert_eq!(d.vertical.is_some(), config.axes == Axes::Xy);
                    let v = d.vertical.unwrap_or_default();
                    // A row whose edges all lie along it tells of y alone.
                    let known = d.information_per_px2 > 0.0
                        || d.information_per_px2 == 0.0 && v.information_per_px2 > 0.0;
                    prop_assert!(d.shift_px.is_finite() && known, "{d:?}");
                    prop_assert!(v.shift_px.is_finite() && v.coupling.is_finite(), "{d:?}");
                    lines.bin(d)
                } else {
                    lines.push(&line).copied()
                };
                let Some(reading) = reading else { continue };
                if dice.below(100) == 0 {
                    lines.drop_reading(&reading);
                } else if reports.push(reading) && let Some(report) = reports.report() {
                    say(report);
                }
            }
            if dice.below(60) == 0 {
                lines.relearn();
            }
            frame = match wild && dice.below(10) == 0 {
                true => dice.roll() as u32,
                false => frame.wrapping_add(1),
            };
            if dice.below(15) == 0 {
                lines.end_round();
            }
        }
        if let Some(reading) = lines.finish() {
            reports.push(reading);
        }
        reports.push(lines.rest());
        if let Some(report) = reports.finish() {
            say(report);
        }
    }

    /// Displacements that no tracker would give do no harm either.
    #[test]
    fn no_displacement_makes_the_rest_panic(
        rows in collection::vec(
            (any::<u32>(), any::<u16>(), any::<i64>(), any::<f32>(), any::<f32>(), any::<bool>()), 1..200
        ),
        (line_time_ps, exposure_ns) in any::<(u32, u32)>(), height in 1u16..200, rows_per_sample in 1u16..20,
    ) {
        let timing = Timing::new(line_time_ps, exposure_ns, height).unwrap();
        let group = Group::new(timing, rows_per_sample.min(height)).unwrap();
        let mut binner = Binner::new(group);
        let mut storage = Box::new(spectrum::StaticStorage::<1024, 64, 200, 256, 4>::new());
        let mut reports = match ReportSide::new(spectrum::Config::default(), group, storage.lend()) {
            Ok(reports) => reports,
            Err(_) => return Ok(()),
        };
        for (n, (frame, row, time_ns, shift_px, information_per_px2, tame)) in (0i64..).zip(rows) {
            let d = Displacement {
                frame: if tame { (n / 4) as u32 } else { frame },
                row: row % height,
                time_ns: if tame { n * 5_000_000 } else { time_ns },
                shift_px,
                information_per_px2: information_per_px2.abs(),
                vertical: None,
            };
            let Some(sample) = binner.push(d) else { continue };
            if reports.push(sample) && let Some(report) = reports.report() {
                say(report);
            }
        }
        if let Some(report) = reports.finish() {
            say(report);
        }
    }
}

/// A report that was made can be said, or is refused with a reason.
fn say(report: rowtone::report::Report) {
    let message = Message::Report { session: 1, report };
    let mut line = [0; text::MAX_LINE];
    let _ = text::encode_to_slice(&message, &mut line);
    let mut frame = [0; binary::MAX_FRAME];
    let _ = binary::encode_to_slice(&message, &mut frame);
}
