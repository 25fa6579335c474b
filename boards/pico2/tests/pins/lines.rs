//! From the camera's pins to numbered lines: program, DMA, buffers and frames together.

use crate::camera::{CYCLE_NS, Camera, Fault, VSYNC};
use crate::machine::Machine;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::zerocopy_channel::{Channel, Receiver};
use rowtone_pico2::capture::{HREF, LINE_PIXELS, LINE_WORDS, program, samples_less_one};
use rowtone_pico2::frames::{Frames, Losses};
use rowtone_pico2::handover::{Filled, Filler, LineBuffer, LineLosses};
use rowtone_pico2::hm01b0::Bus;
use std::sync::atomic::Ordering;

const ROWS: u16 = 12;
/// Blank lines around the rows, as the simulated camera makes them.
const LINES: i64 = ROWS as i64 + 5;
const PERIOD_NS: i64 = LINES * 67_200;

/// The board without its chip: what the interrupts do, and a core that works for a while on each line.
struct Board {
    camera: Camera,
    frames: Frames,
    machine: Machine,
    /// Cycles that the core works on a line.
    work_cycles: u64,
    now: u64,
    taken: Vec<(u32, u16, Vec<u8>)>,
    short: Vec<(u16, u32)>,
}

impl Board {
    fn new(work_cycles: u64) -> Self {
        let mut camera = Camera::new(Bus::Bits8, 6.25e6);
        camera.rows = ROWS;
        let mut machine = Machine::new(&program(Bus::Bits8), HREF);
        machine.tx.push_back(samples_less_one(Bus::Bits8));
        let frames = Frames::new(PERIOD_NS, ROWS);
        Self {
            camera,
            frames,
            machine,
            work_cycles,
            now: 0,
            taken: vec![],
            short: vec![],
        }
    }

    fn run(&mut self, numbers: std::ops::Range<u32>) -> u32 {
        let mut buffers = [LineBuffer::NEW; 2];
        let mut channel = Channel::<NoopRawMutex, _>::new(&mut buffers);
        let (sender, mut receiver) = channel.split();
        let losses = LineLosses::new();
        let mut filler = Filler::new(sender, &losses);
        let (mut filled, mut vsync, mut done_at) = (0, false, None);
        for number in numbers {
            for pins in self.camera.frame(number).cycles(0.0) {
                self.now += 1;
                if (pins >> VSYNC & 1 == 1) != vsync {
                    vsync = !vsync;
                    if vsync {
                        self.frames.vsync((self.now as f64 * CYCLE_NS) as i64);
                    }
                }
                self.machine.cycle(pins);
                while let Some(word) = self.machine.rx.pop_front() {
                    filler.buffer().expect("a buffer is always free").words[filled] = word;
                    filled += 1;
                    if filled == LINE_WORDS {
                        filled = 0;
                        if filler.filled(self.frames.line()) == Filled::HandedOver {
                            done_at = Some(self.now + self.work_cycles);
                        }
                    }
                }
                if done_at.is_some_and(|at| self.now >= at) {
                    done_at = None;
                    self.take(&mut receiver);
                }
            }
        }
        losses.overruns.load(Ordering::Relaxed)
    }

    fn take(&mut self, receiver: &mut Receiver<'_, NoopRawMutex, LineBuffer>) {
        let line = receiver.try_receive().expect("it was handed over");
        match line.pixels() {
            Ok(bytes) => self
                .taken
                .push((line.place.frame, line.place.row, bytes.to_vec())),
            Err(missing) => self.short.push((line.place.row, missing)),
        }
        receiver.receive_done();
    }

    fn all_taken_are_true(&self) {
        for (frame, row, pixels) in &self.taken {
            let truth: Vec<u8> = (0..LINE_PIXELS as u16)
                .map(|x| Camera::pixel(*frame, *row, x))
                .collect();
            assert_eq!(*pixels, truth, "frame {frame} row {row}");
        }
    }
}

#[test]
fn every_line_is_itself() {
    let mut board = Board::new(5000); // 33 µs of the 67
    assert_eq!(board.run(0..3), 0);
    assert_eq!(board.taken.len(), 3 * usize::from(ROWS));
    board.all_taken_are_true();
    assert_eq!(board.frames.losses(), Losses::default());
}

#[test]
fn work_that_takes_too_long_loses_lines_but_mistakes_none() {
    let mut board = Board::new(15_000); // 100 µs: one and a half lines
    let overruns = board.run(0..3);
    assert_eq!(overruns as usize + board.taken.len(), 3 * usize::from(ROWS));
    assert!(overruns >= u32::from(ROWS), "{overruns}");
    board.all_taken_are_true();
}

#[test]
fn a_broken_line_is_told_and_the_others_are_themselves() {
    let mut board = Board::new(5000);
    board.camera.fault = Some(Fault::LostClocks { row: 4, clocks: 20 });
    board.run(0..2);
    assert_eq!(board.short, [(4, 16), (4, 16)]);
    assert_eq!(board.taken.len(), 2 * usize::from(ROWS - 1));
    board.all_taken_are_true();
}

#[test]
fn a_camera_that_stops_in_the_middle_is_right_again_with_the_next_frame() {
    let mut board = Board::new(5000);
    board.run(0..1);
    board.camera.rows = 5;
    board.run(1..2);
    // The silence: time passes, nothing comes, and two frames are missing.
    board.now += ((PERIOD_NS * 2 + i64::from(ROWS - 5) * 67_200) as f64 / CYCLE_NS) as u64;
    board.camera.rows = ROWS;
    board.run(4..5);
    assert_eq!(board.taken.len(), usize::from(ROWS) * 2 + 5);
    board.all_taken_are_true();
    assert_eq!(
        board.frames.losses(),
        Losses {
            lost_frames: 2,
            incomplete_frames: 1,
            stray_lines: 0
        }
    );
}
