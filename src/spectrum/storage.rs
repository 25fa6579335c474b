//! The memory that the collecting and the computing side work in, lent by the caller.

use super::window::{FrameMark, SampleBuffer, SlotCoupling};
use super::workspace::Workspace;
use crate::timeline::{Spread, Tally};

/// Rows of [`EstimatorStorage::frame_rows`]: time, weight and four of scratch.
pub(crate) const FRAME_ROWS: usize = 6;

/// Rows of [`EstimatorStorage::slot_rows`] for so many channels: time and place among the rows, and for each channel its
/// weight and two of scratch.
pub(crate) const fn slot_rows(channels: usize) -> usize {
    2 + 3 * channels
}

/// What [`super::Estimator`] works in. F: frames a window, S: slots a frame.
#[derive(Debug)]
pub struct EstimatorStorage<'a> {
    /// The window being computed: S·F samples.
    pub samples: SampleBuffer<'a>,
    /// F frame times.
    pub frame_ns: &'a mut [i64],
    /// S slot times.
    pub slot_ns: &'a mut [i64],
    /// 6·F.
    pub frame_rows: &'a mut [f32],
    /// 5·S, and 8·S where samples know both axes.
    pub slot_rows: &'a mut [f32],
    /// Phasors of tones at frames: 2·F·(tones + 1).
    pub frame_phasors: &'a mut [f32],
    /// Phasors of tones at slots: 2·S·(tones + 1).
    pub slot_phasors: &'a mut [f32],
    /// The transform's grid: 64 to 32 768 points, the largest power of two that fits is used.
    pub grid: &'a mut [f32],
    /// Models, normal matrix, noise.
    pub workspace: &'a mut Workspace,
}

/// All that an [`crate::pipeline::ReportSide`] works in.
#[derive(Debug)]
pub struct Storage<'a> {
    /// Samples as they come.
    pub collected: SampleBuffer<'a>,
    /// The computing side's.
    pub estimator: EstimatorStorage<'a>,
}

/// Arrays of fixed size for [`Storage`]: a `static` on a microcontroller, a local in a test.
///
/// `ROWS` is the most tones fitted at once, and one. `StaticStorage<4096, 96, 96, 8192, 13>` takes about 155 KiB: twice
/// 32 KiB of samples, 32 KiB of grid, 27 KiB of [`Workspace`] (with `many-unknowns` 50 more), the rest tables.
///
/// ```
/// use rowtone::spectrum::StaticStorage;
/// let mut storage = Box::new(StaticStorage::<4096, 96, 96, 8192, 9>::new());
/// let fit = core::mem::size_of::<rowtone::spectrum::Workspace>();
/// assert!(core::mem::size_of_val(&*storage) < 128 * 1024 + fit);
/// assert!(fit < if cfg!(feature = "many-unknowns") { 76 } else { 28 } * 1024);
/// let storage = storage.lend();
/// assert_eq!(storage.estimator.grid.len(), 8192);
/// ```
#[derive(Clone, Debug)]
pub struct StaticStorage<
    const SAMPLES: usize,
    const FRAMES: usize,
    const SLOTS: usize,
    const GRID: usize,
    const ROWS: usize,
> {
    shift_px: [[f32; SAMPLES]; 2],
    weight: [[u16; SAMPLES]; 2],
    skew: [[i16; SAMPLES]; 2],
    spread: [[Spread; SLOTS]; 2],
    frames: [[FrameMark; FRAMES]; 2],
    frame_ns: [i64; FRAMES],
    slot_ns: [i64; SLOTS],
    frame_rows: [[f32; FRAMES]; FRAME_ROWS],
    slot_rows: [[f32; SLOTS]; slot_rows(1)],
    frame_phasors: [[[f32; FRAMES]; 2]; ROWS],
    slot_phasors: [[[f32; SLOTS]; 2]; ROWS],
    grid: [f32; GRID],
    workspace: Workspace,
}

impl<
    const SAMPLES: usize,
    const FRAMES: usize,
    const SLOTS: usize,
    const GRID: usize,
    const ROWS: usize,
> StaticStorage<SAMPLES, FRAMES, SLOTS, GRID, ROWS>
{
    /// Empty memory.
    pub const fn new() -> Self {
        Self {
            shift_px: [[0.0; SAMPLES]; 2],
            weight: [[0; SAMPLES]; 2],
            skew: [[0; SAMPLES]; 2],
            spread: [[Spread {
                variance_ns2: 0.0,
                third_ns3: 0.0,
            }; SLOTS]; 2],
            frames: [[FrameMark {
                number: 0,
                start_ns: 0,
                tally: Tally::NONE,
            }; FRAMES]; 2],
            frame_ns: [0; FRAMES],
            slot_ns: [0; SLOTS],
            frame_rows: [[0.0; FRAMES]; FRAME_ROWS],
            slot_rows: [[0.0; SLOTS]; slot_rows(1)],
            frame_phasors: [[[0.0; FRAMES]; 2]; ROWS],
            slot_phasors: [[[0.0; SLOTS]; 2]; ROWS],
            grid: [0.0; GRID],
            workspace: Workspace::new(),
        }
    }

    /// Lends all of it, for samples that know the motion along x alone. For both axes see [`Storage::with_couplings`].
    pub const fn lend(&mut self) -> Storage<'_> {
        let [shift_a, shift_b] = &mut self.shift_px;
        let [weight_a, weight_b] = &mut self.weight;
        let [skew_a, skew_b] = &mut self.skew;
        let [spread_a, spread_b] = &mut self.spread;
        let [frames_a, frames_b] = &mut self.frames;
        Storage {
            collected: SampleBuffer {
                shift_px: shift_a,
                weight: weight_a,
                skew: skew_a,
                spread: spread_a,
                couplings: &mut [],
                frames: frames_a,
            },
            estimator: EstimatorStorage {
                samples: SampleBuffer {
                    shift_px: shift_b,
                    weight: weight_b,
                    skew: skew_b,
                    spread: spread_b,
                    couplings: &mut [],
                    frames: frames_b,
                },
                frame_ns: &mut self.frame_ns,
                slot_ns: &mut self.slot_ns,
                frame_rows: self.frame_rows.as_flattened_mut(),
                slot_rows: self.slot_rows.as_flattened_mut(),
                frame_phasors: self.frame_phasors.as_flattened_mut().as_flattened_mut(),
                slot_phasors: self.slot_phasors.as_flattened_mut().as_flattened_mut(),
                grid: &mut self.grid,
                workspace: &mut self.workspace,
            },
        }
    }
}

impl<
    const SAMPLES: usize,
    const FRAMES: usize,
    const SLOTS: usize,
    const GRID: usize,
    const ROWS: usize,
> Default for StaticStorage<SAMPLES, FRAMES, SLOTS, GRID, ROWS>
{
    fn default() -> Self {
        Self::new()
    }
}

/// What a [`StaticStorage`] needs besides for samples that know the motion along both axes.
///
/// ```
/// use rowtone::spectrum::{StaticCouplings, StaticStorage};
/// let mut storage = Box::new(StaticStorage::<4096, 96, 48, 8192, 9>::new());
/// let mut couplings = StaticCouplings::<48>::new();
/// assert!(core::mem::size_of_val(&couplings) < 3 * 1024);
/// let storage = storage.lend().with_couplings(&mut couplings);
/// assert_eq!(storage.collected.couplings.len(), 48);
/// ```
#[derive(Clone, Debug)]
pub struct StaticCouplings<const SLOTS: usize> {
    couplings: [[SlotCoupling; SLOTS]; 2],
    slot_rows: [[f32; SLOTS]; slot_rows(2)],
}

impl<const SLOTS: usize> StaticCouplings<SLOTS> {
    /// Empty memory.
    pub const fn new() -> Self {
        Self {
            couplings: [[SlotCoupling::NONE; SLOTS]; 2],
            slot_rows: [[0.0; SLOTS]; slot_rows(2)],
        }
    }
}

impl<const SLOTS: usize> Default for StaticCouplings<SLOTS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a> Storage<'a> {
    /// The same for samples that know the motion along both axes: each takes two of the shifts, so that there is room for
    /// half as many frames.
    #[must_use]
    pub fn with_couplings<const SLOTS: usize>(
        mut self,
        couplings: &'a mut StaticCouplings<SLOTS>,
    ) -> Self {
        let [collected, computed] = &mut couplings.couplings;
        self.collected.couplings = collected;
        self.estimator.samples.couplings = computed;
        self.estimator.slot_rows = couplings.slot_rows.as_flattened_mut();
        self
    }
}
