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

/// Bytes of static RAM: everything below the stack.
pub fn static_ram_bytes() -> usize {
    (&raw const __ebss) as usize - (&raw const __sdata) as usize
}

/// Bytes of flash: code, constants and the initial values of static data.
pub fn flash_bytes() -> usize {
    (&raw const __flash_end) as usize - (&raw const __vector_table_start) as usize
}
