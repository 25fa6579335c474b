//! The PIO program, executed against a camera's pins.

use rowtone_chance::SplitMix;

use crate::camera::{Camera, Fault};
use crate::machine::Machine;
use rowtone_pico2::capture::{
    HREF, LINE_PIXELS, LINE_WORDS, missing_samples, program, samples_less_one,
};
use rowtone_pico2::hm01b0::Bus;

/// Words of every row of one frame, taken as soon as they are there.
fn capture(camera: &mut Camera, frame: u32, phase: f64) -> Vec<Vec<u32>> {
    let mut machine = Machine::new(&program(camera.bus), HREF);
    machine.tx.push_back(samples_less_one(camera.bus));
    let mut words = vec![];
    for pins in camera.frame(frame).cycles(phase) {
        machine.cycle(pins);
        words.extend(machine.rx.drain(..));
    }
    assert!(!machine.rx_stalled);
    words.chunks(LINE_WORDS).map(<[u32]>::to_vec).collect()
}

fn pixels(words: &[u32]) -> Vec<u8> {
    words[..LINE_WORDS - 1]
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .collect()
}

fn truth(frame: u32, row: usize) -> Vec<u8> {
    (0..LINE_PIXELS as u16)
        .map(|column| Camera::pixel(frame, row as u16, column))
        .collect()
}

fn camera(bus: Bus, pclk_hz: f64, seed: u64) -> Camera {
    let mut camera = Camera::new(bus, pclk_hz);
    camera.rows = 6;
    camera.random = SplitMix(seed);
    camera
}

/// Whether every pixel of some rows comes through.
fn comes_through(mut camera: Camera, phase: f64) -> bool {
    let rows = capture(&mut camera, 1, phase);
    rows.len() == usize::from(camera.rows)
        && rows.iter().enumerate().all(|(row, words)| {
            words.len() == LINE_WORDS
                && words[LINE_WORDS - 1] == u32::MAX
                && pixels(words) == truth(1, row)
        })
}

/// The pixel clocks that the boards use: 25 MHz master clock / 4, / 2 and 24 MHz.
const CLOCKS: [(Bus, f64); 3] = [
    (Bus::Bits8, 6.25e6),
    (Bus::Bits4, 12.5e6),
    (Bus::Bits1, 24e6),
];

#[test]
fn every_pixel_comes_through_at_every_phase() {
    for (bus, hz) in CLOCKS {
        for eighth in 0..8 {
            assert!(
                comes_through(camera(bus, hz, 1), f64::from(eighth) / 8.0),
                "{bus:?} phase {eighth}/8"
            );
        }
    }
}

#[test]
fn every_pixel_comes_through_jitter_skew_and_a_crooked_clock() {
    for (bus, hz) in CLOCKS {
        for seed in 0..4 {
            for duty in [0.45, 0.55] {
                let mut camera = camera(bus, hz, seed);
                (camera.duty, camera.jitter, camera.skew_ns) = (duty, 0.05, 2.0);
                camera.rows = 3;
                assert!(
                    comes_through(camera, 0.3),
                    "{bus:?} duty {duty} seed {seed}"
                );
            }
        }
    }
}

/// How fast a pixel clock may be: the fastest one bit a clock at 150 MHz, no jitter.
#[test]
fn fastest_pixel_clock() {
    let fastest = (20..40).take_while(|&mhz| {
        (0..8).all(|eighth| {
            comes_through(
                camera(Bus::Bits1, f64::from(mhz) * 1e6, 1),
                f64::from(eighth) / 8.0,
            )
        })
    });
    let mhz = fastest.last().expect("not even 20 MHz");
    println!("fastest pixel clock without jitter: {mhz} MHz");
    assert!(mhz >= 27, "{mhz} MHz");
}

#[test]
fn short_row_is_padded_and_counted_and_the_next_is_whole() {
    for (bus, hz) in CLOCKS {
        for short in [1, 200, 319] {
            let mut camera = camera(bus, hz, 3);
            camera.fault = Some(Fault::Short {
                row: 2,
                pixels: short,
            });
            let rows = capture(&mut camera, 1, 0.0);
            assert_eq!(rows.len(), 6, "{bus:?}");
            for (row, words) in rows.iter().enumerate() {
                let missing = missing_samples(words[LINE_WORDS - 1]);
                let short = usize::from(short);
                if row == 2 {
                    assert_eq!(
                        missing,
                        (LINE_PIXELS - short) as u32 * bus.clocks_per_pixel(),
                        "{bus:?}"
                    );
                    assert_eq!(pixels(words)[..short], truth(1, row)[..short], "{bus:?}");
                } else {
                    assert_eq!(missing, 0);
                    assert_eq!(pixels(words), truth(1, row), "{bus:?} row {row}");
                }
            }
        }
    }
}

/// The four pixels that are not taken hide up to four lost pixel clocks of an 8-bit bus; more are told.
#[test]
fn lost_clocks_shorten_their_own_row_and_never_shift_the_next() {
    for (lost, missing) in [(4, 0), (5, 1), (10, 6)] {
        let mut camera = camera(Bus::Bits8, 6.25e6, 5);
        camera.fault = Some(Fault::LostClocks {
            row: 3,
            clocks: lost,
        });
        let rows = capture(&mut camera, 7, 0.0);
        assert_eq!(rows.len(), 6);
        for (row, words) in rows.iter().enumerate() {
            if row == 3 {
                assert_eq!(missing_samples(words[LINE_WORDS - 1]), missing);
                assert_eq!(pixels(words)[..100], truth(7, row)[..100]);
            } else {
                assert_eq!(pixels(words), truth(7, row), "row {row}");
            }
        }
    }
}

/// A DMA that is not ready makes the machine stall, and it says so; the row after the next HREF is whole.
#[test]
fn stalled_fifo_is_told_and_rows_stay_apart() {
    let mut camera = camera(Bus::Bits8, 6.25e6, 1);
    let mut machine = Machine::new(&program(Bus::Bits8), HREF);
    machine.tx.push_back(samples_less_one(Bus::Bits8));
    let mut words = vec![];
    for (n, pins) in camera.frame(1).cycles(0.0).enumerate() {
        machine.cycle(pins);
        // Nobody takes words for a quarter of a line, in the middle of row 1.
        let silent = (44_000..46_500).contains(&n);
        if !silent {
            words.extend(machine.rx.drain(..));
        }
    }
    assert!(machine.rx_stalled);
    let rows: Vec<_> = words.chunks(LINE_WORDS).collect();
    assert_eq!(rows.len(), 6);
    assert_ne!(
        missing_samples(rows[1][LINE_WORDS - 1]),
        0,
        "the row that stalled is short"
    );
    for row in [0, 2, 3, 4, 5] {
        assert_eq!(pixels(rows[row]), truth(1, row), "row {row}");
    }
}
