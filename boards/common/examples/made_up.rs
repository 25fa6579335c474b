//! A made-up board, whole: a camera, a serial line, and the nine steps of `boards/README.md` between
//! them. It runs on a desktop and says on standard output what a board would send:
//!
//! ```text
//! cargo run --release -p rowtone-board --example made_up
//! ```

use std::io::{self, Write};

use rowtone::link::settings::store::{Nowhere, Started};
use rowtone::link::settings::{Board, Console, Limits, Region, Settings};
use rowtone::link::{Link, outbox::Outbox};
use rowtone::pipeline::Pipeline;
use rowtone::tracker::StaticStorage;
use rowtone::wire::SettingsOrigin;
use rowtone_board::memory::SpectrumMemory;
use rowtone_board::plan::{CameraTiming, Plan};

/// Step 1: the camera. 96 x 120 pixels, 50 frames a second, 100 µs a row.
const WIDTH: usize = 96;
const ROWS: usize = 120;
const CAMERA: CameraTiming = CameraTiming {
    line_time_ps: 100_000_000,
    exposure_ns: 0,
    frame_ns: 20_000_000,
};

/// What the machine before it does: it swings at this frequency, Hz, by this much, px.
pub(crate) const SWING_HZ: f64 = 31.7;
/// See [`SWING_HZ`].
pub(crate) const SWING_PX: f64 = 0.25;

/// A row of the surface before the camera: a texture that has moved.
fn read_row(start_ns: i64, row: u16) -> [u8; WIDTH] {
    let phase = std::f64::consts::TAU * SWING_HZ * start_ns as f64 * 1e-9;
    let moved = SWING_PX * phase.sin();
    // SplitMix64 (Steele, Lea and Flood 2014) of time and column: what repeats would be a motion of its own.
    let noise = |x: usize| {
        let mut h = start_ns as u64 ^ (x as u64) << 48;
        h = (h ^ h >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h = (h ^ h >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((h ^ h >> 31) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    std::array::from_fn(|x| {
        let at = x as f64 - moved + 0.31 * f64::from(row);
        (120.0 + 50.0 * (0.7 * at).sin() + 30.0 * (0.37 * at).cos() + noise(x)) as u8
    })
}

/// Step 2: memory, lent to the core; statics on a microcontroller.
struct Memory {
    picture: StaticStorage<{ WIDTH * ROWS }, ROWS, WIDTH>,
    windows: SpectrumMemory,
}

/// Step 3: what the board is, and what it can be set to.
const BOARD: Board = Board {
    version: [0, 1, 0],
    limits: Limits {
        width: WIDTH as u16,
        height: ROWS as u16,
        min_width: 32,
        max_window_s: 1.5,
    },
    defaults: Settings::DEFAULT,
};

/// Measures for so many frames and writes what the board sends to `line`.
///
/// # Errors
/// Those of the line.
pub(crate) fn run(frames: u32, line: &mut impl Write) -> io::Result<()> {
    let mut memory = Box::new(Memory {
        picture: StaticStorage::new(),
        windows: SpectrumMemory::new(),
    });
    // Step 4: the start, and settings kept from the time before (this board keeps none).
    let started = Started {
        session: 1,
        settings: None,
        origin: SettingsOrigin::Defaults,
    };
    let mut kept = [const { None }; 4];
    let console = Console::new(BOARD, started).expect("the defaults are within the limits");
    let mut link = Link::new(console, Outbox::new(&mut kept), 115_200);
    // Step 5: settings and timing make a plan.
    let whole = Region {
        x: 0,
        y: 0,
        width: WIDTH as u16,
        height: ROWS as u16,
    };
    let settings = *link.console().settings();
    let plan = Plan::new(&settings, whole, &CAMERA).expect("a timing that the core takes");
    // Step 6: the pipeline.
    let mut pipeline = Pipeline::new(
        plan.tracker(),
        plan.group,
        plan.spectrum,
        memory.picture.lend(),
        memory.windows.lend(),
    )
    .expect("memory for this plan");
    for frame in 0..frames {
        for row in 0..ROWS as u16 {
            // Step 7: each row, with its frame and its time, goes in as it comes.
            let frame_ns = i64::from(frame) * CAMERA.frame_ns as i64;
            let start_ns = frame_ns + plan.cut.timing.start_ns(row);
            let pixels = read_row(start_ns, row);
            let Some(cut) = plan.cut.line(frame, frame_ns, row, &pixels) else {
                continue;
            };
            // Step 8: a report goes to the serial line.
            if let Some(report) = pipeline.push(&cut) {
                link.push(report);
            }
            // Step 9: the line takes what it can, and bytes that came go to `Link::receive`.
            let now_us = start_ns as u64 / 1000;
            let sent = line.write(link.poll(now_us, &mut Nowhere))?;
            link.sent(sent);
        }
    }
    line.flush()
}

#[allow(dead_code, reason = "the test runs it by its own")]
fn main() -> io::Result<()> {
    run(250, &mut io::stdout().lock())
}
