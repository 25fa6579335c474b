//! Clip in, reports out, figures at the end.

use crate::board::{counter::Counter, host, stack, uart::Uart};
use crate::lines::{ClipError, Lines, MAX_WIDTH};
use core::fmt::Write;
use cortex_m_rt::entry;
use rowtone::camera::{Line, Pixels, Timing};
use rowtone_mps2_an505::args::Args;

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

fn run(args: &Args, uart: &mut Uart) -> Result<(), ClipError> {
    let counter = cortex_m::Peripherals::take()
        .filter(|_| args.icount)
        .map(|p| Counter::new(p.SYST));
    let mut lines = Lines::open(args.clip, args.fps_uhz)?;
    let clip = *lines.clip();
    let timing = Timing::new(args.line_time_ps, args.exposure_ns, clip.rows).ok();
    let mut pixels = [0u8; MAX_WIDTH];
    let mut per_line = Count::default();
    let mut sum = 0u32;
    while let Some((frame, row)) = lines.next(&mut pixels)? {
        let start_ns = clip.frame_start_ns(frame) + timing.map_or(0, |t| t.start_ns(row));
        let line = Line {
            frame,
            row,
            start_ns,
            pixels: Pixels::U8(&pixels[..usize::from(clip.width)]),
        };
        let start = counter.as_ref().map(Counter::start);
        if let Pixels::U8(p) = line.pixels {
            sum = core::hint::black_box(p)
                .iter()
                .fold(sum, |s, &p| s.wrapping_add(p.into()));
        }
        if let (Some(counter), Some(start)) = (&counter, start) {
            per_line.add(counter.instructions(start));
        }
    }
    let _ = writeln!(
        uart,
        "frames={} lines={} sum={sum} insn_per_line={} max_insn_per_line={} stack_max_bytes={} ram_static_bytes={} flash_bytes={}",
        lines.frames(),
        u64::from(lines.frames()) * u64::from(clip.rows),
        per_line.mean(),
        per_line.max,
        stack::used_max_bytes(),
        stack::static_ram_bytes(),
        stack::flash_bytes()
    );
    Ok(())
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    let _ = writeln!(Uart::new(), "{info}");
    host::exit(false)
}
