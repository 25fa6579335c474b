//! The pictures of a video file, one after the other.

use std::path::{Path, PathBuf};

use super::decoder::Decoder;
use super::programs::{Dialect, without_name};
use super::showinfo::{Said, Shown};
use super::{Error, Luma, Probe, Ratio};

/// A video file that is being decoded.
#[derive(Debug)]
pub struct Video {
    path: PathBuf,
    decoder: Decoder,
    size: (usize, usize),
    frame_bytes: usize,
    time_base: Option<Ratio>,
    /// What has been said of a picture that is still to come.
    ahead: Option<Shown>,
    frames: u64,
    complaints: u64,
    complaint: Option<String>,
}

impl Video {
    /// Starts ffmpeg on a file that [`probe`](super::probe()) has looked at, and waits for its first picture.
    ///
    /// # Errors
    /// [`Error`] without ffmpeg, or where it gives up before the first picture.
    pub fn open(path: &Path, probe: &Probe) -> Result<Self, Error> {
        let luma = Luma::of(&probe.pixel_format);
        let size = (usize::from(probe.width), usize::from(probe.height));
        let bytes_per_value = if luma.bits > 8 { 2 } else { 1 };
        let mut dialect = Dialect::NEWEST;
        loop {
            let mut video = Self {
                path: path.to_owned(),
                decoder: Decoder::start(path, &luma.filter, dialect)?,
                size,
                frame_bytes: size.0 * size.1 * bytes_per_value,
                time_base: probe.time_base,
                ahead: None,
                frames: 0,
                complaints: 0,
                complaint: None,
            };
            video.ahead = video.announced();
            if video.ahead.is_some() || (video.decoder.ended_well() && video.complaint.is_none()) {
                return Ok(video);
            }
            let reason = video
                .complaint
                .take()
                .unwrap_or_else(|| "it gives no reason".to_owned());
            dialect = match dialect.older(&reason) {
                Some(older) => older,
                None => return Err(Error::Refused(without_name(&reason, path))),
            };
        }
    }

    /// Bytes of a picture.
    pub fn frame_bytes(&self) -> usize {
        self.frame_bytes
    }

    /// Unit of the times in [`Shown`], s, where the file holds times.
    pub fn time_base(&self) -> Option<Ratio> {
        self.time_base
    }

    /// Reads the next picture's luma into `buffer`, row by row from the top; `None` after the last one.
    ///
    /// # Errors
    /// [`Error::SizeChanges`] at a picture of another size, [`Error`] when ffmpeg's answer cannot be read.
    pub fn next_frame(&mut self, buffer: &mut Vec<u8>) -> Result<Option<Shown>, Error> {
        let Some(shown) = self.ahead.take().or_else(|| self.announced()) else {
            self.end();
            return Ok(None);
        };
        if shown.size != self.size {
            return Err(Error::SizeChanges {
                frame: self.frames,
                from: self.size,
                to: shown.size,
            });
        }
        buffer.resize(self.frame_bytes, 0);
        let have = self
            .decoder
            .read(buffer)
            .map_err(|error| Error::Program("ffmpeg", error))?;
        if have < self.frame_bytes {
            // It met its end between the two.
            while self.announced().is_some() {}
            self.end();
            return Ok(None);
        }
        self.frames += 1;
        Ok(Some(shown))
    }

    /// What ffmpeg complained of while it decoded, for the user, once there are no more pictures.
    pub fn warning(&self) -> Option<String> {
        let first = without_name(self.complaint.as_deref()?, &self.path);
        let frames = self.frames;
        Some(match self.complaints {
            1 => format!("ffmpeg read {frames} frames and complained: {first}"),
            more => {
                format!("ffmpeg read {frames} frames and complained {more} times, first: {first}")
            }
        })
    }

    /// It has said everything: an end that is not its own is a complaint too.
    fn end(&mut self) {
        if !self.decoder.ended_well() && self.complaint.is_none() {
            self.complaints += 1;
            self.complaint = Some("it was ended before the file was".to_owned());
        }
    }

    /// Waits for word of the next picture; `None` when there is none.
    fn announced(&mut self) -> Option<Shown> {
        loop {
            match self.decoder.hear()? {
                Said::Frame(shown) => return Some(shown),
                Said::TimeBase(base) => self.time_base = Some(base),
                Said::Error(complaint) => {
                    self.complaints += 1;
                    self.complaint.get_or_insert(complaint);
                }
                Said::Nothing => {}
            }
        }
    }
}
