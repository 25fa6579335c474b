//! A displacement over time, as CSV, NPY or WAV.
//!
//! The offset of every row against its reference is arbitrary but constant, so each row's mean over the
//! whole recording has to go: a [`Series`] keeps 12 bytes a sample until the end.

use std::io::{self, Seek, Write};

/// Where a sample could not be measured, its information.
const NOT_MEASURED: f32 = 0.0;

/// One sample: some neighbouring rows of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Middle of exposure after the start of the frame, s.
    pub after_s: f32,
    /// Shift, px; `None` where it could not be measured.
    pub shift: Option<Shift>,
}

/// A shift and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Shift to the right, px.
    pub px: f32,
    /// 1/variance, 1/px², above 0.
    pub information_per_px2: f32,
}

/// One line of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Middle of exposure, s.
    pub t_s: f64,
    /// First row of the sample in the picture.
    pub row: usize,
    /// Displacement and its standard deviation, px, where it could be measured.
    pub d_px: Option<(f64, f64)>,
}

/// The displacements of a recording: as many samples in every frame.
#[derive(Debug)]
pub struct Series {
    first_row: usize,
    rows_per_sample: usize,
    slots: usize,
    frames_ns: Vec<i64>,
    after_s: Vec<f32>,
    px: Vec<f32>,
    information: Vec<f32>,
}

impl Series {
    /// An empty series with `slots` samples a frame, each of `rows_per_sample` rows from `first_row` on.
    pub fn new(first_row: usize, rows_per_sample: usize, slots: usize) -> Self {
        Self {
            first_row,
            rows_per_sample,
            slots,
            frames_ns: Vec::new(),
            after_s: Vec::new(),
            px: Vec::new(),
            information: Vec::new(),
        }
    }

    /// Adds a frame that starts at `start_ns`, with one entry a slot.
    pub fn push_frame(&mut self, start_ns: i64, samples: &[Measured]) {
        debug_assert_eq!(samples.len(), self.slots);
        self.frames_ns.push(start_ns);
        for sample in samples {
            self.after_s.push(sample.after_s);
            self.px.push(sample.shift.map_or(0.0, |s| s.px));
            self.information
                .push(sample.shift.map_or(NOT_MEASURED, |s| s.information_per_px2));
        }
    }

    /// Rows in each sample.
    pub fn rows_per_sample(&self) -> usize {
        self.rows_per_sample
    }

    /// Frames so far.
    pub fn frames(&self) -> usize {
        self.frames_ns.len()
    }

    /// Samples that could be measured.
    pub fn measured(&self) -> usize {
        self.information
            .iter()
            .filter(|&&w| w > NOT_MEASURED)
            .count()
    }

    /// Subtracts each slot's mean over the recording, weighted by information.
    pub fn remove_means(&mut self) {
        for slot in 0..self.slots {
            let picks = || (slot..self.px.len()).step_by(self.slots);
            let (sum, weight) = picks().fold((0.0, 0.0), |(sum, weight), i| {
                let w = f64::from(self.information[i]);
                (sum + w * f64::from(self.px[i]), weight + w)
            });
            if weight > 0.0 {
                let mean = (sum / weight) as f32;
                for i in (slot..self.px.len()).step_by(self.slots) {
                    self.px[i] -= mean;
                }
            }
        }
    }

    /// Its samples in order of time.
    pub fn samples(&self) -> impl Iterator<Item = Sample> {
        (0..self.px.len()).map(|i| {
            let (frame, slot) = (i / self.slots, i % self.slots);
            let information = f64::from(self.information[i]);
            Sample {
                t_s: self.frames_ns[frame] as f64 * 1e-9 + f64::from(self.after_s[i]),
                row: self.first_row + slot * self.rows_per_sample,
                d_px: (information > 0.0)
                    .then(|| (f64::from(self.px[i]), information.sqrt().recip())),
            }
        })
    }

    /// As CSV: `t_s,row,d_px,sd_px`, one line a sample, `d_px` and `sd_px` empty where it could not be
    /// measured; with a scale also `d_um`.
    ///
    /// # Errors
    /// What writing says.
    pub fn write_csv(&self, to: &mut impl Write, um_per_px: Option<f64>) -> io::Result<()> {
        let um_column = if um_per_px.is_some() { ",d_um" } else { "" };
        writeln!(to, "t_s,row,d_px,sd_px{um_column}")?;
        for Sample { t_s, row, d_px } in self.samples() {
            match (d_px, um_per_px) {
                (Some((d, sd)), None) => writeln!(to, "{t_s:.9},{row},{d:.6},{sd:.6}")?,
                (Some((d, sd)), Some(um)) => {
                    writeln!(to, "{t_s:.9},{row},{d:.6},{sd:.6},{:.6}", d * um)?;
                }
                (None, None) => writeln!(to, "{t_s:.9},{row},,")?,
                (None, Some(_)) => writeln!(to, "{t_s:.9},{row},,,")?,
            }
        }
        Ok(())
    }

    /// As an NPY file: an array of f64 with the columns t_s, row, d_px, sd_px; not-a-number where it
    /// could not be measured.
    ///
    /// # Errors
    /// What writing says.
    pub fn write_npy(&self, to: &mut impl Write) -> io::Result<()> {
        // NumPy's format version 1.0: magic, version, header length, a Python dictionary that is
        // padded so that the data start at a multiple of 64.
        let mut header = format!(
            "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 4), }}",
            self.px.len()
        );
        let before = 10;
        let padding = 64 - (before + header.len() + 1) % 64;
        header.extend(std::iter::repeat_n(' ', padding % 64));
        header.push('\n');
        to.write_all(b"\x93NUMPY\x01\x00")?;
        to.write_all(&(header.len() as u16).to_le_bytes())?;
        to.write_all(header.as_bytes())?;
        for Sample { t_s, row, d_px } in self.samples() {
            let (d, sd) = d_px.unwrap_or((f64::NAN, f64::NAN));
            for value in [t_s, row as f64, d, sd] {
                to.write_all(&value.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// The displacement at a constant rate, px: between samples (over blank time, lost frames and rows
    /// that could not be measured) along a straight line. Empty when nothing was measured.
    pub fn evenly(&self, rate_hz: f64) -> Vec<f32> {
        let mut known = self.samples().filter_map(|s| Some((s.t_s, s.d_px?.0)));
        let Some(mut before) = known.next() else {
            return Vec::new();
        };
        let start = before.0;
        let mut values = vec![before.1 as f32];
        for next in known {
            loop {
                let t = start + values.len() as f64 / rate_hz;
                if t > next.0 {
                    break;
                }
                let share = (t - before.0) / (next.0 - before.0);
                values.push((before.1 + share * (next.1 - before.1)) as f32);
            }
            before = next;
        }
        values
    }

    /// As a WAV file of 32-bit floats in px, one channel, at `rate_hz`.
    ///
    /// # Errors
    /// What writing says.
    pub fn write_wav(&self, to: impl Write + Seek, rate_hz: u32) -> Result<(), hound::Error> {
        let spec = hound::WavSpec {
            channels: 1,
            sample_rate: rate_hz,
            bits_per_sample: 32,
            sample_format: hound::SampleFormat::Float,
        };
        let mut writer = hound::WavWriter::new(to, spec)?;
        for value in self.evenly(rate_hz.into()) {
            writer.write_sample(value)?;
        }
        writer.finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two slots, three frames; slot 1 of frame 1 was not measured.
    fn series() -> Series {
        let mut series = Series::new(10, 4, 2);
        let sample = |after_s, px| Measured {
            after_s,
            shift: Some(Shift {
                px,
                information_per_px2: 10_000.0,
            }),
        };
        series.push_frame(-500_000_000, &[sample(0.0, 1.0), sample(0.25, 5.0)]);
        let missing = Measured {
            after_s: 0.25,
            shift: None,
        };
        series.push_frame(0, &[sample(0.0, 2.0), missing]);
        series.push_frame(500_000_000, &[sample(0.0, 3.0), sample(0.25, 7.0)]);
        series.remove_means();
        series
    }

    #[test]
    fn csv_has_a_line_a_sample_and_no_row_offsets() {
        let mut text = Vec::new();
        series().write_csv(&mut text, None).unwrap();
        assert_eq!(
            String::from_utf8(text).unwrap(),
            "t_s,row,d_px,sd_px\n\
             -0.500000000,10,-1.000000,0.010000\n\
             -0.250000000,14,-1.000000,0.010000\n\
             0.000000000,10,0.000000,0.010000\n\
             0.250000000,14,,\n\
             0.500000000,10,1.000000,0.010000\n\
             0.750000000,14,1.000000,0.010000\n"
        );
    }

    #[test]
    fn npy_is_aligned_and_complete() {
        let mut bytes = Vec::new();
        series().write_npy(&mut bytes).unwrap();
        let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((10 + header) % 64, 0);
        assert_eq!(bytes.len(), 10 + header + 6 * 4 * 8);
        assert!(String::from_utf8_lossy(&bytes[10..10 + header]).contains("'shape': (6, 4)"));
    }

    #[test]
    fn gaps_are_bridged_by_straight_lines() {
        let even = series().evenly(4.0);
        assert_eq!(even, [-1.0, -1.0, 0.0, 0.5, 1.0, 1.0]);
        assert!(Series::new(0, 1, 1).evenly(8000.0).is_empty());
    }
}
