//! Runs the processor's own inner product against the portable one, and counts its instructions: `../kernel.sh`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("This is for a Cortex-M33: boards/mps2-an505/kernel.sh runs it under QEMU.");
}

#[cfg(target_os = "none")]
mod on_the_board {
    use core::fmt::Write;
    use cortex_m_rt::entry;
    use rowtone::kernel::{Kernel, LineSums, MAX_COEFFICIENT, Sums};
    use rowtone_mps2_an505::board::{counter::Counter, host, uart::Uart};
    use static_cell::ConstStaticCell;

    /// Longest line, px: more than a block of the kernel. And every length up to a bit more than a picture's 320.
    const LONGEST: usize = 70_001;
    const EVERY: usize = 330;
    /// Starts that are tried of either side, bytes from a whole word.
    const STARTS: usize = 4;

    #[repr(align(4))]
    struct Line<T>([T; LONGEST + STARTS]);

    static PIXELS: ConstStaticCell<Line<u8>> = ConstStaticCell::new(Line([0; LONGEST + STARTS]));
    static COEFFICIENTS: ConstStaticCell<Line<i8>> =
        ConstStaticCell::new(Line([0; LONGEST + STARTS]));
    static KEPT: ConstStaticCell<Line<i8>> = ConstStaticCell::new(Line([0; LONGEST + STARTS]));

    #[entry]
    fn start() -> ! {
        let mut uart = Uart::new();
        let agrees = run(&mut uart).is_some();
        host::exit(agrees)
    }

    fn run(uart: &mut Uart) -> Option<()> {
        let (Line(pixels), Line(coefficients), Line(kept)) =
            (PIXELS.take(), COEFFICIENTS.take(), KEPT.take());
        let mut cases = 0u32;
        for pattern in 0..5 {
            fill(pattern, pixels, coefficients);
            for n in (0..=EVERY).chain([640, 1023, 8192, LONGEST]) {
                for (p, h) in (0..STARTS).flat_map(|p| (0..STARTS).map(move |h| (p, h))) {
                    let (line, row) = (pixels.get(p..p + n)?, coefficients.get(h..h + n)?);
                    let (own, portable) = (
                        Kernel::detect().sums_u8(line, row),
                        Kernel::PORTABLE.sums_u8(line, row),
                    );
                    if own != portable {
                        return wrong(uart, (pattern, n, p, h), own, portable);
                    }
                    cases += 1;
                }
            }
            for n in (0..=EVERY).chain([512, 640, 1023, 8192]) {
                for (p, h) in (0..STARTS).flat_map(|p| (0..STARTS).map(move |h| (p, h))) {
                    let (line, row) = (pixels.get(p..p + n)?, kept.get_mut(h..h + n)?);
                    row.copy_from_slice(coefficients.get(h..h + n)?);
                    // Where it cannot be kept, its parts are right nevertheless.
                    let first = usize::from(!Kernel::detect().keep(row));
                    for from in first..STARTS.min(n) {
                        let line = line.get(..n - from)?;
                        let own = match from {
                            0 => Kernel::detect().kept_u8(line, row),
                            _ => Kernel::detect().kept_part_u8(line, row, from),
                        };
                        let exact = one_by_one(line, Kernel::detect().kept_coefficients(row, from));
                        if own != exact {
                            let _ = writeln!(uart, "kernel: from {from}: {own:?}, not {exact:?}");
                            return wrong(
                                uart,
                                (pattern, n, p, h),
                                Sums::default(),
                                Sums::default(),
                            );
                        }
                        cases += 1;
                    }
                }
            }
        }
        let _ = writeln!(
            uart,
            "kernel: {cases} lines, all with the portable one's bits"
        );
        let counter = Counter::new(cortex_m::Peripherals::take()?.SYST);
        let begin = counter.start();
        let nothing = counter.instructions(begin);
        for (n, start) in [(64, 0), (256, 0), (320, 0), (256, 1)] {
            let (line, row) = (pixels.get(start..start + n)?, kept.get(..n)?);
            let begin = counter.start();
            core::hint::black_box(Kernel::detect().kept_u8(line, row));
            let instructions = counter.instructions(begin) - nothing;
            let _ = writeln!(
                uart,
                "kernel: {n} px, {start} beyond a word: {instructions} instructions"
            );
        }
        Some(())
    }

    /// One pixel after the other.
    fn one_by_one(line: &[u8], coefficients: impl Iterator<Item = i8>) -> LineSums {
        let pairs = line.iter().zip(coefficients);
        pairs.fold(LineSums::default(), |sums, (&p, h)| LineSums {
            product: sums.product + i32::from(p) * i32::from(h),
            pixels: sums.pixels + u32::from(p),
        })
    }

    #[cold]
    fn wrong(
        uart: &mut Uart,
        case: (u8, usize, usize, usize),
        own: Sums,
        portable: Sums,
    ) -> Option<()> {
        let _ = writeln!(uart, "kernel: {case:?}: {own:?}, portable {portable:?}");
        None
    }

    /// Two lines of noise, the largest sums of either sign, and nothing at all.
    fn fill(pattern: u8, pixels: &mut [u8], coefficients: &mut [i8]) {
        let mut state = u64::from(pattern);
        let mut random = || {
            // Knuth's MMIX constants.
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 56) as u8
        };
        for (p, h) in pixels.iter_mut().zip(coefficients) {
            let h_random = (i16::from(random() % 129) - 64) as i8;
            (*p, *h) = match pattern {
                0 | 1 => (random(), h_random),
                2 => (u8::MAX, MAX_COEFFICIENT),
                3 => (u8::MAX, -MAX_COEFFICIENT),
                _ => (0, h_random),
            };
        }
    }
}
