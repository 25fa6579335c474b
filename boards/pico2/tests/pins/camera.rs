//! The camera's pins in time: D0.., PCLK, HREF and VSYNC, with the jitter and the faults of a real one.

use rowtone_chance::{Chance, SplitMix};
use rowtone_pico2::capture::{HREF, PCLK};
use rowtone_pico2::hm01b0::{Bus, ROWS, WIDTH};

/// VSYNC's pin, counted from D0.
pub(crate) const VSYNC: u8 = 10;
/// Time of one cycle of the state machine at 150 MHz, ns.
pub(crate) const CYCLE_NS: f64 = 1000.0 / 150.0;

/// Evenly from −1 to 1.
fn sign_unit(random: &mut SplitMix) -> f64 {
    2.0 * random.unit() - 1.0
}

/// What happens to one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// HREF falls after this many pixels.
    Short { row: u16, pixels: u16 },
    /// This many pixel clocks do not come, in the middle of the row.
    LostClocks { row: u16, clocks: u32 },
}

/// A camera whose pins can be recorded.
pub(crate) struct Camera {
    pub(crate) bus: Bus,
    pub(crate) pclk_hz: f64,
    /// Pixels from line to line.
    pub(crate) line_length_px: u32,
    /// Largest change of each half period of the clock, of its length.
    pub(crate) jitter: f64,
    /// Share of a period that the clock is high.
    pub(crate) duty: f64,
    /// Data and HREF change up to this long after (or before) the clock's falling edge, ns.
    pub(crate) skew_ns: f64,
    pub(crate) rows: u16,
    pub(crate) fault: Option<Fault>,
    pub(crate) random: SplitMix,
}

impl Camera {
    pub(crate) fn new(bus: Bus, pclk_hz: f64) -> Self {
        Self {
            bus,
            pclk_hz,
            line_length_px: 420,
            jitter: 0.0,
            duty: 0.5,
            skew_ns: 0.0,
            rows: ROWS,
            fault: None,
            random: SplitMix(1),
        }
    }

    /// The pixel that the camera sees at this place.
    pub(crate) fn pixel(frame: u32, row: u16, column: u16) -> u8 {
        let place = u64::from(frame) << 32 | u64::from(row) << 16 | u64::from(column);
        SplitMix(place).next() as u8
    }

    /// One frame: VSYNC rises two lines before the first row and falls after the last.
    pub(crate) fn frame(&mut self, frame: u32) -> Pins {
        let mut pins = Pins {
            edges: vec![],
            now_ns: 0.0,
            level: 0,
        };
        self.blank_line(&mut pins);
        pins.set(VSYNC, true, 0.0);
        self.blank_line(&mut pins);
        self.blank_line(&mut pins);
        for row in 0..self.rows {
            self.row(&mut pins, frame, row);
        }
        self.blank_line(&mut pins);
        pins.set(VSYNC, false, 0.0);
        self.blank_line(&mut pins);
        pins
    }

    fn blank_line(&mut self, pins: &mut Pins) {
        for _ in 0..self.line_length_px * self.bus.clocks_per_pixel() {
            self.clock(pins, 0, false);
        }
    }

    fn row(&mut self, pins: &mut Pins, frame: u32, row: u16) {
        let (per_pixel, bits) = (self.bus.clocks_per_pixel(), u32::from(self.bus.bits()));
        let mut seen = u32::from(WIDTH);
        let mut lost = 0..0;
        match self.fault {
            Some(Fault::Short { row: at, pixels }) if at == row => seen = pixels.into(),
            Some(Fault::LostClocks { row: at, clocks }) if at == row => lost = 100..100 + clocks,
            _ => {}
        }
        for clock in 0..self.line_length_px * per_pixel {
            let column = clock / per_pixel;
            let href = column < seen;
            let data = if href {
                let shift = clock % per_pixel * bits;
                u32::from(Self::pixel(frame, row, column as u16)) >> shift & ((1 << bits) - 1)
            } else {
                self.random.next() as u32 & ((1 << bits) - 1) // the bus is not quiet between lines
            };
            if lost.contains(&clock) {
                pins.now_ns += 1e9 / self.pclk_hz;
                continue;
            }
            self.clock(pins, data, href);
        }
    }

    /// The clock falls, data and HREF change, the clock rises.
    fn clock(&mut self, pins: &mut Pins, data: u32, href: bool) {
        let period = 1e9 / self.pclk_hz;
        let skew = self.skew_ns * sign_unit(&mut self.random);
        pins.set(PCLK, false, 0.0);
        pins.set_data(data, self.bus.bits(), skew);
        pins.set(HREF, href, self.skew_ns * sign_unit(&mut self.random));
        pins.now_ns +=
            period * (1.0 - self.duty) * (1.0 + self.jitter * sign_unit(&mut self.random));
        pins.set(PCLK, true, 0.0);
        pins.now_ns += period * self.duty * (1.0 + self.jitter * sign_unit(&mut self.random));
    }
}

/// All changes of the pins, in time.
pub(crate) struct Pins {
    edges: Vec<(f64, u32, u32)>,
    pub(crate) now_ns: f64,
    level: u32,
}

impl Pins {
    fn set(&mut self, pin: u8, high: bool, after_ns: f64) {
        self.change(1 << pin, u32::from(high) << pin, after_ns);
    }

    fn set_data(&mut self, data: u32, bits: u8, after_ns: f64) {
        self.change((1 << bits) - 1, data, after_ns);
    }

    fn change(&mut self, mask: u32, value: u32, after_ns: f64) {
        if (self.level ^ value) & mask != 0 {
            self.level = self.level & !mask | value;
            self.edges.push((self.now_ns + after_ns, mask, value));
        }
    }

    /// The pins at every cycle of the state machine, the first at `phase` of a cycle.
    pub(crate) fn cycles(&mut self, phase: f64) -> impl Iterator<Item = u32> + '_ {
        self.edges.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut next, mut level, mut n) = (0, 0, 0u64);
        let cycles = (self.now_ns / CYCLE_NS) as u64;
        std::iter::from_fn(move || {
            let now = (n as f64 + phase) * CYCLE_NS;
            while let Some(&(_, mask, value)) = self.edges.get(next).filter(|e| e.0 <= now) {
                level = level & !mask | value;
                next += 1;
            }
            n += 1;
            (n <= cycles).then_some(level)
        })
    }
}
