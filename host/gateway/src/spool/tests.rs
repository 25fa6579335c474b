use super::*;
use crate::spool::record::tests::record;

const LARGE: u64 = 1 << 30;

pub(super) fn dir(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("rowtone-spool-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    dir
}

fn open(dir: &Path, max_bytes: u64, boards: &[&str]) -> Spool {
    Spool::open(dir.to_owned(), max_bytes, boards.iter().copied()).unwrap()
}

fn push(spool: &mut Spool, board: &str, numbers: std::ops::Range<u64>) {
    numbers.for_each(|number| spool.push(&record(board, number).entry));
}

/// All that there is to be sent: whose, its number as a report, and its mark.
fn all(spool: &mut Spool) -> Vec<(String, u32, Mark)> {
    let mut all = vec![];
    while let Some((mark, record)) = spool.next_record(Instant::now()) {
        let entry = record.entry;
        all.push((entry.board, entry.report.seq, mark));
    }
    all
}

fn numbers(spool: &mut Spool, board: &str) -> Vec<u32> {
    let all = all(spool);
    let of_board = all.iter().filter(|(of, ..)| of == board);
    of_board.map(|&(_, seq, _)| seq).collect()
}

/// The board's files, the oldest first.
fn files(dir: &Path, board: &str) -> Vec<PathBuf> {
    let (files, _) = list(dir).unwrap();
    let firsts = files.get(board).into_iter().flat_map(BTreeMap::keys);
    firsts
        .map(|&first| dir.join(name::of(board, first)))
        .collect()
}

#[test]
fn what_is_not_acknowledged_comes_again_in_order() {
    let dir = dir("order");
    let mut spool = open(&dir, LARGE, &["a", "b"]);
    push(&mut spool, "a", 0..10);
    push(&mut spool, "b", 50..52);
    let sent = all(&mut spool);
    // The boards take turns.
    let boards: Vec<&str> = sent.iter().map(|(board, ..)| board.as_str()).collect();
    assert_eq!(boards[..5], ["b", "a", "b", "a", "a"]);
    let mark = |seq| sent.iter().find(|one| one.1 == seq).unwrap().2;
    spool.acknowledge(mark(3));
    spool.rewind();
    assert_eq!(numbers(&mut spool, "a"), [4, 5, 6, 7, 8, 9]);
    spool.save(Instant::now());
    spool.acknowledge(mark(6));
    // Killed before the state was saved again, in the middle of a record.
    let file = &files(&dir, "a")[0];
    let bytes = std::fs::read(file).unwrap();
    std::fs::write(file, &bytes[..bytes.len() - 9]).unwrap();
    drop(spool);
    let mut spool = open(&dir, LARGE, &["a", "b"]);
    push(&mut spool, "a", 10..11);
    assert_eq!(numbers(&mut spool, "a"), [4, 5, 6, 7, 8, 10]);
    spool.save(Instant::now());
    assert_eq!(spool.dropped(), 1);
    assert_eq!(
        spool.take_notices(),
        ["a: 1 report harmed on disk and left out"]
    );
    drop(spool);
    // A board that is no longer configured.
    let mut spool = open(&dir, LARGE, &["a"]);
    assert_eq!(numbers(&mut spool, "b"), [50, 51]);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_board_that_talks_much_pushes_out_none_but_itself() {
    let dir = dir("share");
    let mut spool = open(&dir, 2 << 20, &["good", "evil"]);
    push(&mut spool, "good", 0..200);
    push(&mut spool, "evil", 0..20_000);
    let sent = all(&mut spool);
    let of = |board: &str| sent.iter().filter(|one| one.0 == board).count() as u64;
    assert_eq!(of("good"), 200);
    assert_eq!(of("evil") + spool.dropped(), 20_000);
    assert!(spool.waiting() <= 2 << 20 && spool.waiting() > 1 << 20);
    spool.save(Instant::now());
    let said = spool.take_notices();
    assert!(
        said[0].starts_with("evil: ") && said[0].contains("max_mb"),
        "{said:?}"
    );
    let newest = |board: &str| sent.iter().rfind(|one| one.0 == board).unwrap().2;
    spool.acknowledge(newest("evil"));
    spool.acknowledge(newest("good"));
    spool.save(Instant::now());
    assert_eq!(spool.waiting(), 0);
    assert!(files(&dir, "evil").len() <= 1);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_directory_is_for_one_gateway() {
    let dir = dir("lock");
    let spool = open(&dir, LARGE, &["a"]);
    let error = Spool::open(dir.clone(), LARGE, ["b"].into_iter()).unwrap_err();
    let process = std::process::id().to_string();
    assert!(error.to_string().contains(&process), "{error}");
    drop(spool);
    open(&dir, LARGE, &["b"]);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn stray_files_are_ignored() {
    let dir = dir("stray");
    std::fs::create_dir_all(dir.join("a.0000000000000009.spool")).unwrap();
    for stray in [
        "7.spool",
        "a.18446744073709551615.spool",
        "+5.spool",
        "cursor",
    ] {
        std::fs::write(dir.join(stray), "x\n").unwrap();
    }
    let mut spool = open(&dir, LARGE, &["a"]);
    push(&mut spool, "a", 0..3);
    assert_eq!(numbers(&mut spool, "a"), [0, 1, 2]);
    let said = spool.take_notices();
    assert_eq!(said, ["spool: 5 files that are not its own are left alone"]);
    assert!(dir.join("7.spool").exists());
    std::fs::remove_dir_all(dir).unwrap();
}

/// Whatever is done to the files: what comes was said once, by this board, and what does not come is
/// counted.
#[test]
fn harm_costs_what_it_touches() {
    const REPORTS: u64 = 300;
    let dir = dir("harm");
    let mut spool = open(&dir, 64 * 1024, &["a"]);
    push(&mut spool, "a", 0..REPORTS);
    drop(spool);
    let names = files(&dir, "a");
    assert!(names.len() > 3, "{names:?}");
    let whole: Vec<Vec<u8>> = names
        .iter()
        .map(|name| std::fs::read(name).unwrap())
        .collect();
    let mut seed = 7_u64;
    let mut roll = move |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as usize % below
    };
    for trial in 0..60 {
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        let harmed = roll(names.len());
        let harms = [1, 3, 30][trial % 3];
        for (at, (name, bytes)) in names.iter().zip(&whole).enumerate() {
            let mut bytes = bytes.clone();
            if at == harmed && trial < 50 {
                for _ in 0..harms {
                    let at = roll(bytes.len());
                    bytes[at] ^= 1 << roll(8);
                }
            } else if at == harmed && trial < 55 {
                bytes.truncate(roll(bytes.len()));
            } else if at == harmed {
                let byte = [0, b'\n', b'7'][trial % 3];
                bytes.extend(std::iter::repeat_n(byte, 300_000));
            }
            std::fs::write(name, bytes).unwrap();
        }
        let mut spool = open(&dir, LARGE, &["a"]);
        push(&mut spool, "a", REPORTS..REPORTS + 1);
        let came = numbers(&mut spool, "a");
        assert!(came.is_sorted() && came.iter().all(|&seq| u64::from(seq) <= REPORTS));
        let lost = REPORTS + 1 - came.len() as u64;
        if trial < 50 {
            assert!(lost <= harms, "{harms} bits cost {lost}");
            assert_eq!(spool.dropped(), lost, "trial {trial}");
        } else if trial >= 55 {
            assert_eq!(lost, 0);
        } else if harmed + 1 < names.len() {
            assert_eq!(spool.dropped(), lost, "trial {trial}");
        }
    }
    std::fs::remove_dir_all(dir).unwrap();
}

/// Where a directory stands in the way of the file that comes next, as a disk that refuses.
#[test]
fn what_the_disk_refuses_waits_in_memory() {
    let dir = dir("refused");
    let mut spool = open(&dir, LARGE, &["a"]);
    let block = |id| dir.join(name::of("a", id));
    (1..=20).for_each(|id| std::fs::create_dir(block(id)).unwrap());
    push(&mut spool, "a", 0..30);
    let said = spool.take_notices();
    assert!(said[0].contains("cannot be written"), "{said:?}");
    assert!(said[1].contains("written again"), "{said:?}");
    let sent = all(&mut spool);
    let numbers: Vec<u32> = sent.iter().map(|one| one.1).collect();
    assert_eq!(numbers, (0..30).collect::<Vec<u32>>());
    spool.acknowledge(sent[9].2);
    spool.rewind();
    assert_eq!(all(&mut spool).len(), 20);
    spool.acknowledge(sent[29].2);
    spool.rewind();
    assert_eq!((all(&mut spool).len(), spool.dropped()), (0, 0));
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn how_far_the_boards_are_complete_is_remembered() {
    let dir = dir("complete");
    let mut spool = open(&dir, LARGE, &["a", "b"]);
    push(&mut spool, "a", 0..9);
    spool.set_complete("a", (1, 7));
    spool.set_complete("a", (1, 8));
    spool.save(Instant::now());
    drop(spool);
    let mut spool = open(&dir, LARGE, &["a", "b"]);
    assert_eq!(spool.complete_of("a"), Some((1, 8)), "killed, as it were");
    assert_eq!(spool.complete_of("b"), None);
    assert_eq!(spool.lanes[0].known.on_disk, None);
    spool.finish();
    drop(spool);
    let spool = open(&dir, LARGE, &["a", "b"]);
    assert_eq!(spool.lanes[0].known.on_disk, Some((1, 8)));
    std::fs::remove_dir_all(dir).unwrap();
}

/// A disk that is full: the oldest goes, is counted, and what finds no room is sent from memory.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_nothing() {
    let dir = dir("full");
    let mut spool = open(&dir, 1 << 20, &["a", "b"]);
    push(&mut spool, "a", 0..500);
    push(&mut spool, "b", 0..10);
    // From now on every file that is begun lies on a disk without room.
    for lane in &mut spool.lanes {
        let next = 501;
        for id in next..next + 100 {
            let path = dir.join(name::of(&lane.board, id));
            std::os::unix::fs::symlink("/dev/full", path).unwrap();
        }
    }
    spool.max_bytes = 65_536; // files of 4096 bytes, so that a new one comes at once
    push(&mut spool, "a", 500..520);
    let dropped = spool.dropped();
    assert!(dropped > 0);
    let sent = all(&mut spool);
    let a: Vec<u32> = sent
        .iter()
        .filter(|one| one.0 == "a")
        .map(|one| one.1)
        .collect();
    assert!(a.is_sorted());
    assert_eq!(a.len() as u64 + dropped, 520);
    assert_eq!(a[a.len() - 20..], (500..520).collect::<Vec<u32>>());
    assert_eq!(sent.iter().filter(|one| one.0 == "b").count(), 10);
    spool.save(Instant::now());
    let said = spool.take_notices();
    assert!(
        said.iter()
            .any(|line| line.contains("dropped, the oldest: the disk is full")),
        "{said:?}"
    );
    assert!(
        said.iter()
            .any(|line| line.contains("reports wait in memory")),
        "{said:?}"
    );
    std::fs::remove_dir_all(dir).unwrap();
}

/// A file under another board's name: its records are nobody's, which is said, and they do not wait for
/// ever.
#[test]
fn a_file_of_another_name_is_no_board_s() {
    let dir = dir("renamed");
    let mut spool = open(&dir, LARGE, &["a"]);
    push(&mut spool, "a", 0..3);
    drop(spool);
    std::fs::rename(dir.join(name::of("a", 1)), dir.join(name::of("b", 1))).unwrap();
    let mut spool = open(&dir, LARGE, &["a", "b"]);
    assert!(all(&mut spool).is_empty());
    assert_eq!((spool.dropped(), spool.waiting()), (3, 0));
    push(&mut spool, "b", 7..8);
    assert_eq!(numbers(&mut spool, "b"), [7]);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn what_cannot_be_published_is_kept_apart() {
    let dir = dir("aside");
    let mut spool = open(&dir, LARGE, &["a"]);
    push(&mut spool, "a", 0..2);
    let (mark, record) = spool.next_record(Instant::now()).unwrap();
    spool.set_aside(&record);
    spool.acknowledge(mark);
    spool.save(Instant::now());
    assert_eq!(
        spool.take_notices(),
        ["a: 1 report set aside: they cannot be published"]
    );
    let bytes = std::fs::read(dir.join("aside")).unwrap();
    let kept: Vec<_> = record::pieces(&bytes).filter_map(|(_, one)| one).collect();
    assert_eq!(kept, [record]);
    assert_eq!(numbers(&mut spool, "a"), [1]);
    std::fs::remove_dir_all(dir).unwrap();
}
