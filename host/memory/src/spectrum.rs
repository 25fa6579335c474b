//! The spectrum's memory.

use rowtone::report::MAX_PEAKS;
use rowtone::spectrum::{
    EstimatorStorage, FrameMark, SampleBuffer, SlotCoupling, Storage, Workspace,
};
use rowtone::timeline::{Group, Spread};
use rowtone::tracker::Axes;

/// Longest transform, points: that of the core.
const GRID: usize = 32_768;

/// Vectors to lend to an [`rowtone::pipeline::ReportSide`].
///
/// ```
/// use rowtone_memory::SpectrumMemory;
/// use rowtone::{pipeline::ReportSide, camera::Timing, spectrum::Config, timeline::Group};
/// let group = Group::new(Timing::new(18_900_000, 500_000, 1080)?, 24)?;
/// let mut memory = SpectrumMemory::new(group, 1.0, 47.6);
/// let reports = ReportSide::new(Config::default(), group, memory.lend())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SpectrumMemory {
    buffers: [Buffer; 2],
    frame_ns: Vec<i64>,
    slot_ns: Vec<i64>,
    frame_rows: Vec<f32>,
    slot_rows: Vec<f32>,
    frame_phasors: Vec<f32>,
    slot_phasors: Vec<f32>,
    grid: Vec<f32>,
    workspace: Box<Workspace>,
}

#[derive(Clone, Debug)]
struct Buffer {
    shift_px: Vec<f32>,
    weight: Vec<u16>,
    skew: Vec<i16>,
    spread: Vec<Spread>,
    couplings: Vec<SlotCoupling>,
    frames: Vec<FrameMark>,
}

impl Buffer {
    fn new(frames: usize, slots: usize, axes: usize) -> Self {
        Self {
            shift_px: vec![0.0; axes * frames * slots],
            weight: vec![0; axes * frames * slots],
            skew: vec![0; frames * slots],
            spread: vec![Spread::default(); slots],
            couplings: vec![SlotCoupling::default(); (axes - 1) * slots],
            frames: vec![FrameMark::default(); frames],
        }
    }

    fn lend(&mut self) -> SampleBuffer<'_> {
        SampleBuffer {
            shift_px: &mut self.shift_px,
            weight: &mut self.weight,
            skew: &mut self.skew,
            spread: &mut self.spread,
            couplings: &mut self.couplings,
            frames: &mut self.frames,
        }
    }
}

impl SpectrumMemory {
    /// Room for windows of `window_s` seconds at up to `fps` frames a second (and a quarter more, and two
    /// frames). The samples know the motion along x alone.
    pub fn new(group: Group, window_s: f64, fps: f64) -> Self {
        Self::for_axes(Axes::X, group, window_s, fps)
    }

    /// The same for samples that know the motion along these axes.
    pub fn for_axes(axes: Axes, group: Group, window_s: f64, fps: f64) -> Self {
        let frames = (window_s * fps * 1.25).clamp(4.0, 65_000.0) as usize + 2;
        Self::for_frames(axes, group, frames)
    }

    /// Room for windows of this many frames, at least 4.
    pub fn for_frames(axes: Axes, group: Group, frames: usize) -> Self {
        let frames = frames.max(4);
        let axes = match axes {
            Axes::X => 1,
            Axes::Xy => 2,
        };
        let slots = usize::from(group.slots());
        let rows = MAX_PEAKS + 1;
        Self {
            buffers: [0, 1].map(|_| Buffer::new(frames, slots, axes)),
            frame_ns: vec![0; frames],
            slot_ns: vec![0; slots],
            frame_rows: vec![0.0; 6 * frames],
            slot_rows: vec![0.0; (2 + 3 * axes) * slots],
            frame_phasors: vec![0.0; 2 * rows * frames],
            slot_phasors: vec![0.0; 2 * rows * slots],
            grid: vec![0.0; GRID],
            workspace: Box::default(),
        }
    }

    /// Lends all of it.
    pub fn lend(&mut self) -> Storage<'_> {
        let [collected, computed] = &mut self.buffers;
        Storage {
            collected: collected.lend(),
            estimator: EstimatorStorage {
                samples: computed.lend(),
                frame_ns: &mut self.frame_ns,
                slot_ns: &mut self.slot_ns,
                frame_rows: &mut self.frame_rows,
                slot_rows: &mut self.slot_rows,
                frame_phasors: &mut self.frame_phasors,
                slot_phasors: &mut self.slot_phasors,
                grid: &mut self.grid,
                workspace: &mut self.workspace,
            },
        }
    }
}
