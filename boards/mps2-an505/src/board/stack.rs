//! How deep the stack has been: cortex-m-rt paints it at reset, and what is not paint any more was used.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
    static __sdata: u32;
    static __ebss: u32;
    static __flash_end: u32;
    static __vector_table_start: u32;
}

/// Most bytes of stack in use since reset.
pub fn used_max_bytes() -> usize {
    let (mut p, top) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: from the end of the static data to the top of the RAM everything is painted words.
    while p < top && unsafe { p.read_volatile() } == STACK_PAINT_VALUE {
        p = p.wrapping_add(1);
    }
    top as usize - p as usize
}

/// How deep the stack was when what is below it was painted again.
#[derive(Clone, Copy)]
pub struct Mark {
    depth: usize,
    before: usize,
}

impl Mark {
    /// Paints what is below the stack again.
    #[inline(never)]
    pub fn new() -> Self {
        let before = used_max_bytes();
        let here = cortex_m::register::msp::read() as usize;
        let mut p = (&raw const _stack_end).cast_mut();
        while (p as usize) < here {
            // SAFETY: below the stack pointer nothing is in use; an interrupt that comes now has ended before this
            // goes on.
            unsafe { p.write_volatile(STACK_PAINT_VALUE) };
            p = p.wrapping_add(1);
        }
        Self {
            depth: (&raw const _stack_start) as usize - here,
            before,
        }
    }

    /// Most bytes of stack in use from the reset to the mark.
    pub fn before_bytes(&self) -> usize {
        self.before
    }

    /// Most bytes of stack in use since, beyond those in use at the mark.
    pub fn since_bytes(&self) -> usize {
        used_max_bytes().saturating_sub(self.depth)
    }
}

impl Default for Mark {
    fn default() -> Self {
        Self::new()
    }
}

/// Bytes of static RAM: everything below the stack.
pub fn static_ram_bytes() -> usize {
    (&raw const __ebss) as usize - (&raw const __sdata) as usize
}

/// Bytes of flash: code, constants and the initial values of static data.
pub fn flash_bytes() -> usize {
    (&raw const __flash_end) as usize - (&raw const __vector_table_start) as usize
}
