//! A displacement over time, as CSV, NPY or at a constant rate.
//!
//! The offset of every row against its reference is arbitrary but constant, so each row's mean over the
//! whole recording has to go: a [`Series`] keeps 12 bytes a sample until the end.

use std::io::{self, Write};

use super::npy;
use rowtone::timeline::Vertical;
use rowtone::tracker::Axes;

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
    /// Shift to the right, px; where there is a `vertical`, its first measurement.
    pub px: f32,
    /// 1/variance, 1/px², above 0.
    pub information_per_px2: f32,
    /// What is known of the motion along the columns.
    pub vertical: Option<Vertical>,
}

/// A displacement along one axis and its standard deviation, px, where it could be measured.
pub type Known = Option<(f64, f64)>;

/// Less sure than this is not measured, px.
const WORST_SD_PX: f64 = 0.5;

/// One line of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Middle of exposure, s.
    pub t_s: f64,
    /// First row of the sample in the picture.
    pub row: usize,
    /// Displacement along the rows.
    pub x_px: Known,
    /// Along the columns, where both axes are measured.
    pub y_px: Known,
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
    /// Where both axes are measured.
    vertical: Option<Vec<Vertical>>,
}

impl Series {
    /// An empty series with `slots` samples a frame, each of `rows_per_sample` rows from `first_row` on.
    pub fn new(first_row: usize, rows_per_sample: usize, slots: usize, axes: Axes) -> Self {
        Self {
            first_row,
            rows_per_sample,
            slots,
            frames_ns: Vec::new(),
            after_s: Vec::new(),
            px: Vec::new(),
            information: Vec::new(),
            vertical: (axes == Axes::Xy).then(Vec::new),
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
            if let Some(vertical) = &mut self.vertical {
                let known = sample.shift.and_then(|s| s.vertical);
                vertical.push(known.unwrap_or_default());
            }
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

    /// Samples that could be measured along some axis.
    pub fn measured(&self) -> usize {
        let samples = self.samples();
        samples
            .filter(|s| s.x_px.is_some() || s.y_px.is_some())
            .count()
    }

    /// Share of what is known across the edges that is known along them: next to nothing where all of them lean one way. 1
    /// where the rows alone are measured.
    pub fn conditioned(&self) -> f64 {
        let Some(vertical) = &self.vertical else {
            return 1.0;
        };
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for (&first, v) in self.information.iter().zip(vertical) {
            let (first, k) = (f64::from(first), f64::from(v.coupling));
            xx += first;
            xy += k * first;
            yy += k * k * first + f64::from(v.information_per_px2);
        }
        let half = 0.5 * (xx + yy);
        let root = (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        (half - root) / (half + root).max(f64::MIN_POSITIVE)
    }

    /// From the first sample to the last, s.
    pub fn duration_s(&self) -> f64 {
        let (first, last) = (self.frames_ns.first(), self.frames_ns.last());
        let frames = first.zip(last).map_or(0.0, |(a, b)| (b - a) as f64 * 1e-9);
        frames + f64::from(self.after_s.last().copied().unwrap_or(0.0))
    }

    /// The longest time between two frames: where it begins and how long it is, s. `None` for fewer than two.
    pub fn longest_gap(&self) -> Option<(f64, f64)> {
        let gaps = self
            .frames_ns
            .windows(2)
            .map(|pair| (pair[0], pair[1] - pair[0]));
        let (at, gap) = gaps.max_by_key(|&(_, gap)| gap)?;
        Some((at as f64 * 1e-9, gap as f64 * 1e-9))
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
            let Some(vertical) = &mut self.vertical else {
                continue;
            };
            let mut own = vertical.iter_mut().skip(slot).step_by(self.slots);
            let (mut sum, mut weight) = (0.0, 0.0);
            own.by_ref().for_each(|v| {
                let w = f64::from(v.information_per_px2);
                sum += w * f64::from(v.shift_px);
                weight += w;
            });
            let own = vertical.iter_mut().skip(slot).step_by(self.slots);
            own.filter(|v| v.information_per_px2 > 0.0)
                .for_each(|v| v.shift_px -= (sum / weight) as f32);
        }
    }

    /// Its samples in order of time.
    pub fn samples(&self) -> impl Iterator<Item = Sample> {
        (0..self.px.len()).map(|i| {
            let (frame, slot) = (i / self.slots, i % self.slots);
            let (x_px, y_px) = self.known(i);
            Sample {
                t_s: self.frames_ns[frame] as f64 * 1e-9 + f64::from(self.after_s[i]),
                row: self.first_row + slot * self.rows_per_sample,
                x_px,
                y_px,
            }
        })
    }

    /// What a sample says of both axes.
    fn known(&self, i: usize) -> (Known, Known) {
        let (px, information) = (f64::from(self.px[i]), f64::from(self.information[i]));
        let Some(v) = self.vertical.as_ref().map(|v| v[i]) else {
            let x = (information > 0.0).then(|| (px, information.sqrt().recip()));
            return (x, None);
        };
        let sure = |px: f64, sd: f64| (sd < WORST_SD_PX).then_some((px, sd));
        let (own, k) = (f64::from(v.information_per_px2), f64::from(v.coupling));
        let known = own * WORST_SD_PX * WORST_SD_PX > 1.0;
        // Upright edges tell of x whatever y is: taken to be within a pixel or so.
        let (y, y_sd) = match known {
            true => (f64::from(v.shift_px), own.sqrt().recip()),
            false => (0.0, 1.0),
        };
        let x_sd = (information.recip() + (k * y_sd).powi(2)).sqrt();
        (sure(px - k * y, x_sd), sure(y, y_sd))
    }

    /// As CSV: `t_s,row,d_px,sd_px`, one line a sample, or `t_s,row,x_px,x_sd_px,y_px,y_sd_px` where both axes are measured;
    /// empty where it could not be measured; with a scale also `d_um`, or `x_um` and `y_um`.
    ///
    /// # Errors
    /// What writing says.
    pub fn write_csv(&self, to: &mut impl Write, um_per_px: Option<f64>) -> io::Result<()> {
        let planar = self.vertical.is_some();
        write!(to, "t_s,row")?;
        let names: &[&str] = if planar { &["x", "y"] } else { &["d"] };
        for name in names {
            let prefix = if planar {
                format!("{name}_")
            } else {
                String::new()
            };
            write!(to, ",{name}_px,{prefix}sd_px")?;
        }
        for name in names.iter().filter(|_| um_per_px.is_some()) {
            write!(to, ",{name}_um")?;
        }
        writeln!(to)?;
        for Sample {
            t_s,
            row,
            x_px,
            y_px,
        } in self.samples()
        {
            write!(to, "{t_s:.9},{row}")?;
            let known = &[x_px, y_px][..names.len()];
            for px in known {
                match px {
                    Some((d, sd)) => write!(to, ",{d:.6},{sd:.6}")?,
                    None => write!(to, ",,")?,
                }
            }
            if let Some(um) = um_per_px {
                for px in known {
                    match px {
                        Some((d, _)) => write!(to, ",{:.6}", d * um)?,
                        None => write!(to, ",")?,
                    }
                }
            }
            writeln!(to)?;
        }
        Ok(())
    }

    /// As an NPY file: an array of f64 with the columns t_s, row, d_px, sd_px (or x and y, as the CSV); not-a-number where it
    /// could not be measured.
    ///
    /// # Errors
    /// What writing says.
    pub fn write_npy(&self, to: &mut impl Write) -> io::Result<()> {
        let columns = if self.vertical.is_some() { 6 } else { 4 };
        npy::write_head(to, "<f8", &[self.px.len(), columns])?;
        for Sample {
            t_s,
            row,
            x_px,
            y_px,
        } in self.samples()
        {
            let unknown = (f64::NAN, f64::NAN);
            let ((x, x_sd), (y, y_sd)) = (x_px.unwrap_or(unknown), y_px.unwrap_or(unknown));
            let columns = [t_s, row as f64, x, x_sd, y, y_sd];
            let columns = match self.vertical {
                Some(_) => &columns[..],
                None => &columns[..4],
            };
            for value in columns {
                to.write_all(&value.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// The displacement along the rows at a constant rate, px; `None` in blank time, lost frames and rows that could not be measured.
    ///
    /// Between samples that follow each other a polynomial of third degree runs through the four around (a straight
    /// line beside a gap). Starts at the first sample and ends at the last.
    pub fn evenly(&self, rate_hz: f64) -> impl Iterator<Item = Option<f64>> {
        let mut known = self.samples().filter_map(|s| Some((s.t_s, s.x_px?.0)));
        let mut around = [None, known.next(), known.next(), known.next()];
        let start_s = around[1].map_or(0.0, |first: Point| first.0);
        (0_u64..).map_while(move |k| {
            let t_s = start_s + k as f64 / rate_hz;
            while around[2].is_some_and(|after| after.0 < t_s) {
                around.rotate_left(1);
                around[3] = known.next();
            }
            between(&around, t_s, 1.0 / rate_hz)
        })
    }
}

/// Time, s, and displacement, px.
type Point = (f64, f64);

/// The value at `t_s`, which lies between the middle two of four points; `Some(None)` in a gap, `None` after the end.
fn between(around: &[Option<Point>; 4], t_s: f64, period_s: f64) -> Option<Option<f64>> {
    let near = |a: Point, b: Point| b.0 - a.0 < 1.5 * period_s;
    let is_at = |a: Point| (t_s - a.0).abs() < 0.05 * period_s;
    match *around {
        [_, Some(b), ..] if is_at(b) => Some(Some(b.1)),
        [a, Some(b), Some(c), d] if near(b, c) => match (a, d) {
            (Some(a), Some(d)) if near(a, b) && near(c, d) => Some(Some(cubic([a, b, c, d], t_s))),
            _ => Some(Some(b.1 + (t_s - b.0) / (c.0 - b.0) * (c.1 - b.1))),
        },
        [_, _, Some(c), _] if is_at(c) => Some(Some(c.1)),
        [_, Some(_), Some(_), _] => Some(None),
        _ => None,
    }
}

/// Lagrange's polynomial through four points.
fn cubic(points: [Point; 4], t_s: f64) -> f64 {
    (0..4)
        .map(|i| {
            let share: f64 = (0..4)
                .filter(|&j| j != i)
                .map(|j| (t_s - points[j].0) / (points[i].0 - points[j].0))
                .product();
            share * points[i].1
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowtone_measure::restore::{Method, fill};

    /// Two slots, three frames; slot 1 of frame 1 was not measured.
    fn series() -> Series {
        let mut series = Series::new(10, 4, 2, Axes::X);
        let sample = |after_s, px| Measured {
            after_s,
            shift: Some(Shift {
                px,
                information_per_px2: 10_000.0,
                vertical: None,
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
    fn the_longest_gap_is_between_frames() {
        assert_eq!(series().longest_gap(), Some((0.0, 0.5)));
        assert_eq!(Series::new(0, 1, 1, Axes::X).longest_gap(), None);
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
        let even: Vec<Option<f64>> = series().evenly(4.0).collect();
        assert_eq!(even[3], None);
        let even = fill(&even, Method::Linear);
        assert_eq!(even, [-1.0, -1.0, 0.0, 0.5, 1.0, 1.0]);
        assert_eq!(Series::new(0, 1, 1, Axes::X).evenly(8000.0).count(), 0);
    }

    #[test]
    fn a_tone_on_another_grid_is_the_tone() {
        // 40 samples of 0.4 ms in every 20 ms, read at 2.5 kHz and a little: the grids drift against each other.
        let tone = |t: f64| (std::f64::consts::TAU * 100.0 * t).sin();
        let mut series = Series::new(0, 1, 40, Axes::X);
        for frame in 0..10 {
            let samples: Vec<Measured> = (0..40)
                .map(|k| Measured {
                    after_s: 4e-4 * k as f32,
                    shift: Some(Shift {
                        px: tone(0.02 * f64::from(frame) + 4e-4 * f64::from(k)) as f32,
                        information_per_px2: 1.0,
                        vertical: None,
                    }),
                })
                .collect();
            series.push_frame(i64::from(frame) * 20_000_000, &samples);
        }
        let even: Vec<Option<f64>> = series.evenly(2513.0).collect();
        let missing = even.iter().filter(|v| v.is_none()).count();
        // 10 of 50 are blank, and up to two grid points a frame beside them.
        assert!((9 * 10..=9 * 12).contains(&missing), "{missing}");
        for (k, value) in even.iter().enumerate() {
            if let Some(value) = value {
                // At the edge of a gap a sample up to 5 % of a period away is taken as it is: 2π·100·0.05/2513.
                let error = value - tone(k as f64 / 2513.0);
                assert!(error.abs() < 0.0126, "{k}: {error}");
            }
        }
    }
}
