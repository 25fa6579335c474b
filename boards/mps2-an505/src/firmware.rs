//! Clip in, reports out, figures at the end.

use crate::board::{counter::Counter, host, stack, uart::Uart};
use crate::lines::{ClipError, Lines, MAX_WIDTH};
use core::fmt::Write;
use cortex_m_rt::entry;
use rowtone::{
    camera::{Line, Pixels, Timing, TimingError},
    tracker::{Config, ConfigError, Outcome, Stage, Tracker},
};
use rowtone_mps2_an505::args::Args;
use rowtone_pico2::memory::TrackerMemory;
use static_cell::ConstStaticCell;

/// What is counted of one kind of work.
#[derive(Default)]
struct Count {
    times: u64,
    sum: u64,
    max: u64,
}

impl Count {
    fn add(&mut self, instructions: u64) {
        self.times += 1;
        self.sum += instructions;
        self.max = self.max.max(instructions);
    }

    fn mean(&self) -> u64 {
        self.sum / self.times.max(1)
    }
}

#[entry]
fn start() -> ! {
    let mut uart = Uart::new();
    let mut buffer = [0u8; 1024];
    let result = match host::command_line(&mut buffer).map(Args::parse) {
        Some(Ok(args)) => run(&args, &mut uart).map_err(|e| write!(uart, "{e}")),
        Some(Err(e)) => Err(write!(uart, "{e}")),
        None => Err(uart.write_str("command line: cannot be had")),
    };
    if result.is_err() {
        uart.write(b"\n");
    }
    host::exit(result.is_ok())
}

/// The RP2350 has room for a picture of 320 x 240; a narrower one may have more rows here.
static MEMORY: ConstStaticCell<TrackerMemory<{ 320 * 240 }, 480, MAX_WIDTH>> =
    ConstStaticCell::new(TrackerMemory::new());

fn run(args: &Args, uart: &mut Uart) -> Result<(), Failure> {
    let counter = cortex_m::Peripherals::take()
        .filter(|_| args.icount)
        .map(|p| Counter::new(p.SYST));
    let mut lines = Lines::open(args.clip, args.fps_uhz)?;
    let clip = *lines.clip();
    let timing =
        Timing::new(args.line_time_ps, args.exposure_ns, clip.rows).map_err(Failure::Timing)?;
    let mut config = Config::new(timing, clip.width);
    config.learn_frames = u16::MAX;
    config.columns_per_line = 4;
    let mut tracker = Tracker::new(config, MEMORY.take().lend()).map_err(Failure::Config)?;
    let mut pixels = [0u8; MAX_WIDTH];
    let mut per_line = Count::default();
    for _ in 0..3 {
        while let Some((frame, row)) = lines.next(&mut pixels)? {
            let start_ns = clip.frame_start_ns(frame) + timing.start_ns(row);
            let line = Line {
                frame,
                row,
                start_ns,
                pixels: Pixels::U8(&pixels[..usize::from(clip.width)]),
            };
            let start = counter.as_ref().map(Counter::start);
            let outcome = tracker.push(&line);
            if let (Some(counter), Some(start)) = (&counter, start) {
                if tracker.stage() == Stage::Tracking {
                    per_line.add(counter.instructions(start));
                }
            }
            if let Outcome::Measured(d) = outcome
                && row == 100
            {
                let _ = writeln!(uart, "{} {} {}", d.frame, d.time_ns, d.shift_px);
            }
        }
        tracker.end_round();
        lines.rewind()?;
    }
    let _ = writeln!(
        uart,
        "insn_per_line={} max_insn_per_line={} stack_max_bytes={} ram_static_bytes={} flash_bytes={}",
        per_line.mean(),
        per_line.max,
        stack::used_max_bytes(),
        stack::static_ram_bytes(),
        stack::flash_bytes()
    );
    Ok(())
}

/// Why a clip was not measured to its end.
enum Failure {
    Clip(ClipError),
    Timing(TimingError),
    Config(ConfigError),
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Clip(e) => e.fmt(f),
            Self::Timing(e) => e.fmt(f),
            Self::Config(e) => e.fmt(f),
        }
    }
}

impl From<ClipError> for Failure {
    fn from(e: ClipError) -> Self {
        Self::Clip(e)
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    let _ = writeln!(Uart::new(), "{info}");
    host::exit(false)
}
