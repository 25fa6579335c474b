//! Reports on disk until the broker has them.
//!
//! Every board has files of its own (`lane`), to which each of its reports is appended as a record
//! with a checksum (`record`) before it is sent. What the broker has acknowledged is written down
//! twice a second (`state`); files that it has whole are removed. After a crash the reports behind
//! are sent once more, and a receiver drops those it has by board, session and number.
//!
//! - **Share**: when all together take more than allowed, the board that takes most gives up its
//!   oldest file, so one that talks much pushes out none but itself.
//! - **Power cut**: what was appended is synchronised with the disk every `SYNC` (`sync`), and it is
//!   written down up to where the boards need not be asked again after one, and after a crash.
//! - **A disk that is full** ends nothing: acknowledged files go first, then the oldest of the board
//!   that takes most; what cannot be written at all waits in memory, and is published from there.
//! - **Whatever is lost** is counted and said when it happens (`losses`).
//! - **One gateway**: the directory is locked for as long as it is open.

pub(crate) mod births;
mod lane;
mod losses;
mod name;
pub mod record;
mod state;
mod sync;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lane::{Lane, Place};
use losses::Losses;
pub(super) use losses::Why;
use record::{Entry, Record};
use state::State;
use sync::Syncer;

/// How often what was written is synchronised with the disk.
const SYNC: Duration = Duration::from_secs(5);
/// A board that could not be read is tried again after this.
const AGAIN: Duration = Duration::from_secs(1);
/// Records that the disk refused and memory holds, of all boards together.
const MEMORY: usize = 2000;
/// Descriptors held back for when there are no others.
const SPARE: usize = 2;
/// Longest file of what was set aside, bytes.
const ASIDE: u64 = 1 << 20;

/// A record that was handed out: of which board, its number, and the place behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mark {
    pub(super) lane: usize,
    pub(super) id: u64,
    at: Option<Place>,
}

impl Mark {
    #[cfg(test)]
    pub(super) fn of(lane: usize, id: u64) -> Self {
        Self { lane, id, at: None }
    }
}

/// Up to where each board's reports are complete, and on the disk after a pass of [`Syncer`].
type Complete = Vec<Option<(u32, u32)>>;

/// The spool.
#[derive(Debug)]
pub(super) struct Spool {
    dir: PathBuf,
    max_bytes: u64,
    /// Kept open: it holds the lock.
    _lock: File,
    lanes: Vec<Lane>,
    /// When a board that could not be read is tried again.
    again_at: Vec<Option<Instant>>,
    /// The board that was read last.
    turn: usize,
    state: State,
    /// The state on disk is an older one.
    changed: bool,
    /// Files written to since the last pass.
    written: BTreeSet<PathBuf>,
    syncer: Syncer<Complete>,
    sync_at: Instant,
    spare: Vec<File>,
    losses: Losses,
    /// What is wrong with the disk now.
    trouble: Option<String>,
    /// To be said.
    notices: Vec<String>,
}

impl Spool {
    /// Opens the directory for these boards, making it where it is not there.
    ///
    /// # Errors
    /// It cannot be written or read, or another gateway has it.
    pub(super) fn open<'a>(
        dir: PathBuf,
        max_bytes: u64,
        boards: impl Iterator<Item = &'a str>,
    ) -> io::Result<Self> {
        std::fs::create_dir_all(&dir)?;
        let lock = lock(&dir)?;
        let (mut files, strays) = list(&dir)?;
        let (state, known) = State::read(&dir);
        let mut notices = vec![];
        if strays > 0 {
            notices.push(format!(
                "spool: {strays} files that are not its own are left alone"
            ));
        }
        if state.is_harmed {
            notices.push("spool: state is harmed; all that is there is sent again".to_owned());
        }
        let mut names: Vec<String> = boards.map(str::to_owned).collect();
        // Those of boards that are no longer configured are sent all the same.
        let left = files.keys().filter(|board| !names.contains(board));
        let left: Vec<String> = left.cloned().collect();
        names.extend(left);
        let lanes = names.iter().map(|board| {
            let known = known.get(board).copied().unwrap_or_default();
            Lane::open(&dir, board, files.remove(board).unwrap_or_default(), known)
        });
        let lanes: Vec<Lane> = lanes.collect();
        let mut spool = Self {
            syncer: Syncer::start(&dir)?,
            dir,
            max_bytes,
            _lock: lock,
            again_at: vec![None; lanes.len()],
            lanes,
            turn: 0,
            state,
            changed: false,
            written: BTreeSet::new(),
            sync_at: Instant::now() + SYNC,
            spare: vec![],
            losses: Losses::default(),
            trouble: None,
            notices,
        };
        spool.save_descriptors();
        spool.clean(spool.segment_bytes() / 4);
        Ok(spool)
    }

    /// Keeps an entry: on disk, and where that is not possible in memory.
    pub(super) fn push(&mut self, entry: &Entry) {
        let Some(index) = self.lanes.iter().position(|one| one.board == entry.board) else {
            return;
        };
        match self.write(index, entry) {
            Ok((is_new, path)) => {
                self.written.insert(path);
                if let Some(trouble) = self.trouble.take() {
                    self.notices
                        .push(format!("spool: is written again ({trouble})"));
                }
                if is_new {
                    self.make_room();
                }
            }
            Err(error) => {
                let trouble = error.to_string();
                if self.trouble.is_none() {
                    let dir = self.dir.display();
                    self.notices.push(format!(
                        "spool: {dir}: cannot be written: {trouble}; reports wait in memory"
                    ));
                }
                self.trouble = Some(trouble);
                let most = (MEMORY / self.lanes.len()).max(10);
                let lost = self.lanes[index].remember(entry, most);
                self.losses.add(&entry.board, Why::NotKept, lost);
            }
        }
    }

    /// Writes it, making room where the disk is full.
    fn write(&mut self, index: usize, entry: &Entry) -> io::Result<(bool, PathBuf)> {
        let segment_bytes = self.segment_bytes();
        let mut tries = 0;
        loop {
            let done = self.lanes[index].push(&self.dir, entry, segment_bytes);
            let Err(error) = done else { return done };
            tries += 1;
            let freed = match error.kind() {
                _ if tries > 4 => false,
                ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                    // First what is not needed; then the oldest.
                    (tries == 1 && self.clean(0)) || self.give_up(segment_bytes / 2, Why::DiskFull)
                }
                _ => self.free_descriptors(&error),
            };
            if !freed {
                return Err(error);
            }
        }
    }

    /// The next record to send, the boards taking turns.
    pub(super) fn next_record(&mut self, now: Instant) -> Option<(Mark, Record)> {
        for _ in 0..self.lanes.len() {
            self.turn = (self.turn + 1) % self.lanes.len();
            let index = self.turn;
            if self.again_at[index].is_some_and(|at| now < at) {
                continue;
            }
            let mut next = self.lanes[index].next(&self.dir);
            if let Err(error) = &next
                && self.free_descriptors(error)
            {
                next = self.lanes[index].next(&self.dir);
            }
            let lane = &mut self.lanes[index];
            let harmed = lane.take_harmed();
            self.losses.add(&lane.board, Why::Harmed, harmed);
            match next {
                Ok(None) => self.again_at[index] = None,
                Ok(Some((at, record))) => {
                    self.again_at[index] = None;
                    let (lane, id) = (index, record.id);
                    return Some((Mark { lane, id, at }, record));
                }
                Err(error) => {
                    if self.again_at[index].replace(now + AGAIN).is_none() {
                        let board = &lane.board;
                        self.notices.push(format!(
                            "{board}: its spool cannot be read: {error}; trying again"
                        ));
                    }
                }
            }
        }
        None
    }

    /// The broker has this board's records up to this one.
    pub(super) fn acknowledge(&mut self, mark: Mark) {
        if let Some(lane) = self.lanes.get_mut(mark.lane) {
            lane.acknowledge(mark.id, mark.at);
            self.changed = true;
        }
    }

    /// Starts again behind the last records that were acknowledged.
    pub(super) fn rewind(&mut self) {
        self.lanes.iter_mut().for_each(Lane::rewind);
    }

    /// Of this record it is known that it cannot be published: it is kept in a file of such, counted,
    /// and said.
    pub(super) fn set_aside(&mut self, record: &Record) {
        self.losses.add(&record.entry.board, Why::SetAside, 1);
        let keep = || {
            let path = self.dir.join("aside");
            let mut file = OpenOptions::new().append(true).create(true).open(path)?;
            let bytes = record.to_bytes().map_err(io::Error::other)?;
            if file.metadata()?.len() < ASIDE {
                file.write_all(&bytes)?;
            }
            io::Result::Ok(())
        };
        // It is counted all the same.
        let _ = keep();
    }

    /// Session and number up to which none of a board's reports was missing when the gateway ran the
    /// last time.
    pub(super) fn complete_of(&self, board: &str) -> Option<(u32, u32)> {
        let lane = self.lanes.iter().find(|lane| lane.board == board)?;
        lane.known.complete
    }

    /// All reports up to this one were pushed, or are given up.
    pub(super) fn set_complete(&mut self, board: &str, complete: (u32, u32)) {
        // What memory alone holds is better asked for again after a crash.
        if self.trouble.is_none()
            && let Some(lane) = self.lanes.iter_mut().find(|one| one.board == board)
        {
            self.changed |= lane.known.complete != Some(complete);
            lane.known.complete = Some(complete);
        }
    }

    /// Writes down how far all is, and removes what is no longer needed: to be called now and then.
    pub(super) fn save(&mut self, now: Instant) {
        self.clean(self.segment_bytes() / 4);
        self.save_descriptors();
        if let Some((complete, outcome)) = self.syncer.ended() {
            self.synchronised(&complete, outcome);
        }
        if now >= self.sync_at && !self.syncer.is_busy() {
            self.sync_at = now + SYNC;
            self.begin_sync();
        }
        self.write_state();
        self.losses.say(now, &mut self.notices);
    }

    /// The last [`Spool::save`]: all is on the disk when it is done.
    pub(super) fn finish(&mut self) {
        for _ in 0..2 {
            if let Some((complete, outcome)) = self.syncer.wait() {
                self.synchronised(&complete, outcome);
            }
            self.begin_sync();
        }
        if let Some((complete, outcome)) = self.syncer.wait() {
            self.synchronised(&complete, outcome);
        }
        self.save(Instant::now());
    }

    fn begin_sync(&mut self) {
        let known = |lane: &Lane| lane.known.complete == lane.known.on_disk;
        if self.written.is_empty() && self.lanes.iter().all(known) {
            return;
        }
        let complete = self.lanes.iter().map(|lane| lane.known.complete);
        let complete = complete.collect();
        self.written.extend(state::paths(&self.dir));
        self.syncer.begin(&mut self.written, complete);
    }

    fn synchronised(&mut self, complete: &Complete, outcome: io::Result<()>) {
        if let Err(error) = outcome {
            self.notices
                .push(format!("spool: cannot be synchronised: {error}"));
            return;
        }
        for (lane, &complete) in self.lanes.iter_mut().zip(complete) {
            self.changed |= lane.known.on_disk != complete;
            lane.known.on_disk = complete;
        }
    }

    fn write_state(&mut self) {
        if !self.changed {
            return;
        }
        let boards = self.lanes.iter();
        let boards = boards.map(|lane| (lane.board.as_str(), lane.known));
        match self.state.write(boards) {
            Ok(()) => self.changed = false,
            // The last one holds, so what is acknowledged since is sent again after a crash.
            Err(error) => {
                self.free_descriptors(&error);
            }
        }
    }

    /// What is to be said since the last call.
    pub(super) fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    /// Records that were lost, for whatever reason.
    pub(super) fn dropped(&self) -> u64 {
        self.losses.count()
    }

    /// Bytes that wait to be acknowledged.
    pub(super) fn waiting(&self) -> u64 {
        self.lanes.iter().map(Lane::waiting).sum()
    }

    /// Length at which a new file is begun: each board has some, so that the oldest can go.
    fn segment_bytes(&self) -> u64 {
        let boards = self.lanes.len().max(1) as u64;
        (self.max_bytes / (16 * boards)).clamp(4096, 256 * 1024)
    }

    /// Removes what is acknowledged; whether that freed anything.
    fn clean(&mut self, last_from: u64) -> bool {
        let before: u64 = self.lanes.iter().map(Lane::bytes).sum();
        for lane in &mut self.lanes {
            lane.clean(&self.dir, last_from);
        }
        before > self.lanes.iter().map(Lane::bytes).sum()
    }

    /// Drops the oldest files while there is more than allowed.
    fn make_room(&mut self) {
        // Each board's newest file may grow by a sixteenth of its share before this is called again.
        let most = self.max_bytes - self.max_bytes / 16;
        while self.lanes.iter().map(Lane::bytes).sum::<u64>() > most {
            if !self.clean(0) && !self.give_up(1, Why::NoRoom) {
                return;
            }
        }
    }

    /// The board that takes most gives up its oldest file.
    fn give_up(&mut self, last_from: u64, why: Why) -> bool {
        let lanes = self.lanes.iter_mut();
        let able = lanes.filter(|lane| lane.can_give_up(last_from));
        let Some(lane) = able.max_by_key(|lane| lane.bytes()) else {
            return false;
        };
        let lost = lane.give_up_oldest(&self.dir);
        self.losses.add(&lane.board, why, lost);
        true
    }

    /// Takes what may be had to be used when there is nothing more to be had.
    fn save_descriptors(&mut self) {
        while self.spare.len() < SPARE
            && let Ok(file) = File::open(self.dir.join("lock"))
        {
            self.spare.push(file);
        }
    }

    /// Whether one was given back for this error.
    fn free_descriptors(&mut self, error: &io::Error) -> bool {
        // EMFILE and ENFILE, for which Rust has no kind.
        matches!(error.raw_os_error(), Some(23 | 24)) && self.spare.pop().is_some()
    }
}

/// Locks the directory, until the file is closed or the process is gone.
fn lock(dir: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    let options = options.read(true).write(true).create(true).truncate(false);
    let mut file = options.open(dir.join("lock"))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            let mut holder = String::new();
            let _ = (&mut file).take(20).read_to_string(&mut holder);
            let holder = holder.trim();
            return Err(io::Error::other(format!(
                "another gateway uses it (process {holder}); give each a directory of its own"
            )));
        }
        Err(TryLockError::Error(error)) => return Err(error),
    }
    // Only for whoever wonders.
    let _ = file.rewind();
    let _ = file.write_all(format!("{}\n", std::process::id()).as_bytes());
    Ok(file)
}

/// Of each board the lengths of its files, by their first records.
type Files = BTreeMap<String, BTreeMap<u64, u64>>;

/// The files of each board, and how many others there are.
fn list(dir: &Path) -> io::Result<(Files, u32)> {
    let (mut files, mut strays) = (Files::new(), 0);
    for entry in std::fs::read_dir(dir)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_str().unwrap_or("");
        let length = entry.metadata().ok().filter(std::fs::Metadata::is_file);
        match (name::parse(name), length) {
            (Some((board, first)), Some(meta)) => {
                files.entry(board).or_default().insert(first, meta.len());
            }
            _ if matches!(
                name,
                "lock" | "state.0" | "state.1" | "aside" | "births" | "births.new"
            ) => {}
            _ => strays += 1,
        }
    }
    Ok((files, strays))
}

#[cfg(test)]
mod tests;
