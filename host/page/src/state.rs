//! What changes from second to second, as JSON: state and advice, light and focus, counters.

use std::sync::atomic::Ordering;
use std::time::{Instant, SystemTime};

use serde_json::{Value, json};

use crate::advice;
use crate::csv::unix_s;
use crate::live::Live;
use crate::picture::Aim;

/// Frames of displacement that are shown.
pub(crate) const CURVE_FRAMES: u32 = 4;

/// All of it. `is_live`: reports come as something happens; `refused`: requests that were refused.
pub fn json(live: &Live, aim: Option<&Aim>, is_live: bool, refused: u64) -> Value {
    let (state, todo) = advice::state(live, aim, is_live, Instant::now());
    let last = live.reports.last();
    let (epoch, id) = live.reports.position();
    let (kept, missed) = live.frames.counts();
    json!({
        "state": state,
        "advice": todo,
        "live": is_live,
        "phase": live.phase().0,
        "about": live.about(),
        "version": env!("CARGO_PKG_VERSION"),
        "age_s": last.as_ref().map(|entry| entry.came.elapsed().as_secs_f64()),
        "time": unix_s(SystemTime::now()),
        "up_s": live.began.elapsed().as_secs(),
        "epoch": epoch,
        "id": id,
        "aim": aim,
        "counters": {
            "rows": live.lost.rows.load(Ordering::Relaxed),
            "lost_frames": live.lost.frames.load(Ordering::Relaxed),
            "dropped_reports": live.lost.reports.load(Ordering::Relaxed),
            "pictures": kept,
            "missed_pictures": missed,
            "refused_requests": refused,
        },
    })
}
