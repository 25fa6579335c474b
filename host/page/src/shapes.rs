//! Shapes of the tones of the last report, over the pictures that are kept: what vibrates where.
//!
//! They are measured on the thread of whoever asks, from the last pictures (`rowtone_measure::shapes`), so that the camera's
//! side does nothing for them; no more often than every [`EVERY`], however many ask.

use std::io::Cursor;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rowtone_clip::{CameraOptions, Feed, Times};
use rowtone_measure::shapes::tones::Found;
use rowtone_measure::shapes::{self, Wanted};
use serde_json::{Value, json};

use crate::frames::{Layout, Shot};
use crate::live::Live;

/// They are measured anew no more often than this.
const EVERY: Duration = Duration::from_secs(2);
/// Most pictures that are read: the sums of two seconds cost a Raspberry Pi as much as it has time for.
const MOST_FRAMES: usize = 240;
/// Side of a tile, px.
const TILE_PX: u16 = 16;
/// Most tones.
const MOST_TONES: usize = 4;

/// The last answer.
#[derive(Debug, Default)]
pub(crate) struct Latest(Mutex<Option<(Instant, Arc<str>)>>);

impl Latest {
    /// The shapes as JSON, made anew where the last ones are old.
    ///
    /// # Errors
    /// Why there are none, in a sentence without a stop.
    pub(crate) fn get(&self, live: &Live) -> Result<Arc<str>, String> {
        live.frames.want();
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((at, text)) = &*last
            && at.elapsed() < EVERY
        {
            return Ok(Arc::clone(text));
        }
        let text: Arc<str> = measured(live)?.to_string().into();
        // Counted from when it is done: whoever is slow is not asked all the time.
        *last = Some((Instant::now(), Arc::clone(&text)));
        Ok(text)
    }
}

/// The last pictures as a clip whose neighbouring pixels are of one colour.
struct Clip {
    bytes: Vec<u8>,
    starts_ns: Vec<i64>,
    /// Pixels of the camera for one of the clip, along both axes.
    side: usize,
}

impl Clip {
    fn last(live: &Live) -> Option<Self> {
        let mut shots: Vec<Shot> = Vec::new();
        live.frames.last(|shot| {
            if shots
                .first()
                .is_none_or(|first| first.layout == shot.layout)
            {
                shots.push(shot.clone());
            }
        });
        let shots = &shots[shots.len().saturating_sub(MOST_FRAMES)..];
        let layout = shots.first()?.layout;
        let side = if layout.bayer { 2 } else { 1 };
        let mut bytes = head(&layout, side).into_bytes();
        for shot in shots {
            bytes.extend_from_slice(b"FRAME\n");
            if side == 1 {
                (0..usize::from(layout.height)).for_each(|row| shot.full_row(row, &mut bytes));
            } else {
                binned(shot, &mut bytes);
            }
        }
        Some(Self {
            bytes,
            starts_ns: shots.iter().map(|shot| shot.start_ns).collect(),
            side,
        })
    }
}

fn head(layout: &Layout, side: usize) -> String {
    // The sum of four pixels has two bits more.
    let bits = match (layout.format.bits(), side) {
        (bits, 1) => bits,
        (8, _) => 10,
        (10, _) => 12,
        _ => 16,
    };
    let depth = if bits == 8 {
        String::new()
    } else {
        bits.to_string()
    };
    let [width, height] = [layout.width, layout.height].map(|px| usize::from(px) / side);
    format!("YUV4MPEG2 W{width} H{height} F60:1 Ip A1:1 Cmono{depth}\n")
}

/// Sums of two by two pixels, of all colours of a mosaic.
fn binned(shot: &Shot, bytes: &mut Vec<u8>) {
    let wide = shot.layout.format.bits() > 8;
    let row = |number: usize| -> Vec<u16> {
        let mut row = Vec::new();
        shot.full_row(number, &mut row);
        if wide {
            row.chunks_exact(2)
                .map(|v| u16::from_le_bytes([v[0], v[1]]))
                .collect()
        } else {
            row.into_iter().map(u16::from).collect()
        }
    };
    for pair in 0..usize::from(shot.layout.height) / 2 {
        let (upper, lower) = (row(2 * pair), row(2 * pair + 1));
        for (a, b) in upper.chunks_exact(2).zip(lower.chunks_exact(2)) {
            let sum = [a[0], a[1], b[0], b[1]].map(u32::from).iter().sum::<u32>();
            bytes.extend(u16::try_from(sum).unwrap_or(u16::MAX).to_le_bytes());
        }
    }
}

fn measured(live: &Live) -> Result<Value, String> {
    let about = live.about();
    let report = live
        .reports
        .last()
        .ok_or("no report yet: the first one comes after a window")?;
    let peaks = report.report.peaks.iter().filter(|peak| !peak.ambiguous);
    let known: Vec<Found> = peaks
        .take(MOST_TONES)
        .map(|peak| Found {
            hz: peak.hz.into(),
            amplitude_px: peak.amplitude_px.into(),
        })
        .collect();
    let clip =
        Clip::last(live).ok_or("there are no pictures yet, or none at all over a serial line")?;
    let frames = clip.starts_ns.len();
    let side = clip.side;
    let line_us = about.line_time_us.unwrap_or(0.0);
    let options = CameraOptions {
        // Two rows are one: it is exposed half a line later, which turns all tiles alike.
        line_time_us: (line_us > 0.0).then_some(line_us * side as f64),
        global_shutter: line_us <= 0.0,
        exposure_us: about.exposure_us,
        ..CameraOptions::of("the last pictures")
    };
    let bytes: Arc<[u8]> = clip.bytes.into();
    let times = Times::new(clip.starts_ns, about.fps).ok_or("the pictures are too few yet")?;
    let wanted = Wanted {
        tile_px: TILE_PX / side as u16,
        most: MOST_TONES,
        known: Some(known),
        ..Wanted::default()
    };
    let open = || {
        Ok(Feed::at_times(
            &options,
            Cursor::new(Arc::clone(&bytes)),
            times.clone(),
        )?)
    };
    let shapes = shapes::measure_from(open, &wanted, |_| ()).map_err(|e| e.to_string())?;
    let scale = report.report.um_per_px.map(f64::from);
    let mut objects = shapes.objects(scale);
    for object in &mut objects {
        let px = side as f64;
        object.tile *= side;
        for value in object.x.iter_mut().chain(&mut object.y).flatten().flatten() {
            *value *= px;
        }
        let deviations = [&mut object.sd, &mut object.x_sd, &mut object.y_sd];
        deviations
            .into_iter()
            .flatten()
            .flatten()
            .for_each(|sd| *sd *= px);
    }
    Ok(json!({
        "report": report.id,
        "frames": frames,
        "size": [shapes.grid.width() * side, shapes.grid.height() * side],
        "notes": shapes.notes,
        "shapes": objects,
    }))
}
