//! The methods of the thesis and of those it compares with: offline, clear rather than fast.
//!
//! Contract: a [`Method`] takes a [`Clip`] and returns how far each row of each frame is shifted, px to the right,
//! up to a constant of its own for each row ([`Shifts`]; NaN where the method has nothing to say).
//!
//! | file | method |
//! | --- | --- |
//! | [`shearlet`] | the cone-adapted complex shearlet pyramid |
//! | [`thesis`] | the thesis's pipeline on it: Algorithms 1 and 2, Foroosh's peak |
//! | [`steerable`] | the complex steerable pyramid |
//! | [`visual`] | the Visual Microphone on it, row by row and frame by frame |
//! | [`bank`] | what both pyramids are: windows that are a tight frame |
//! | [`classical`] | the small ones, one function each |
//! | [`core`] | this project's own line engine |
//! | [`correlate`] | one-dimensional phase correlation and its sub-pixel peaks |
//! | [`fourier`] | two-dimensional transforms |
//! | [`study`], [`summary`] | simulated recordings, scores, and both in short |

pub mod bank;
pub mod classical;
pub mod core;
pub mod correlate;
pub mod fourier;
pub mod shearlet;
pub mod steerable;
pub mod study;
pub mod summary;
pub mod thesis;
pub mod visual;

/// A clip in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clip {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Frames, each row by row.
    pub frames: Vec<Vec<f64>>,
}

impl Clip {
    /// Row `y` of frame `n`.
    pub fn row(&self, n: usize, y: usize) -> &[f64] {
        &self.frames[n][y * self.width..(y + 1) * self.width]
    }

    /// Each pixel's mean over the frames.
    pub fn mean(&self) -> Vec<f64> {
        let mut mean = vec![0.0; self.width * self.height];
        for frame in &self.frames {
            mean.iter_mut()
                .zip(frame)
                .for_each(|(m, v)| *m += v / self.frames.len() as f64);
        }
        mean
    }
}

/// Shift of every row of every frame, `[frame][row]`, px.
pub type Shifts = Vec<Vec<f64>>;

/// A way to measure shifts.
pub trait Method {
    /// What it is called in tables.
    fn name(&self) -> &'static str;

    /// Measures a clip.
    fn shifts(&self, clip: &Clip) -> Shifts;
}

/// All methods of this module, the thesis's first.
pub fn all() -> Vec<Box<dyn Method>> {
    let mut methods: Vec<Box<dyn Method>> = vec![
        Box::new(thesis::Thesis::default()),
        Box::new(thesis::Thesis::coarse()),
        Box::new(visual::VisualMicrophone {
            by: visual::By::Row,
        }),
        Box::new(visual::VisualMicrophone {
            by: visual::By::Frame,
        }),
    ];
    methods.extend(
        classical::Classical::ALL
            .into_iter()
            .map(|m| Box::new(m) as Box<dyn Method>),
    );
    methods
}

/// Removes each row's own mean over the frames.
pub fn remove_row_means(shifts: &mut Shifts) {
    let height = shifts.first().map_or(0, Vec::len);
    for y in 0..height {
        let known: Vec<f64> = shifts
            .iter()
            .map(|f| f[y])
            .filter(|v| v.is_finite())
            .collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        shifts.iter_mut().for_each(|f| f[y] -= mean);
    }
}
