//! One PIO state machine, cycle by cycle (RP2350 datasheet, chapter 11): the instructions that capture uses.

use std::collections::VecDeque;

/// Words that the RX FIFO holds when it is not joined.
const FIFO_WORDS: usize = 4;

/// A state machine with shift right and autopush at 32 bits.
pub(crate) struct Machine {
    code: Vec<u16>,
    wrap_target: usize,
    wrap_source: usize,
    jmp_pin: u8,
    pc: usize,
    delay: u16,
    x: u32,
    y: u32,
    osr: u32,
    isr: u32,
    isr_count: u32,
    pub(crate) tx: VecDeque<u32>,
    pub(crate) rx: VecDeque<u32>,
    /// The sticky flag FDEBUG.RXSTALL.
    pub(crate) rx_stalled: bool,
}

impl Machine {
    pub(crate) fn new(program: &pio::Program<32>, jmp_pin: u8) -> Self {
        Self {
            code: program.code.to_vec(),
            wrap_target: program.wrap.target.into(),
            wrap_source: program.wrap.source.into(),
            jmp_pin,
            pc: 0,
            delay: 0,
            x: 0,
            y: 0,
            osr: 0,
            isr: 0,
            isr_count: 0,
            tx: VecDeque::new(),
            rx: VecDeque::new(),
            rx_stalled: false,
        }
    }

    /// One cycle, with the pins as the input synchronisers show them (bit 0: the `in` base).
    pub(crate) fn cycle(&mut self, pins: u32) {
        if self.delay > 0 {
            self.delay -= 1;
            return;
        }
        let op = self.code[self.pc];
        let (field, low) = (op >> 5 & 7, u32::from(op & 31));
        let jump = match op >> 13 {
            0b000 => self.jump(field, low, pins),
            0b001 => {
                assert_eq!(field & 3, 1, "wait: only pins");
                let wanted = u32::from(field >> 2);
                (pins >> low & 1 == wanted).then_some(None)
            }
            0b010 => self.shift_in(field, low, pins),
            0b100 => {
                assert_eq!(op & 0xFF, 0xA0, "only a blocking pull");
                self.tx.pop_front().map(|word| {
                    self.osr = word;
                    None
                })
            }
            0b101 => {
                self.mov(field, op);
                Some(None)
            }
            _ => panic!("instruction {op:#06x} is not known here"),
        };
        let Some(jump) = jump else { return }; // stalled: the same again
        self.delay = op >> 8 & 31;
        self.pc = match jump {
            Some(to) => to,
            None if self.pc == self.wrap_source => self.wrap_target,
            None => self.pc + 1,
        };
    }

    fn jump(&mut self, condition: u16, to: u32, pins: u32) -> Option<Option<usize>> {
        let taken = match condition {
            0 => true,
            2 => {
                let was = self.x;
                self.x = self.x.wrapping_sub(1);
                was != 0
            }
            6 => pins >> self.jmp_pin & 1 == 1,
            _ => panic!("jmp condition {condition} is not known here"),
        };
        Some(taken.then_some(to as usize))
    }

    fn shift_in(&mut self, source: u16, count: u32, pins: u32) -> Option<Option<usize>> {
        let bits = if count == 0 { 32 } else { count };
        let value = match source {
            0 => pins,
            2 => self.y,
            3 => 0,
            _ => panic!("in source {source} is not known here"),
        };
        if self.isr_count + bits >= 32 && self.rx.len() >= FIFO_WORDS {
            self.rx_stalled = true;
            return None;
        }
        let kept = if bits == 32 { 0 } else { self.isr >> bits };
        self.isr = kept | value << (32 - bits);
        self.isr_count += bits;
        if self.isr_count >= 32 {
            self.rx.push_back(self.isr);
            (self.isr, self.isr_count) = (0, 0);
        }
        Some(None)
    }

    fn mov(&mut self, to: u16, op: u16) {
        let value = match op & 7 {
            1 => self.x,
            3 => 0,
            7 => self.osr,
            source => panic!("mov source {source} is not known here"),
        };
        let value = match op >> 3 & 3 {
            0 => value,
            1 => !value,
            other => panic!("mov operation {other} is not known here"),
        };
        match to {
            1 => self.x = value,
            2 => self.y = value,
            _ => panic!("mov to {to} is not known here"),
        }
    }
}
