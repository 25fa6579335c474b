//! Clip in, reports out, figures at the end.

use crate::lines::{ClipError, Lines, MAX_WIDTH, Pixels8};
use core::fmt::{self, Write};
use cortex_m_rt::entry;
use rowtone::camera::{Timing, TimingError};
use rowtone::pipeline::{LineSide, Reading, ReportSide};
use rowtone::report::Report;
use rowtone::spectrum;
use rowtone::timeline::{BinnerError, Group};
use rowtone::tracker::{self, Axes, StaticStorage, StaticVerticalStorage};
use rowtone::wire::{Message, text};
use rowtone_board::memory::{SpectrumMemory, rows_per_sample};
use rowtone_mps2_an505::args::Args;
use rowtone_mps2_an505::board::{
    counter::{Counter, Start},
    host,
    stack::{self, Mark},
    uart::Uart,
};
use rowtone_mps2_an505::figures::Count;
use static_cell::{ConstStaticCell, StaticCell};

/// The RP2350 has room for a picture of 320 x 240; a narrower one may have more rows here.
static LINES: ConstStaticCell<StaticStorage<{ 320 * 240 }, 480, MAX_WIDTH>> =
    ConstStaticCell::new(StaticStorage::new());
/// What measuring along both axes needs besides; its coefficients, a byte a pixel, lie where a picture of 256 x 200 or less
/// leaves room for them in that memory.
static VERTICAL: ConstStaticCell<StaticVerticalStorage<0, 240, MAX_WIDTH>> =
    ConstStaticCell::new(StaticVerticalStorage::new());
static SPECTRUM: ConstStaticCell<SpectrumMemory> = ConstStaticCell::new(SpectrumMemory::new());
static REPORTS: StaticCell<ReportSide<'static>> = StaticCell::new();

/// Frames that are learned from, at the clip's start; as `rowtone analyze` does it.
const LEARN_FRAMES: u32 = 30;

#[entry]
fn start() -> ! {
    let mut uart = Uart::new();
    let mut buffer = [0u8; 1024];
    let result = match host::command_line(&mut buffer).map(Args::parse) {
        Some(Ok(args)) => run(&args, &mut uart).map_err(|e| writeln!(uart, "{e}")),
        Some(Err(e)) => Err(writeln!(uart, "{e}")),
        None => Err(writeln!(uart, "command line: cannot be had")),
    };
    host::exit(result.is_ok())
}

fn run(args: &Args, uart: &mut Uart) -> Result<(), Failure> {
    let counter = cortex_m::Peripherals::take()
        .filter(|_| args.icount)
        .map(|p| Counter::new(p.SYST));
    let lines = Lines::open(args.clip, args.fps_uhz)?;
    let clip = *lines.clip();
    let timing = Timing::new(args.line_time_ps, args.exposure_ns, clip.rows)?;
    let window_ns = i64::from(args.window_ms) * 1_000_000;
    let frames = clip.frames_within(window_ns);
    let group = Group::new(timing, rows_per_sample(timing, frames))?;
    let mut tracking = tracker::Config::new(timing, clip.width);
    // Rounds end when this program says so.
    tracking.learn_frames = u16::MAX;
    tracking.columns_per_line = rowtone_board::memory::COLUMNS_PER_LINE;
    let mut lent = LINES.take().lend();
    if args.both_axes {
        tracking.axes = Axes::Xy;
        let pixels = usize::from(clip.width) * usize::from(clip.rows);
        let whole = core::mem::take(&mut lent.mean);
        let (mean, rest) = whole.split_at_mut(pixels.min(whole.len()));
        lent.mean = mean;
        let mut vertical = VERTICAL.take().lend();
        vertical.coefficients = bytemuck::cast_slice_mut(rest);
        lent = lent.with_vertical(vertical);
    }
    let config = spectrum::Config {
        window_ns,
        hop_ns: window_ns / 2,
        max_passes: rowtone_board::memory::MAX_PASSES,
        // As a board without a scale: none of its wires would carry them.
        broad_band: false,
        ..spectrum::Config::default()
    };
    let mut board = Board {
        uart,
        counter,
        lines,
        side: LineSide::new(tracking, group, lent)?,
        reports: reports(config, group)?,
        timing,
        per_line: Count::default(),
        per_nothing: Count::default(),
        per_spectrum: Count::default(),
        per_learning_line: Count::default(),
        per_round: Count::default(),
        spectrum_stack_bytes: 0,
        encode_stack_bytes: 0,
        stack_bytes: 0,
    };
    board.learn()?;
    board.measure()?;
    if args.icount {
        board.say_figures();
    }
    Ok(())
}

/// Not inlined: the reports takes 8 KiB, which shall be on the stack only while it is made.
#[inline(never)]
fn reports(
    config: spectrum::Config,
    group: Group,
) -> Result<&'static mut ReportSide<'static>, spectrum::ConfigError> {
    Ok(REPORTS.init(ReportSide::new(config, group, SPECTRUM.take().lend())?))
}

struct Board<'a> {
    uart: &'a mut Uart,
    counter: Option<Counter>,
    lines: Lines,
    side: LineSide<'static>,
    reports: &'static mut ReportSide<'static>,
    timing: Timing,
    per_line: Count,
    /// Nothing at all: what counting a line takes itself. It is taken off.
    per_nothing: Count,
    per_spectrum: Count,
    per_learning_line: Count,
    /// What ends a round of learning.
    per_round: Count,
    /// Stack of computing a window, and of writing its report.
    spectrum_stack_bytes: usize,
    encode_stack_bytes: usize,
    /// Most of it in use, in all.
    stack_bytes: usize,
}

impl Board<'_> {
    /// Both rounds over the same first frames. A board with a camera has no memory to see frames twice:
    /// it takes the frames as they come for both.
    fn learn(&mut self) -> Result<(), Failure> {
        let mut pixels = Pixels8([0; MAX_WIDTH]);
        for _ in 0..2 {
            while let Some(line) = self.lines.next(&mut pixels, &self.timing)? {
                if line.frame >= LEARN_FRAMES {
                    break;
                }
                let start = self.counter.as_ref().map(Counter::start);
                // It gives nothing yet.
                self.side.push(&line);
                if let (Some(counter), Some(start)) = (&self.counter, start) {
                    self.per_learning_line.add(counter.instructions(start));
                }
            }
            let start = self.counter.as_ref().map(Counter::start);
            self.side.end_round();
            if let (Some(counter), Some(start)) = (&self.counter, start) {
                self.per_round.add(counter.instructions(start));
            }
            self.lines.rewind()?;
        }
        Ok(())
    }

    fn measure(&mut self) -> Result<(), Failure> {
        let mut pixels = Pixels8([0; MAX_WIDTH]);
        while let Some(line) = self.lines.next(&mut pixels, &self.timing)? {
            // What counting itself takes, in the same surroundings.
            let start = self.counter.as_ref().map(Counter::start);
            core::hint::black_box(&line);
            if let (Some(counter), Some(start)) = (&self.counter, start) {
                self.per_nothing.add(counter.instructions(start));
            }
            let start = self.counter.as_ref().map(Counter::start);
            let reading = self.side.push(&line);
            if let (Some(counter), Some(start)) = (&self.counter, start) {
                self.per_line.add(counter.instructions(start));
            }
            let reading = reading.copied();
            self.collect(reading);
        }
        let last = self.side.finish();
        self.collect(last);
        let rest = self.side.rest();
        self.collect(Some(rest));
        let mark = self.mark();
        let start = self.counter.as_ref().map(Counter::start);
        let report = self.reports.finish();
        self.count_and_say(mark, start, report);
        Ok(())
    }

    fn collect(&mut self, reading: Option<Reading>) {
        if reading.is_some_and(|reading| self.reports.push(reading)) {
            let mark = self.mark();
            let start = self.counter.as_ref().map(Counter::start);
            let report = self.reports.report();
            self.count_and_say(mark, start, report);
        }
    }

    /// From here on the stack is measured anew.
    fn mark(&mut self) -> Mark {
        let mark = Mark::new();
        self.stack_bytes = self.stack_bytes.max(mark.before_bytes());
        mark
    }

    fn count_and_say(&mut self, mark: Mark, start: Option<Start>, report: Option<Report>) {
        let Some(report) = report else { return };
        if let (Some(counter), Some(start)) = (&self.counter, start) {
            self.per_spectrum.add(counter.instructions(start));
        }
        self.spectrum_stack_bytes = self.spectrum_stack_bytes.max(mark.since_bytes());
        let mark = self.mark();
        if let Err(e) = text::encode(&Message::Report { session: 1, report }, self.uart) {
            let _ = writeln!(self.uart, "report: {e:?}");
        }
        self.encode_stack_bytes = self.encode_stack_bytes.max(mark.since_bytes());
    }

    fn say_figures(&mut self) {
        let _ = writeln!(
            self.uart,
            "insn_per_line={} max_insn_per_line={} insn_per_spectrum={} stack_max_bytes={} ram_static_bytes={} \
             flash_bytes={} min_insn_per_line={} max_insn_per_spectrum={} \
             spectrum_stack_bytes={} encode_stack_bytes={} insn_per_learning_line={} max_insn_per_learning_line={} \
             max_insn_per_round={} insn_of_counting={}",
            self.per_line.mean() - self.per_nothing.min(),
            self.per_line.max() - self.per_nothing.min(),
            self.per_spectrum.mean(),
            self.stack_bytes.max(stack::used_max_bytes()),
            stack::static_ram_bytes(),
            stack::flash_bytes(),
            self.per_line.min() - self.per_nothing.min(),
            self.per_spectrum.max(),
            self.spectrum_stack_bytes,
            self.encode_stack_bytes,
            self.per_learning_line.mean(),
            self.per_learning_line.max(),
            self.per_round.max(),
            self.per_nothing.min(),
        );
    }
}

/// Why a clip was not measured to its end.
enum Failure {
    Clip(ClipError),
    Timing(TimingError),
    Group(BinnerError),
    Tracker(tracker::ConfigError),
    Spectrum(spectrum::ConfigError),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Clip(e) => e.fmt(f),
            Self::Timing(e) => e.fmt(f),
            Self::Group(e) => e.fmt(f),
            Self::Tracker(e) => e.fmt(f),
            Self::Spectrum(e) => e.fmt(f),
        }
    }
}

macro_rules! failure_from {
    ($($kind:ident: $error:ty),*) => {
        $(impl From<$error> for Failure {
            fn from(e: $error) -> Self {
                Self::$kind(e)
            }
        })*
    };
}
failure_from!(
    Clip: ClipError, Timing: TimingError, Group: BinnerError,
    Tracker: tracker::ConfigError, Spectrum: spectrum::ConfigError
);
