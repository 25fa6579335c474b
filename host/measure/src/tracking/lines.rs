//! The line thread: learns the reference, then measures every line of every frame.

use std::panic::resume_unwind;
use std::thread;

use rowtone::report::{Warning, Warnings};
use rowtone::timeline::{Displacement, Group, Sample};
use rowtone::tracker::Axes;

use super::codec;
use super::columns::{self, Steadiness};
use super::region::{self, Choice, Region};
use super::together::Together;
use super::{Chosen, Ending, Engine, Finale, FrameShifts, Wanted, background};
use crate::MeasureError;
use rowtone_clip::ffmpeg::{FrameKind, Probe};
use rowtone_clip::ring::Outlet;
use rowtone_clip::{Camera, ClipError, Feed, Frame, Rect};
use rowtone_memory::TrackerMemory;

/// Frames that the reference is learned from.
const LEARN_FRAMES: usize = 30;
/// Which part vibrates is chosen by so much of a file, s, and by at most so many frames: thirty frames of a high-speed camera
/// may be less than a period.
const CHOOSE_S: f64 = 0.5;
const CHOOSE_FRAMES: usize = 256;
/// The rows of a frame that is read in this time are measured together where a codec has been at them, ns.
const BRIEF_NS: f64 = 4e6;
/// Frames of a file that tell its sensor's pattern, and how many bytes of luma they take at most.
const PATTERN_FRAMES: usize = 120;
const PATTERN_BYTES: usize = 128 << 20;
/// Frames of the first round.
const ROUGH_FRAMES: usize = 10;
/// Key frames that their own reference is learned from.
const LEARN_KEYS: usize = 120;
/// Fewer where they are so large that keeping them would take more than this, bytes of luma.
const LEARN_BYTES: usize = 512 << 20;

/// Runs to the end of the recording.
pub(super) fn run(
    mut feed: Feed,
    part: Rect,
    groups: Option<Group>,
    mut to: Outlet<FrameShifts, Ending>,
) {
    let ending = measure_all(&mut feed, part, groups, &mut to);
    to.end(ending);
}

fn measure_all(
    feed: &mut Feed,
    part: Rect,
    groups: Option<Group>,
    to: &mut Outlet<FrameShifts, Ending>,
) -> Ending {
    let axes = super::axes_of_both(&part, &feed.camera);
    let memory_for = |part: &Rect| TrackerMemory::for_axes(part.width, part.height, axes);
    let mut memory = memory_for(&part);
    let mut still_memory = feed.camera.background.as_ref().map(memory_for);
    let mut across_memory = None;
    let (kept, more) = keep_first(feed);
    let early = &kept[..kept.len().min(to_choose_by(feed))];
    if kept.len() < 2 {
        more?;
        let name = feed.name.clone();
        return Err(MeasureError::OneFrame { name });
    }
    let whole = Region::whole(&part);
    let mut lines = Lines::new(
        feed,
        part,
        &whole,
        groups,
        &mut memory,
        still_memory.as_mut(),
    )?;
    // A reference is learned from frames that follow each other.
    let first = &kept[..kept.len().min(LEARN_FRAMES)];
    let choice = lines.learn_roughly_and_choose(&feed.camera, early, &part);
    let region = choice.region;
    lines.chosen = Some(Chosen {
        part: as_given(&region, &feed.camera),
        shake_px: choice.shake_px,
        keyed: false,
    });
    let mut notes = std::mem::take(&mut feed.notes);
    if region != whole {
        notes.push(told(&region, &feed.camera));
        let chosen = lines.chosen;
        lines = Lines::new(
            feed,
            part,
            &region,
            groups,
            &mut memory,
            still_memory.as_mut(),
        )?;
        lines.chosen = chosen;
        lines.learn_roughly(first);
    }
    lines.learn(first, 1);
    if let Some(cut) = early.iter().find(|frame| frame.is_cut()) {
        return Err(feed.cut_short(cut).into());
    }
    // What a codec or a denoiser took shows in the part that is measured.
    let seen = Rect {
        x: region.columns.start,
        y: region.rows.start,
        width: region.columns.len(),
        height: region.rows.len(),
    };
    let probe = feed.about.probe.as_ref();
    if probe.is_some_and(Probe::is_sparse) || codec::is_between(first, &seen) {
        lines.found.insert(Warning::Compressed);
        let keyed =
            groups.is_some() && camera_has_none(feed) && probe.is_some_and(Probe::is_predicted);
        lines.together = is_brief(&feed.camera).then(|| {
            let columns = Rect {
                x: seen.x,
                width: seen.width,
                ..part
            };
            let first = seen.y - part.y;
            let exposed = (feed.camera.timing, axes);
            let rows = first..first + seen.height;
            Together::learn((columns, rows), exposed, groups, early)
        });
        // The few key frames of a high-speed recording of so few bits see too little of a period.
        let few = lines.together.is_some() && probe.is_some_and(Probe::is_sparse);
        lines.keys = (keyed && !few).then(Vec::new);
        if let Some(chosen) = &mut lines.chosen {
            chosen.keyed = keyed;
        }
    } else {
        let both = (axes == Axes::Xy && feed.camera.background.is_none())
            .then(|| Steadiness::of(&mut lines.moving, first));
        if let Some(both) = both {
            let chosen = lines.chosen;
            // What was measured may have led it astray: it learns anew.
            lines = Lines::new(feed, part, &region, groups, &mut memory, None)?.learned(first);
            if !both.is_plain(seen.height, first.len()) {
                let room =
                    across_memory.insert(TrackerMemory::for_axes(part.width, part.height, Axes::X));
                let camera = feed.camera.clone();
                feed.camera.axes = Axes::X;
                let across = Lines::new(feed, part, &region, groups, room, None);
                feed.camera = camera;
                let mut across = across?.learned(first);
                if Steadiness::of(&mut across.moving, first).tells_of_loss(&both) {
                    notes.push(columns::LOST.to_owned());
                    lines = across;
                }
            }
            lines.chosen = chosen;
        }
        // A codec leaves no pattern of the sensor's.
        lines.mend_pattern(&kept);
    }
    let ended = lines.run(feed, kept, more, notes, to)?;
    let Some(Measured { warning, keys }) = ended else {
        return Ok(Finale::default());
    };
    let samples = match (groups, keys.len()) {
        (Some(group), 2..) => {
            let mut memory = memory_for(&part);
            measure_keys(feed, &keys, [part, seen], group, &mut memory)?
        }
        _ => Vec::new(),
    };
    Ok(Finale {
        warning,
        keys: samples,
    })
}

/// A frame is exposed within so short a time that its rows follow one smooth motion.
fn is_brief(camera: &Camera) -> bool {
    let rows = camera.size.1 as f64;
    f64::from(camera.timing.line_time_ps()) * 1e-3 * rows <= BRIEF_NS
}

/// No background is subtracted, whose key frames would have to be measured too.
fn camera_has_none(feed: &Feed) -> bool {
    feed.camera.background.is_none()
}

/// The samples of key frames, the reference learned from themselves; of what was `seen` of a part.
fn measure_keys(
    feed: &Feed,
    keys: &[Frame],
    [part, seen]: [Rect; 2],
    group: Group,
    memory: &mut TrackerMemory,
) -> Result<Vec<Sample>, MeasureError> {
    let region = Region {
        columns: seen.x..seen.x + seen.width,
        rows: seen.y..seen.y + seen.height,
    };
    let mut lines = Lines::new(feed, part, &region, Some(group), memory, None)?;
    let few = &keys[..keys.len().min(LEARN_KEYS)];
    lines.learn_roughly(few);
    lines.learn(few, 1);
    let mut samples = Vec::new();
    for frame in keys {
        lines
            .moving
            .measure_into(frame, |reading| samples.extend(reading.sample));
    }
    Ok(samples)
}

/// A region as the user gives it: in the picture as it was.
fn as_given(region: &Region, camera: &Camera) -> Rect {
    let Region { columns, rows } = region;
    let part = Rect {
        x: columns.start,
        y: rows.start,
        width: columns.len(),
        height: rows.len(),
    };
    let (width, height) = camera.size;
    camera.turn.back().part(part, width, height)
}

/// What `--roi auto` chose.
fn told(region: &Region, camera: &Camera) -> String {
    let part = as_given(region, camera);
    format!(
        "--roi auto measures {},{},{},{}: the rest does not move with it (--roi full for all of it)",
        part.x, part.y, part.width, part.height
    )
}

/// How many frames tell which part to measure, and the reference.
fn to_choose_by(feed: &Feed) -> usize {
    let chooses = feed.camera.part.is_none() && feed.frames.is_some();
    match chooses {
        true => ((CHOOSE_S * feed.camera.fps) as usize).clamp(LEARN_FRAMES, CHOOSE_FRAMES),
        false => LEARN_FRAMES,
    }
}

/// The frames to choose the part by, to learn from and to know the sensor's pattern by, and whether more follow.
fn keep_first(feed: &mut Feed) -> (Vec<Frame>, Result<bool, ClipError>) {
    let (width, height) = feed.camera.size;
    // What comes through a pipe may be live, and does not wait.
    let of_pattern = match feed.frames {
        Some(_) => (PATTERN_BYTES / (width * height)).min(PATTERN_FRAMES),
        None => 0,
    };
    let wanted = to_choose_by(feed).max(of_pattern);
    let most = (LEARN_BYTES / (width * height)).clamp(2, wanted);
    let mut kept = Vec::new();
    while kept.len() < most {
        match feed.next_frame() {
            Ok(Some(frame)) => kept.push(frame),
            Ok(None) => return (kept, Ok(false)),
            Err(error) => return (kept, Err(error)),
        }
    }
    (kept, Ok(true))
}

/// All frames have been measured: the feed's warning, and the key frames that were kept.
struct Measured {
    warning: Option<String>,
    keys: Vec<Frame>,
}

/// State of the line thread.
struct Lines<'a> {
    moving: Engine<'a>,
    still: Option<Engine<'a>>,
    /// The background's rows of this frame.
    still_rows: Vec<Displacement>,
    /// Where a codec has been at rows that were exposed nearly at once.
    together: Option<Together>,
    /// The key frames, where a codec took something of the others.
    keys: Option<Vec<Frame>>,
    /// Rows are combined to readings.
    combines: bool,
    /// That stripes were mistaken was told.
    slips_told: bool,
    /// What is measured, until the first frame takes it along.
    chosen: Option<Chosen>,
    /// What was found out about the recording and has not been sent yet.
    found: Warnings,
}

/// What is told when stripes were mistaken.
const SLIPPED: &str = "the texture repeats along the rows and was read at another of its stripes: amplitudes and further peaks are not to be trusted; measure a part that does not repeat (--roi)";

impl<'a> Lines<'a> {
    fn new(
        feed: &Feed,
        part: Rect,
        region: &Region,
        groups: Option<Group>,
        memory: &'a mut TrackerMemory,
        still_memory: Option<&'a mut TrackerMemory>,
    ) -> Result<Self, MeasureError> {
        let camera = &feed.camera;
        let learn = LEARN_FRAMES as u16;
        let axes = super::axes_of_both(&part, camera);
        let engine = |part, group, memory| {
            let (timing, bits) = (camera.timing, camera.bits);
            let wanted = Wanted { axes, group };
            Engine::new(part, timing, wanted, bits, learn, memory).map_err(|why| {
                let name = feed.name.clone();
                MeasureError::Part { name, why }
            })
        };
        let columns = Rect {
            x: region.columns.start,
            width: region.columns.len(),
            ..part
        };
        let first = region.rows.start - part.y;
        let moving = engine(columns, groups, memory)?.only_rows(first..first + region.rows.len());
        let still = match (camera.background, still_memory) {
            (Some(part), Some(memory)) => Some(engine(part, None, memory)?),
            _ => None,
        };
        Ok(Self {
            moving,
            still,
            still_rows: Vec::new(),
            together: None,
            keys: None,
            combines: groups.is_some(),
            slips_told: false,
            chosen: None,
            found: Warnings::NONE,
        })
    }

    /// The first round of learning, and which part of `part` vibrates, where that is asked for: chosen on another thread
    /// while this one learns all of it, for mostly that is what is chosen.
    fn learn_roughly_and_choose(&mut self, camera: &Camera, kept: &[Frame], part: &Rect) -> Choice {
        let first = &kept[..kept.len().min(LEARN_FRAMES)];
        if camera.part.is_some() {
            self.learn_roughly(first);
            return Choice {
                region: Region::whole(part),
                shake_px: None,
            };
        }
        thread::scope(|scope| {
            let choice = scope.spawn(|| region::choose(kept, part, &camera.timing));
            self.learn_roughly(first);
            choice.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    }

    /// After both rounds of learning.
    fn learned(mut self, first: &[Frame]) -> Self {
        self.learn_roughly(first);
        self.learn(first, 1);
        self
    }

    /// The first round only has to find the motion: some frames, spread over all of them, will do.
    fn learn_roughly(&mut self, kept: &[Frame]) {
        self.learn(kept, kept.len().div_ceil(ROUGH_FRAMES));
    }

    /// A round of learning, of one in `step` frames.
    fn learn(&mut self, kept: &[Frame], step: usize) {
        let engines = [Some(&mut self.moving), self.still.as_mut()];
        for engine in engines.into_iter().flatten() {
            kept.iter()
                .step_by(step)
                .for_each(|frame| engine.learn(frame));
            engine.end_round();
        }
    }

    /// What the sensor's fixed pattern takes of the motion is made good.
    fn mend_pattern(&mut self, kept: &[Frame]) {
        let whole = kept.iter().take_while(|frame| !frame.is_cut()).count();
        let engines = [Some(&mut self.moving), self.still.as_mut()];
        for engine in engines.into_iter().flatten() {
            engine.mend_pattern(&kept[..whole]);
        }
    }

    /// Measures every frame; then the feed's warning and the key frames that were kept, or nothing where nobody listens.
    fn run(
        &mut self,
        feed: &mut Feed,
        kept: Vec<Frame>,
        mut more: Result<bool, ClipError>,
        mut notes: Vec<String>,
        to: &mut Outlet<FrameShifts, Ending>,
    ) -> Result<Option<Measured>, MeasureError> {
        for frame in kept {
            if !self.measure(feed, frame, std::mem::take(&mut notes), to)? {
                return Ok(None);
            }
        }
        while let Ok(true) = more {
            match feed.next_frame() {
                Ok(Some(frame)) => {
                    if !self.measure(feed, frame, Vec::new(), to)? {
                        return Ok(None);
                    }
                }
                Ok(None) => more = Ok(false),
                Err(error) => more = Err(error),
            }
        }
        more?;
        let keys = self.keys.take().unwrap_or_default();
        Ok(Some(Measured {
            warning: feed.warning().map(str::to_owned),
            keys,
        }))
    }

    /// Measures a frame and sends what came of it. `false` when nobody listens any more.
    ///
    /// # Errors
    /// When the frame was cut off while it was read: nothing of it is sent.
    fn measure(
        &mut self,
        feed: &mut Feed,
        frame: Frame,
        notes: Vec<String>,
        to: &mut Outlet<FrameShifts, Ending>,
    ) -> Result<bool, MeasureError> {
        let Some(mut shifts) = to.spare() else {
            return Ok(false);
        };
        shifts.number = frame.number;
        shifts.start_ns = frame.start_ns;
        shifts.notes = notes;
        shifts.chosen = self.chosen.take();
        shifts.warnings = std::mem::take(&mut self.found);
        shifts.rows.clear();
        shifts.readings.clear();
        let (rows, readings) = (&mut shifts.rows, &mut shifts.readings);
        match (&mut self.still, &mut self.together) {
            (None, None) if self.combines => {
                self.moving
                    .measure_into(&frame, |reading| readings.push(reading));
            }
            (still, together) => {
                let became = match together {
                    Some(together) => Some(together.measure((frame.number, &frame), rows)),
                    None => {
                        self.moving.measure(&frame, |row| rows.push(row));
                        None
                    }
                };
                if let Some(still) = still {
                    self.still_rows.clear();
                    still.measure(&frame, |row| self.still_rows.push(row));
                    background::subtract(rows, &self.still_rows);
                }
                let take = |reading| readings.push(reading);
                match (together, became) {
                    _ if !self.combines => {}
                    (Some(together), Some(became)) => {
                        together.combine(rows.drain(..), (frame.number, became), take);
                    }
                    _ => self.moving.combine(rows.drain(..), take),
                }
            }
        }
        if self.moving.slipped() && !self.slips_told && shifts.notes.is_empty() {
            self.slips_told = true;
            shifts.notes.push(SLIPPED.to_owned());
        }
        if frame.is_cut() {
            return Err(feed.cut_short(&frame).into());
        }
        let is_key = frame
            .coding
            .is_some_and(|coding| coding.kind == FrameKind::Intra);
        let (width, height) = feed.camera.size;
        match &mut self.keys {
            Some(keys) if is_key && keys.len() < LEARN_BYTES / (width * height).max(1) => {
                keys.push(frame);
            }
            _ => feed.recycle(frame),
        }
        Ok(to.put(shifts))
    }
}
