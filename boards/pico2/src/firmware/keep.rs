//! Settings in the last two sectors of the flash.
//!
//! Only core 0 may write the flash, while core 1 is held; so core 1 asks, and waits.

use super::shared::M;
use core::cell::RefCell;
use core::sync::atomic::{AtomicU8, Ordering};
use embassy_rp::Peri;
use embassy_rp::flash::{Blocking, Flash};
use embassy_rp::peripherals::FLASH;
use embassy_sync::blocking_mutex::Mutex;
use rowtone::link::settings::Settings;
use rowtone::link::settings::store::{Keep, SaveError, Started, Store};
use rowtone::wire::SettingsOrigin;

/// The Pico 2's flash.
const FLASH_BYTES: usize = 4 * 1024 * 1024;
/// Two sectors of 4 KiB at its end; `memory.x` leaves them free.
const OFFSET: u32 = (FLASH_BYTES - 2 * 4096) as u32;

/// The store; `None` where the flash is not as it should be.
pub(crate) type FlashStore = Option<Store<Flash<'static, FLASH, Blocking, FLASH_BYTES>>>;

/// Reads what was saved and counts this start.
pub(crate) fn start(flash: Peri<'static, FLASH>) -> (FlashStore, Started) {
    match Store::new(Flash::new_blocking(flash), OFFSET) {
        Ok(mut store) => {
            let started = store.start();
            (Some(store), started)
        }
        Err(_) => {
            let nothing = Started {
                session: 1,
                settings: None,
                origin: SettingsOrigin::Defaults,
            };
            (None, nothing)
        }
    }
}

static ASKED: Mutex<M, RefCell<Option<(u32, Settings)>>> = Mutex::new(RefCell::new(None));
static ANSWER: AtomicU8 = AtomicU8::new(NONE);
const NONE: u8 = 0;
const KEPT: u8 = 1;
const REFUSED: u8 = 2;

/// Core 0: do what was asked for, if anything was. Lines are lost meanwhile (some tens of milliseconds), and
/// counted.
pub(crate) fn serve(store: &mut FlashStore) {
    let Some((session, settings)) = ASKED.lock(|asked| asked.take()) else {
        return;
    };
    let done = store
        .as_mut()
        .is_some_and(|store| store.save(session, &settings).is_ok());
    ANSWER.store(if done { KEPT } else { REFUSED }, Ordering::Release);
}

/// Core 1's side.
pub(crate) struct Remote;

impl Keep for Remote {
    fn save(&mut self, session: u32, settings: &Settings) -> Result<(), SaveError> {
        ANSWER.store(NONE, Ordering::Release);
        ASKED.lock(|asked| asked.replace(Some((session, *settings))));
        // Core 0 looks every 50 ms, and a sector is erased within 0.4 s; the watchdog is more patient than this.
        for _ in 0..2000 {
            match ANSWER.load(Ordering::Acquire) {
                KEPT => return Ok(()),
                REFUSED => return Err(SaveError::Flash),
                _ => cortex_m::asm::delay(150_000), // 1 ms
            }
        }
        Err(SaveError::Flash)
    }
}
