//! The first frame of a recording, kept for the picture that `--plot` draws.

use std::sync::{Arc, Mutex, PoisonError};

use rowtone::camera::Pixels;
use rowtone_clip::{Feed, Frame, Rect};
use rowtone_plot::Photo;

/// The first frame, as soon as it has come.
#[derive(Clone, Debug, Default)]
pub(crate) struct FirstFrame(Arc<Mutex<Option<Photo>>>);

impl FirstFrame {
    /// Waits for the first frame of what `feed` delivers.
    pub(crate) fn of(feed: &mut Feed) -> Self {
        let first = Self::default();
        let (kept, (width, height)) = (first.clone(), feed.camera.size);
        feed.show_to(move |frame| {
            let mut photo = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
            photo.get_or_insert_with(|| taken(frame, width, height));
        });
        first
    }

    /// The frame with that part of it; nothing where there was none.
    pub(crate) fn with(&self, part: Rect) -> Option<Photo> {
        let photo = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        photo.clone().map(|photo| Photo {
            part: [part.x, part.y, part.width, part.height],
            ..photo
        })
    }
}

/// The frame in 8 bits, its brightest pixel white where it has more.
fn taken(frame: &Frame, width: usize, height: usize) -> Photo {
    let whole = Rect::whole(width, height);
    let mut deep: Vec<u16> = Vec::with_capacity(width * height);
    let mut is_deep = false;
    for row in 0..height {
        match frame.pixels(&whole, row) {
            Pixels::U8(row) => deep.extend(row.iter().map(|&v| u16::from(v))),
            Pixels::U16(row) => {
                is_deep = true;
                deep.extend_from_slice(row);
            }
            Pixels::Upper(row) => deep.extend(row.iter().map(u16::from)),
        }
    }
    let most = if is_deep {
        u32::from(deep.iter().copied().max().unwrap_or(0)).max(255)
    } else {
        255
    };
    let grey = deep
        .iter()
        .map(|&v| (u32::from(v) * 255 / most).min(255) as u8);
    Photo {
        grey: grey.collect(),
        size: (width, height),
        part: [0, 0, width, height],
    }
}
