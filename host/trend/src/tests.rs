//! Power cuts, and what is kept.

use super::*;
use rowtone_chance::{Chance, XorShiftStar};
use std::collections::BTreeMap;

/// A disk in memory: of each file what is there, and how much of it outlives a power cut for sure.
#[derive(Clone, Debug, Default)]
struct Memory(BTreeMap<String, (Vec<u8>, usize)>);

impl Disk for Memory {
    fn list(&self) -> io::Result<Vec<String>> {
        Ok(self.0.keys().cloned().collect())
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        self.0
            .get(name)
            .map(|(bytes, _)| bytes.clone())
            .ok_or(io::ErrorKind::NotFound.into())
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.0.entry(name.to_owned()).or_default().0.extend(bytes);
        Ok(())
    }

    fn sync(&mut self, name: &str) -> io::Result<()> {
        let (bytes, synced) = self.0.get_mut(name).ok_or(io::ErrorKind::NotFound)?;
        *synced = bytes.len();
        Ok(())
    }

    fn remove(&mut self, name: &str) -> io::Result<()> {
        self.0
            .remove(name)
            .map(drop)
            .ok_or(io::ErrorKind::NotFound.into())
    }
}

impl Memory {
    /// The time of the last window that was synchronised.
    fn safe_ms(&self) -> u64 {
        let windows = self
            .0
            .iter()
            .filter(|(name, _)| name.starts_with("windows."));
        let synced = windows.flat_map(|(_, (bytes, synced))| bytes[..*synced].chunks_exact(LENGTH));
        synced
            .filter_map(Record::from_bytes)
            .map(|r| r.unix_ms)
            .max()
            .unwrap_or(0)
    }

    /// Cuts the power: of what was not synchronised a part is there, up to a random byte, and some of that is garbage, or
    /// garbage follows.
    fn cut(&mut self, chance: &mut impl Chance) {
        self.0.retain(|_, (bytes, synced)| {
            let unsure = bytes.len() - *synced;
            bytes.truncate(*synced + chance.below(unsure as u64 + 1) as usize);
            if chance.happens(0.5) {
                for byte in bytes.iter_mut().skip(*synced) {
                    if chance.happens(0.05) {
                        *byte = chance.below(256) as u8;
                    }
                }
            }
            if chance.happens(0.3) && unsure > 0 {
                let more = chance.below(100);
                bytes.extend((0..more).map(|_| chance.below(256) as u8));
            }
            *synced = bytes.len();
            // A file whose name was never synchronised may be gone.
            !bytes.is_empty() || chance.happens(0.5)
        });
    }
}

fn report(n: u64) -> Report {
    Report {
        um_per_px: Some(10.0),
        velocity_mm_s_rms: Some((n % 1000) as f32),
        ..Report::EMPTY
    }
}

/// 700 power cuts after some windows each. CRC-32 lets one garbled record of 4·10⁹ pass; the seed is fixed.
#[test]
fn power_cuts_cost_no_older_record_and_make_no_wrong_one() {
    cut_the_power(700);
}

/// The same ten thousand times, which takes two minutes: `cargo test -p rowtone-trend -- --ignored`.
#[test]
#[ignore = "takes two minutes"]
fn so_do_ten_thousand() {
    cut_the_power(10_000);
}

/// Every record that is read was written, in order, none twice, and none that was synchronised is missing of those that
/// are to be kept.
fn cut_the_power(cuts: usize) {
    let mut chance = XorShiftStar(7);
    let (mut disk, mut now_ms, mut count) = (Memory::default(), 0_u64, 0_u64);
    // Times of windows that were written, with their velocity; and up to which time they are safe.
    let (mut written, mut safe_ms) = (Vec::<(u64, f32)>::new(), 0);
    let mut minutes_seen = 0;
    for _ in 0..cuts {
        let mut trend = Trend::on(disk).unwrap();
        for _ in 0..chance.below(40) {
            now_ms += 500 + chance.below(20_000);
            count += 1;
            trend.push(&report(count), now_ms).unwrap();
            written.push((now_ms, (count % 1000) as f32));
        }
        disk = trend.disk;
        safe_ms = disk.safe_ms().max(safe_ms);
        disk.cut(&mut chance);
        let found = ring::records(&disk, Tier::Windows).unwrap();
        let mut all = written.iter();
        for record in &found {
            let same = |&&(ms, velocity): &&(u64, f32)| {
                ms == record.unix_ms && velocity == record.velocity_mm_s_rms
            };
            assert!(
                all.any(|w| same(&w)),
                "{record:?} was not written, or not in this order"
            );
        }
        // What is lost for good is no longer expected.
        let kept: std::collections::BTreeSet<_> = found.iter().map(|r| r.unix_ms).collect();
        let from = written
            .len()
            .saturating_sub(Tier::Windows.records() as usize);
        let missing = written[from..]
            .iter()
            .find(|w| w.0 <= safe_ms && !kept.contains(&w.0));
        assert_eq!(missing, None, "safe up to {safe_ms}");
        written.retain(|w| kept.contains(&w.0));
        let minutes = ring::records(&disk, Tier::Minutes).unwrap().len();
        assert!(minutes >= minutes_seen || minutes as u64 >= Tier::Minutes.records());
        minutes_seen = minutes;
    }
    assert!(minutes_seen > cuts, "{minutes_seen}");
}

#[test]
fn a_ring_keeps_what_it_promises_and_little_more() {
    let mut trend = Trend::on(Memory::default()).unwrap();
    let all = 3 * Tier::Windows.records();
    for n in 0..all {
        trend.push(&report(n), 500 * n).unwrap();
        if n % 1000 == 0 {
            let kept = trend.records(Tier::Windows).unwrap();
            let most = Tier::Windows.records() * 10 / 8;
            assert!((Tier::Windows.records().min(n + 1)..=most).contains(&(kept.len() as u64)));
            assert_eq!(kept.last().unwrap().unix_ms, 500 * n);
        }
    }
    // Three hours, of which the last is not over.
    assert_eq!(trend.records(Tier::Hours).unwrap().len(), 2);
    let minutes = trend.records(Tier::Minutes).unwrap();
    assert_eq!((minutes.len(), minutes[0].windows), (179, 120));
    // The root of the mean square of 0 to 119, and the most.
    let rms = (119.0_f32 * 239.0 / 6.0).sqrt();
    assert!(
        (minutes[0].velocity_mm_s_rms - rms).abs() < 0.01,
        "{minutes:?}"
    );
    assert_eq!(minutes[0].velocity_mm_s_rms_most, 119.0);
}

#[test]
fn a_folder_is_read_again_and_other_files_are_left_alone() {
    let dir = std::env::temp_dir().join(format!("rowtone-trend-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    for start in 0..3 {
        let mut trend = Trend::open(&dir).unwrap();
        std::fs::write(dir.join("windows.note"), "mine").unwrap();
        for n in 0..5 {
            trend.push(&report(n), 100_000 * start + n).unwrap();
        }
    }
    let read = read(&dir, Tier::Windows).unwrap();
    assert_eq!(read.len(), 15);
    assert_eq!(read[7].csv(), "100002,1,2,2,,,");
    assert_eq!(
        CSV_HEADING.split(',').count(),
        read[7].csv().split(',').count()
    );
    assert!(dir.join("windows.note").exists());
    std::fs::remove_dir_all(&dir).unwrap();
}
