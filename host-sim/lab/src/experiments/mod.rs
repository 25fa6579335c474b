//! The thesis's chapter 5 again, on simulated recordings through the camera: tables, figures, sounds.
//!
//! Every experiment films a motion with [`film::Setup`], lets each of [`film::Film::methods`] measure the same
//! pictures, and writes what came of it into a [`Folder`]. Row weights, gap filling and filters are the same for all
//! methods ([`sound`]), so that the tables compare shifts and nothing else.
//!
//! | file | thesis | what |
//! | --- | --- | --- |
//! | [`tones`] | Figs. 5.2, 5.3 | single tones in six frames |
//! | [`chirp`] | 5.4 | a ramp from 100 to 1000 Hz |
//! | [`voices`] | 5.5, 5.6, Tables 5.1, 5.2 | music and speech |
//! | [`highspeed`] | 5.6 | a global shutter; also a real recording |
//! | [`far`] | 5.8, 5.9 | far shifts: shearlet against steerable pyramid |
//! | [`phone`] | | 30 frames a second, 40 % of the time blank |

use std::path::{Path, PathBuf};

use crate::LabError;
use rowtone_plot::Drawing;

pub mod chirp;
pub mod far;
pub mod film;
pub mod highspeed;
pub mod phone;
pub mod sound;
pub mod tones;
pub mod voices;

/// How large the recordings are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Columns of the single tones' pictures; the thesis's camera had 1040.
    pub tone_cols: u32,
    /// Columns of the longer recordings' pictures.
    pub sound_cols: u32,
    /// Frames of chirp, music and speech, 120 a second.
    pub sound_frames: u32,
    /// Which recordings these are.
    pub seed: u64,
    /// Fine specks before a sharp lens instead of the usual ones.
    pub sharp: bool,
}

impl Scale {
    /// What docs/results holds: some minutes.
    pub const USUAL: Self = Self {
        tone_cols: 1040,
        sound_cols: 64,
        sound_frames: 240,
        seed: 1,
        sharp: false,
    };
    /// A look at it: a minute.
    pub const QUICK: Self = Self {
        tone_cols: 64,
        sound_cols: 48,
        sound_frames: 40,
        seed: 1,
        sharp: false,
    };
}

impl Scale {
    /// What a table says of the scene where it is not the usual one.
    fn of_what(self) -> &'static str {
        if self.sharp {
            ", specks of 0.7 px before a lens that passes 0.25 cycles/px"
        } else {
            ""
        }
    }
}

/// Where results go.
#[derive(Clone, Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// Made where it does not exist.
    ///
    /// # Errors
    /// [`LabError`] where it cannot be made.
    pub fn new(path: &Path) -> Result<Self, LabError> {
        std::fs::create_dir_all(path).map_err(|why| cannot_write(path, why))?;
        Ok(Self(path.to_owned()))
    }

    /// Path of a file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a table, and prints it.
    ///
    /// # Errors
    /// [`LabError`] where it cannot be written.
    pub fn table(&self, name: &str, text: &str) -> Result<(), LabError> {
        let path = self.file(name);
        std::fs::write(&path, text).map_err(|why| cannot_write(&path, why))?;
        println!("{text}");
        Ok(())
    }

    /// Writes a drawing: SVG or PNG, as the name ends.
    ///
    /// # Errors
    /// [`LabError`] where it cannot be drawn or written.
    pub fn drawing(&self, name: &str, drawing: &impl Drawing) -> Result<(), LabError> {
        Ok(rowtone_plot::write(&self.file(name), drawing)?)
    }

    /// Writes a sound, its peak at nine tenths of full scale, 16 bits.
    ///
    /// # Errors
    /// [`LabError`] where it cannot be written.
    pub fn wav(&self, name: &str, samples: &[f64], rate_hz: f64) -> Result<(), LabError> {
        let spec = hound::WavSpec {
            channels: 1,
            sample_rate: rate_hz.round() as u32,
            bits_per_sample: 16,
            sample_format: hound::SampleFormat::Int,
        };
        let path = self.file(name);
        let peak = samples.iter().fold(1e-12_f64, |m, v| m.max(v.abs()));
        let write = || -> Result<(), hound::Error> {
            let mut writer = hound::WavWriter::create(&path, spec)?;
            for value in samples {
                writer.write_sample((value / peak * 29_490.0) as i16)?;
            }
            writer.finalize()
        };
        write().map_err(|why| LabError::Sound {
            path: path.clone(),
            why,
        })
    }
}

/// Says what is being worked on.
fn working_on(what: &str) {
    eprintln!("rowtone: {what}");
}

fn cannot_write(path: &Path, why: std::io::Error) -> LabError {
    LabError::Write {
        path: path.to_owned(),
        why,
    }
}
