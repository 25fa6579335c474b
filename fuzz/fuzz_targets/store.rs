//! `settings::store`: any content of the flash, and a power cut in any save.
#![no_main]

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use libfuzzer_sys::fuzz_target;
use rowtone::link::settings::Settings;
use rowtone::link::settings::store::{Keep, SLOT_LEN, Store};
use rowtone::wire::SettingsOrigin;

/// Two slots, erased and written whole; after so many writes the power goes in the middle of one.
struct Flash {
    bytes: [u8; 2 * SLOT_LEN],
    cut: Option<(u8, u8)>,
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        let at = offset as usize;
        bytes.copy_from_slice(&self.bytes[at..at + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SLOT_LEN;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.bytes[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        let at = offset as usize;
        match &mut self.cut {
            Some((0, done)) => {
                let done = usize::from(*done).min(bytes.len());
                self.bytes[at..at + done].copy_from_slice(&bytes[..done]);
                return Err(NorFlashErrorKind::Other);
            }
            Some((left, _)) => *left -= 1,
            None => {}
        }
        self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

/// `content` of a slot under a right head and checksum.
fn slot(version: u8, number: u32, content: &[u8]) -> [u8; SLOT_LEN] {
    let mut bytes = [0xff; SLOT_LEN];
    let content = &content[..content.len().min(SLOT_LEN - 14)];
    let end = 10 + content.len();
    bytes[..4].copy_from_slice(&[b'R', b'T', b'S', version]);
    bytes[4..8].copy_from_slice(&number.to_le_bytes());
    bytes[8..10].copy_from_slice(&(content.len() as u16).to_le_bytes());
    bytes[10..end].copy_from_slice(content);
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes[..end]);
    bytes[end..end + 4].copy_from_slice(&sum.to_le_bytes());
    bytes
}

// First byte: which slots are valid by their checksum. Then when and where the power goes, and the content.
fuzz_target!(|data: &[u8]| {
    let [kind, writes, done, number, content @ ..] = data else { return };
    let (first, second) = content.split_at(content.len() / 2);
    let mut bytes = [0xff; 2 * SLOT_LEN];
    for (at, content) in [(0, first), (1, second)] {
        let part = &mut bytes[at * SLOT_LEN..][..SLOT_LEN];
        if kind & (1 << at) != 0 {
            let version = 1 + (kind >> 2 & 1);
            part.copy_from_slice(&slot(version, u32::from(*number).wrapping_add(at as u32).wrapping_sub(1), content));
        } else {
            let len = content.len().min(SLOT_LEN);
            part[..len].copy_from_slice(&content[..len]);
        }
    }
    let mut store = Store::new(Flash { bytes, cut: None }, 0).expect("two slots fit");
    let began = store.start();
    // `start` gives the same again: it counted itself and kept the rest.
    let mut store = Store::new(store.into_flash(), 0).expect("two slots fit");
    let again = store.start();
    assert_eq!(again.session, began.session.wrapping_add(1));
    let same = |a: Option<Settings>, b: Option<Settings>| format!("{a:?}") == format!("{b:?}"); // NaN included
    assert!(same(again.settings, began.settings));

    // Saving twice, cut somewhere: the old settings, the first or the second, never others.
    let mut flash = store.into_flash();
    flash.cut = Some((writes % 4, *done));
    let mut store = Store::new(flash, 0).expect("two slots fit");
    let began = store.start();
    let new = |window_s| Settings { window_s, ..Settings::default() };
    let first = store.save(began.session, &new(2.0));
    let second = store.save(began.session, &new(3.0));
    let mut flash = store.into_flash();
    flash.cut = None;
    let after = Store::new(flash, 0).expect("two slots fit").start();
    let one_of = [began.settings, Some(new(2.0)), Some(new(3.0))];
    assert!(one_of.into_iter().any(|one| same(after.settings, one)), "{after:?}");
    if second.is_ok() {
        assert_eq!(after.settings, Some(new(3.0)));
    } else if first.is_ok() {
        assert_ne!(after.origin, SettingsOrigin::Corrupt);
        assert!(!same(after.settings, began.settings) || began.settings == Some(new(2.0)));
    }
});
