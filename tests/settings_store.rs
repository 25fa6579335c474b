//! Settings against a flash whose power is cut at every byte.

use std::cell::Cell;
use std::rc::Rc;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use rowtone::link::settings::{
    Settings,
    store::{Keep, LayoutError, SaveError, Started, Store},
};
use rowtone::wire::SettingsOrigin;

/// Two erasable parts of 4 KiB, written in words of 4 bytes, whose power goes after so many bytes
/// written or erased. What was being written or erased then is left half done.
#[derive(Clone, Debug)]
struct Flash {
    bytes: Vec<u8>,
    /// Shared, so that it can be cut while a store owns the flash.
    power_for: Rc<Cell<usize>>,
    noise: u8,
}

impl Flash {
    fn new() -> Self {
        Self {
            bytes: vec![0xff; 8192],
            power_for: Rc::new(Cell::new(usize::MAX)),
            noise: 1,
        }
    }

    /// The same content on a new start, with power.
    fn powered(&self) -> Self {
        Self {
            bytes: self.bytes.clone(),
            ..Self::new()
        }
    }

    /// Takes so many bytes' worth of power and says whether it was there.
    fn use_power(&self, bytes: usize) -> bool {
        let left = self.power_for.get().checked_sub(bytes);
        self.power_for.set(left.unwrap_or(0));
        left.is_some()
    }

    fn noise(&mut self) -> u8 {
        self.noise = self.noise.wrapping_mul(141).wrapping_add(29);
        self.noise
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len())?;
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to)?;
        if !self.use_power((to - from) as usize) {
            for at in from as usize..to as usize {
                self.bytes[at] |= self.noise();
            }
            return Err(NorFlashErrorKind::Other);
        }
        self.bytes[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len())?;
        for (at, &byte) in bytes.iter().enumerate() {
            if !self.use_power(1) {
                let half = byte | self.noise();
                self.bytes[offset as usize + at] &= half;
                return Err(NorFlashErrorKind::Other);
            }
            self.bytes[offset as usize + at] &= byte;
        }
        Ok(())
    }
}

fn started(flash: &Flash) -> (Store<Flash>, Started) {
    let mut store = Store::new(flash.powered(), 0).unwrap();
    let started = store.start();
    (store, started)
}

fn settings(n: u32) -> Settings {
    Settings {
        window_s: 1.0 + n as f32,
        ..Settings::default()
    }
}

#[test]
fn a_new_board_has_the_defaults_and_counts_its_starts() {
    let mut flash = Flash::new();
    for session in 1..6 {
        let (store, started) = started(&flash);
        assert_eq!(started.session, session);
        assert_eq!(started.settings, None);
        assert_eq!(started.origin, SettingsOrigin::Defaults);
        flash = store.into_flash();
    }
}

/// Old settings or new ones, never others, wherever the power is cut; and new ones once the save
/// says that it is done.
#[test]
fn a_cut_at_every_byte_leaves_the_old_or_the_new_settings() {
    let (mut store, began) = started(&Flash::new());
    store.save(began.session, &settings(1)).unwrap();
    let base = store.into_flash();

    let (mut old, mut new) = (0, 0);
    // An erase of 4096 bytes, a write of 256, and some to spare.
    for cut in (0..4096).step_by(64).chain(4090..4096 + 264) {
        let flash = base.powered();
        let power = Rc::clone(&flash.power_for);
        let mut store = Store::new(flash, 0).unwrap();
        let began = store.start();
        assert_eq!(
            (began.settings, began.origin),
            (Some(settings(1)), SettingsOrigin::Saved)
        );

        power.set(cut);
        let saved = store.save(began.session, &settings(2));
        let (store, after) = started(&store.into_flash());
        let is_new = after.settings == Some(settings(2));
        assert!(is_new || after.settings == Some(settings(1)), "cut {cut}");
        match saved {
            Ok(()) => assert!(is_new, "cut {cut}: saved, but gone"),
            Err(error) => assert_eq!(error, SaveError::Flash),
        }
        if is_new {
            new += 1;
        } else {
            old += 1;
        }
        assert_eq!(after.session, began.session + 1);
        // The next start finds two good slots again.
        let (_, healed) = started(&store.into_flash());
        assert_eq!(
            (healed.settings, healed.origin),
            (after.settings, SettingsOrigin::Saved)
        );
    }
    assert!(old >= 64 && new >= 8, "{old} {new}");
}

/// Cut in every one of many starts in a row: the settings hold, whatever else happens.
#[test]
fn cuts_in_starts_do_not_harm() {
    let (mut store, began) = started(&Flash::new());
    store.save(began.session, &settings(1)).unwrap();
    let mut flash = store.into_flash();
    for cut in 0..2000 {
        flash = flash.powered();
        flash.noise = cut as u8;
        flash.power_for.set((cut * 37) % 4500);
        let mut store = Store::new(flash, 0).unwrap();
        assert_eq!(store.start().settings, Some(settings(1)), "cut {cut}");
        flash = store.into_flash();
    }
}

#[test]
fn both_slots_harmed_fall_back_to_the_defaults_and_say_so() {
    let (mut store, began) = started(&Flash::new());
    store.save(began.session, &settings(1)).unwrap();
    let mut flash = store.into_flash();
    flash.bytes[12] ^= 1;
    flash.bytes[4096 + 12] ^= 1;
    let (_, after) = started(&flash);
    assert_eq!(
        (after.settings, after.origin),
        (None, SettingsOrigin::Corrupt)
    );
}

#[test]
fn slots_that_do_not_fit_are_refused() {
    assert_eq!(
        Store::new(Flash::new(), 100).unwrap_err(),
        LayoutError::Offset(100)
    );
    assert_eq!(
        Store::new(Flash::new(), 4096).unwrap_err(),
        LayoutError::Capacity(8192)
    );
}
