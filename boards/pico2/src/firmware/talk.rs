//! The serial line, in core 1's interrupt.

use super::compute::REPORTS;
use super::keep::Remote;
use super::shared::{CAMERA_STATE, CORE1_ALIVE, PLAN_ANEW, SETTINGS, losses};
use core::fmt::Write as _;
use core::sync::atomic::Ordering;
use embassy_futures::select::{Either4, select4};
use embassy_rp::uart::{BufferedUart, BufferedUartTx};
use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::{Read, Write};
use heapless::String;
use rowtone::link::Link;
use rowtone::link::outbox::Outbox;
use rowtone::link::settings::store::Started;
use rowtone::link::settings::{Board, Console};
use rowtone::report::Report;
use rowtone::wire::Format;
use rowtone_pico2::boot::{Boot, FirstReport};
use rowtone_pico2::losses::Losses;
use rowtone_pico2::plan::{DEFAULTS, LIMITS};
use static_cell::StaticCell;

/// Speed of the serial line.
pub(crate) const BAUD: u32 = 115_200;

/// Reports that are kept to be sent again.
/// (Not a constant: a `None` is not all zeros, and would lie in flash four times.)
static KEPT: StaticCell<[Option<Report>; 4]> = StaticCell::new();
static LINK: StaticCell<Link<'static>> = StaticCell::new();

const BOARD: Board = Board {
    version: [0, 1, 0],
    limits: LIMITS,
    defaults: DEFAULTS,
};

/// Says reports, answers commands.
#[embassy_executor::task]
pub(crate) async fn talk(uart: BufferedUart, boot: Boot, started: Started) {
    let (mut out, mut input) = uart.split();
    let Some(link) = set_up(started) else { return };
    let mut store = Remote;
    SETTINGS.lock(|s| s.replace(Some(*link.console().settings())));
    note(
        &mut out,
        link,
        format_args!("rowtone {}: {boot}", env!("CARGO_PKG_VERSION")),
    )
    .await;
    link.announce(now_us());
    let mut byte = [0];
    let mut said = Losses::default();
    let mut first = FirstReport::new(&boot);
    loop {
        CORE1_ALIVE.fetch_add(1, Ordering::Relaxed);
        // No more than fits the UART's buffer, so that this never waits while samples do.
        let bytes = poll(link, &mut store);
        let take = bytes.len().min(64);
        let taken = match bytes.get(..take) {
            Some(chunk) if !chunk.is_empty() => out.write(chunk).await.unwrap_or(take),
            _ => 0,
        };
        link.sent(taken);
        let wait = if taken > 0 { 0 } else { 20 };
        match select4(
            input.read(&mut byte),
            REPORTS.ready_to_receive(),
            CAMERA_STATE.wait(),
            Timer::after_millis(wait),
        )
        .await
        {
            Either4::First(Ok(1)) => {
                receive(link, byte[0], &mut store);
                publish(link);
            }
            // Noise on the line: what was garbled fails its check or is no command.
            Either4::First(_) => {}
            Either4::Second(()) => {
                take_report(link, &mut first);
                let losses = losses();
                if losses != said {
                    said = losses;
                    note(&mut out, link, format_args!("{losses}")).await;
                }
            }
            Either4::Third(state) => note(&mut out, link, format_args!("{state}")).await,
            Either4::Fourth(()) => {}
        }
    }
}

/// The line's end. Not inlined: it is made on the stack, which shall not be the task's for ever.
#[inline(never)]
fn set_up(started: Started) -> Option<&'static mut Link<'static>> {
    // The defaults are constants within the limits, as a test of the library shows.
    let console = Console::new(BOARD, started).ok()?;
    let outbox = Outbox::new(KEPT.init_with(|| [const { None }; 4]));
    Some(LINK.init_with(|| Link::new(console, outbox, BAUD)))
}

// Each has a frame of its own, and none of them is on the stack while another is: reports are 1.8 KB, and inlined
// the task would keep room for all of their copies at once.
#[inline(never)]
fn take_report(link: &mut Link<'_>, first: &mut FirstReport) {
    if let Ok(report) = REPORTS.try_receive() {
        link.push(first.marked(report));
    }
}

#[inline(never)]
fn poll<'l>(link: &'l mut Link<'_>, store: &mut Remote) -> &'l [u8] {
    link.poll(now_us(), store)
}

#[inline(never)]
fn receive(link: &mut Link<'_>, byte: u8, store: &mut Remote) {
    link.receive(byte, now_us(), store);
}

fn now_us() -> u64 {
    Instant::now().as_micros()
}

/// Settings that have changed go to core 0, which plans anew.
fn publish(link: &Link<'_>) {
    let settings = *link.console().settings();
    let changed = SETTINGS.lock(|s| s.replace(Some(settings)) != Some(settings));
    if changed {
        PLAN_ANEW.store(true, Ordering::Relaxed);
    }
}

/// A line for people: `#` and a sentence. A receiver of the text wire waits for `$` and does not see it; the
/// other wires have no place for it.
async fn note(out: &mut BufferedUartTx, link: &Link<'_>, text: core::fmt::Arguments<'_>) {
    if link.console().settings().wire != Format::Text {
        return;
    }
    let mut line = String::<160>::new();
    // What does not fit is left out.
    let _ = write!(line, "# {text}");
    let _ = out.write_all(line.as_bytes()).await;
    let _ = out.write_all(b"\r\n").await;
    Timer::after(Duration::from_micros(1)).await;
}
