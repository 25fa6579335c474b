//! What can go wrong with the camera, and what is then done about it.
//!
//! One state machine, asked from one place. It does nothing itself: events go in, at most one action comes
//! out, and every change of state is worth a line on the UART ([`State`]'s `Display`).

use crate::hm01b0;
use crate::led::Show;
use core::fmt;

/// No line for this long: the camera is silent. At least three frames at the slowest rate that is used.
pub const SILENT_MS: u64 = 300;
/// First wait before the camera is set up again; doubled each time, up to [`MAX_RETRY_MS`].
pub const RETRY_MS: u64 = 500;
/// Longest wait between two tries.
pub const MAX_RETRY_MS: u64 = 8000;
/// An overrun is shown this long.
pub const SHOW_OVERRUN_MS: u64 = 1000;

/// How the camera is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Set up, no line yet.
    Started,
    /// Lines come.
    Running,
    /// The bus does not answer, or answers wrongly.
    BusError,
    /// Another camera answers.
    WrongModel(u16),
    /// It does not come back from its reset.
    StuckInReset,
    /// The configuration is refused: a fault of the firmware or of the settings.
    BadConfig(hm01b0::ConfigError),
    /// No line for [`SILENT_MS`].
    Silent,
    /// The DMA was late, and words were lost: capture starts again at the next line.
    DmaOverrun,
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Started => f.write_str("camera started, waiting for its first line"),
            Self::Running => f.write_str("camera running"),
            Self::BusError => {
                f.write_str("camera: no answer on I2C, trying again; check SDA, SCL, 3V3")
            }
            Self::WrongModel(id) => write!(
                f,
                "camera: model {id:#06x} is no HM01B0 (0x01b0), trying again"
            ),
            Self::StuckInReset => {
                f.write_str("camera: stuck in reset, trying again; check its supply")
            }
            Self::BadConfig(e) => write!(f, "camera: configuration refused: {e}"),
            Self::Silent => {
                f.write_str("camera: set up but silent, trying again; check PCLK, HREF, MCLK")
            }
            Self::DmaOverrun => f.write_str("capture: DMA was late, starting it again"),
        }
    }
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<E> {
    /// The set-up that was asked for is done.
    SetUp(Result<(), hm01b0::Error<E>>),
    /// A line came.
    Line,
    /// A line was dropped because the work was late.
    Overrun,
    /// The state machine's FIFO was full: the DMA was late.
    DmaStalled,
    /// Time passes; sent at least every 100 ms.
    Tick,
}

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Set the camera up from its reset on, and start capture with empty FIFOs; then send [`Event::SetUp`].
    SetUp,
    /// Start the state machine and the DMA again, the camera goes on.
    RestartCapture,
}

/// See the [module](self).
#[derive(Clone, Debug)]
pub struct Health {
    state: State,
    /// Last line, or last set-up, ms.
    heard_ms: u64,
    retry_at_ms: Option<u64>,
    retry_ms: u64,
    overrun_ms: Option<u64>,
    faults: u32,
}

impl Health {
    /// A camera that is about to be set up for the first time: the caller does [`Action::SetUp`] at once.
    pub const fn new() -> Self {
        Self {
            state: State::Started,
            heard_ms: 0,
            retry_at_ms: None,
            retry_ms: RETRY_MS,
            overrun_ms: None,
            faults: 0,
        }
    }

    /// Tell what happened, and when (ms since the start).
    pub fn on<E>(&mut self, event: Event<E>, now_ms: u64) -> Option<Action> {
        match event {
            Event::SetUp(Ok(())) => {
                (self.state, self.heard_ms, self.retry_at_ms) = (State::Started, now_ms, None);
                None
            }
            Event::SetUp(Err(e)) => {
                self.fault(
                    match e {
                        hm01b0::Error::Bus(_) => State::BusError,
                        hm01b0::Error::WrongModel(id) => State::WrongModel(id),
                        hm01b0::Error::StuckInReset => State::StuckInReset,
                        hm01b0::Error::Config(e) => State::BadConfig(e),
                    },
                    now_ms,
                );
                None
            }
            Event::Line => {
                self.heard_ms = now_ms;
                (self.state, self.retry_ms, self.retry_at_ms) = (State::Running, RETRY_MS, None);
                None
            }
            Event::Overrun => {
                self.overrun_ms = Some(now_ms);
                None
            }
            Event::DmaStalled => {
                self.state = State::DmaOverrun;
                self.faults = self.faults.saturating_add(1);
                Some(Action::RestartCapture)
            }
            Event::Tick => self.tick(now_ms),
        }
    }

    fn tick(&mut self, now_ms: u64) -> Option<Action> {
        if let Some(at) = self.retry_at_ms {
            if now_ms < at {
                return None;
            }
            self.retry_at_ms = None;
            self.heard_ms = now_ms;
            return Some(Action::SetUp);
        }
        if now_ms.saturating_sub(self.heard_ms) >= SILENT_MS {
            self.fault(State::Silent, now_ms);
        }
        None
    }

    fn fault(&mut self, state: State, now_ms: u64) {
        self.state = state;
        self.faults = self.faults.saturating_add(1);
        self.retry_at_ms = Some(now_ms.saturating_add(self.retry_ms));
        self.retry_ms = (self.retry_ms * 2).min(MAX_RETRY_MS);
    }

    /// How the camera is doing.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Faults since the start.
    pub const fn faults(&self) -> u32 {
        self.faults
    }

    /// What the LED shows; `measuring`: the reference is learned.
    pub fn show(&self, measuring: bool, now_ms: u64) -> Show {
        let overrun = self
            .overrun_ms
            .is_some_and(|at| now_ms.saturating_sub(at) < SHOW_OVERRUN_MS);
        match self.state {
            State::Running | State::DmaOverrun if overrun => Show::LineOverrun,
            State::DmaOverrun => Show::LineOverrun,
            State::Running if measuring => Show::Measuring,
            State::Running | State::Started => Show::Searching,
            _ => Show::Fault,
        }
    }
}

impl Default for Health {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal::i2c::ErrorKind;

    type E = Event<ErrorKind>;

    fn running() -> Health {
        let mut health = Health::new();
        assert_eq!(health.on(E::SetUp(Ok(())), 0), None);
        assert_eq!(health.state(), State::Started);
        assert_eq!(health.on(E::Line, 10), None);
        assert_eq!(health.state(), State::Running);
        health
    }

    /// Milliseconds from `from` at which the camera is set up again, in a minute of ticks; set-ups fail.
    fn tries(health: &mut Health, from: u64, error: hm01b0::Error<ErrorKind>) -> Vec<u64> {
        let mut at = vec![];
        for ms in (from..from + 60_000).step_by(50) {
            if health.on(E::Tick, ms) == Some(Action::SetUp) {
                at.push(ms - from);
                health.on(E::SetUp(Err(error)), ms);
            }
        }
        at
    }

    #[test]
    fn bus_errors_are_told_and_tried_again_ever_more_slowly() {
        let mut health = Health::new();
        let error = hm01b0::Error::Bus(ErrorKind::Bus);
        health.on(E::SetUp(Err(error)), 0);
        assert_eq!(health.state(), State::BusError);
        assert_eq!(health.show(false, 0), Show::Fault);
        let at = tries(&mut health, 0, error);
        assert_eq!(at[..6], [500, 1500, 3500, 7500, 15_500, 23_500]);
        // It is plugged in again.
        health.on(E::SetUp(Ok(())), 60_000);
        health.on(E::Line, 60_010);
        assert_eq!(
            (health.state(), health.show(true, 60_010)),
            (State::Running, Show::Measuring)
        );
    }

    #[test]
    fn wrong_sensor_is_named() {
        let mut health = Health::new();
        health.on(E::SetUp(Err(hm01b0::Error::WrongModel(0x0356))), 0);
        assert_eq!(health.state(), State::WrongModel(0x0356));
        assert!(health.state().to_string().contains("0x0356"));
        assert!(!tries(&mut health, 0, hm01b0::Error::WrongModel(0x0356)).is_empty());
    }

    #[test]
    fn stuck_in_reset_and_bad_config_are_states() {
        let mut health = Health::new();
        health.on(E::SetUp(Err(hm01b0::Error::StuckInReset)), 0);
        assert_eq!(health.state(), State::StuckInReset);
        let error = hm01b0::ConfigError::LineLength(1);
        health.on(E::SetUp(Err(hm01b0::Error::Config(error))), 0);
        assert_eq!(health.state(), State::BadConfig(error));
    }

    #[test]
    fn silence_is_told_once_and_the_camera_set_up_anew() {
        let mut health = running();
        assert_eq!(health.on(E::Tick, 10 + SILENT_MS - 1), None);
        assert_eq!(health.state(), State::Running);
        assert_eq!(health.on(E::Tick, 10 + SILENT_MS), None);
        assert_eq!((health.state(), health.faults()), (State::Silent, 1));
        assert_eq!(
            health.on(E::Tick, 10 + SILENT_MS + RETRY_MS),
            Some(Action::SetUp)
        );
        // The set-up works, but still nothing comes: silent again, after the same patience.
        health.on(E::SetUp(Ok(())), 900);
        assert_eq!(health.on(E::Tick, 900 + SILENT_MS), None);
        assert_eq!((health.state(), health.faults()), (State::Silent, 2));
    }

    #[test]
    fn a_camera_that_never_speaks_is_silent_too() {
        let mut health = Health::new();
        health.on(E::SetUp(Ok(())), 100);
        health.on(E::Tick, 100 + SILENT_MS);
        assert_eq!(health.state(), State::Silent);
    }

    #[test]
    fn dma_overrun_restarts_capture_only() {
        let mut health = running();
        assert_eq!(health.on(E::DmaStalled, 20), Some(Action::RestartCapture));
        assert_eq!(
            (health.state(), health.show(true, 20)),
            (State::DmaOverrun, Show::LineOverrun)
        );
        health.on(E::Line, 30);
        assert_eq!(health.state(), State::Running);
    }

    #[test]
    fn line_overrun_is_shown_for_a_while() {
        let mut health = running();
        health.on(E::Overrun, 100);
        assert_eq!(health.show(true, 101), Show::LineOverrun);
        assert_eq!(health.show(true, 100 + SHOW_OVERRUN_MS), Show::Measuring);
        assert_eq!(health.state(), State::Running);
    }
}
