//! What all threads of the program share.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use rowtone::link::settings::Settings;
use rowtone_page::live::Live;

use crate::alarms::Desk;
use crate::alive::Pulses;
use crate::trend::Keeper;

/// What all threads share.
#[derive(Debug)]
pub struct Shared {
    /// The program is to end.
    pub stop: AtomicBool,
    /// Counts the changes of what is measured.
    pub changes: AtomicU32,
    /// What is measured now.
    pub settings: Mutex<Settings>,
    /// Columns and rows of the camera's picture, in the upper and the lower half; 0 until one is open.
    picture: AtomicU32,
    /// Signs of life of the other threads.
    pub pulses: Pulses,
    /// Windows dropped because the spectrum was busy, and reports because the queue was full.
    pub dropped: AtomicU64,
    /// What the page shows; none where there is no page.
    pub live: Option<Arc<Live>>,
    /// Settings that the page asks for, until the output thread takes them.
    pub wish: Mutex<Option<PageWish>>,
    /// The machine's alarms; none where the configuration has no rules.
    pub alarms: Mutex<Option<Desk>>,
    /// The way to the trend on the disk; none where the configuration has none.
    pub trend: Option<Keeper>,
    /// When the program began.
    pub started: Instant,
}

/// Settings that the page asks for.
#[derive(Debug)]
pub struct PageWish {
    /// All of them.
    pub settings: Settings,
    /// Where the answer goes: why they cannot be used, in a sentence without a stop.
    pub answer: SyncSender<Result<(), String>>,
}

impl Shared {
    /// Nothing stopped, changed or dropped.
    pub fn new(settings: Settings) -> Self {
        Self {
            stop: AtomicBool::new(false),
            changes: AtomicU32::new(0),
            settings: Mutex::new(settings),
            picture: AtomicU32::new(0),
            pulses: Pulses::default(),
            dropped: AtomicU64::new(0),
            live: None,
            wish: Mutex::new(None),
            alarms: Mutex::new(None),
            trend: None,
            started: Instant::now(),
        }
    }

    /// The same with a page that shows what is measured.
    #[must_use]
    pub fn with_page(self, live: Arc<Live>) -> Self {
        Self {
            live: Some(live),
            ..self
        }
    }

    /// The same with alarms.
    #[must_use]
    pub fn with_alarms(self, alarms: Option<Desk>) -> Self {
        Self {
            alarms: Mutex::new(alarms),
            ..self
        }
    }

    /// The same with a trend.
    #[must_use]
    pub fn with_trend(self, trend: Option<Keeper>) -> Self {
        Self { trend, ..self }
    }

    /// Does something with the alarms, where there are some.
    pub(crate) fn on_alarms<T>(&self, with: impl FnOnce(&mut Desk) -> T) -> Option<T> {
        let mut alarms = self.alarms.lock().unwrap_or_else(PoisonError::into_inner);
        alarms.as_mut().map(with)
    }

    /// Acknowledges all alarms.
    pub fn acknowledge(&self) {
        self.on_alarms(Desk::acknowledge);
    }

    /// Tells the alarms how late it is: where no report comes, a contact that fails safe opens.
    pub fn hear_silence(&self) {
        self.on_alarms(|desk| desk.hear_silence(Instant::now()));
    }

    /// The settings in use.
    pub fn settings(&self) -> Settings {
        *self.settings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The camera is open, and its picture has this size.
    pub fn set_picture(&self, width: u16, height: u16) {
        let picture = u32::from(width) << 16 | u32::from(height);
        self.picture.store(picture, Ordering::Relaxed);
    }

    /// Columns and rows of the camera's picture; none before the first one was opened.
    pub fn picture(&self) -> Option<(u16, u16)> {
        let picture = self.picture.load(Ordering::Relaxed);
        (picture != 0).then_some(((picture >> 16) as u16, picture as u16))
    }

    /// The program is to end.
    pub fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
