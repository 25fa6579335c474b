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
    use rowtone::kernel::{Kernel, LineSums, MAX_COEFFICIENT};
    use rowtone_mps2_an505::board::{counter::Counter, host, uart::Uart};
    use static_cell::ConstStaticCell;

    /// Longest line, px: more than a block of the kernel. And every length up to a bit more than a picture's 320.
    const LONGEST: usize = 70_001;
    const EVERY: usize = 330;
    /// Longest row that is kept.
    const LONGEST_KEPT: usize = 8192;
    /// Starts that are tried of either side, bytes from a whole word.
    const STARTS: usize = 4;
    /// And columns from which on parts are tried.
    const PARTS: usize = 6;

    #[repr(align(4))]
    struct Line<T>([T; LONGEST + STARTS]);
    #[repr(align(4))]
    struct Kept([i8; LONGEST_KEPT + STARTS]);

    static PIXELS: ConstStaticCell<Line<u8>> = ConstStaticCell::new(Line([0; LONGEST + STARTS]));
    static COEFFICIENTS: ConstStaticCell<Line<i8>> =
        ConstStaticCell::new(Line([0; LONGEST + STARTS]));
    static KEPT: ConstStaticCell<Kept> = ConstStaticCell::new(Kept([0; LONGEST_KEPT + STARTS]));
    static OTHER: ConstStaticCell<Kept> = ConstStaticCell::new(Kept([0; LONGEST_KEPT + STARTS]));
    static PLAIN: ConstStaticCell<Kept> = ConstStaticCell::new(Kept([0; LONGEST_KEPT + STARTS]));

    #[entry]
    fn start() -> ! {
        let mut uart = Uart::new();
        let agrees = run(&mut uart).is_some();
        host::exit(agrees)
    }

    fn run(uart: &mut Uart) -> Option<()> {
        let (Line(pixels), Line(coefficients)) = (PIXELS.take(), COEFFICIENTS.take());
        let (Kept(kept), Kept(plain)) = (KEPT.take(), PLAIN.take());
        let Kept(other) = OTHER.take();
        let kernel = Kernel::detect();
        let mut cases = 0u32;
        for pattern in 0..5 {
            fill(pattern, pixels, coefficients);
            for n in (0..=EVERY).chain([640, 1023, 8192, LONGEST]) {
                for (p, h) in (0..STARTS).flat_map(|p| (0..STARTS).map(move |h| (p, h))) {
                    let (line, row) = (pixels.get(p..p + n)?, coefficients.get(h..h + n)?);
                    let own = kernel.sums_u8(line, row);
                    same(
                        uart,
                        (pattern, n, p, h),
                        own,
                        Kernel::PORTABLE.sums_u8(line, row),
                    )?;
                    cases += 1;
                }
            }
            for n in (0..=EVERY).chain([512, 640, 1023, LONGEST_KEPT]) {
                for (p, h) in (0..STARTS).flat_map(|p| (0..STARTS).map(move |h| (p, h))) {
                    let (line, row) = (pixels.get(p..p + n)?, kept.get_mut(h..h + n)?);
                    row.copy_from_slice(coefficients.get(h..h + n)?);
                    make_keepable(row);
                    let plain = plain.get_mut(..n)?;
                    plain.copy_from_slice(row);
                    same(uart, (pattern, n, p, h), kernel.keep(row), true)?;
                    for from in 0..PARTS.min(n) {
                        let (line, plain) = (line.get(..n - from)?, plain.get(from..)?);
                        for half in [true, false] {
                            let kernel = if half {
                                kernel.with_half_the_light()
                            } else {
                                kernel
                            };
                            let own = match from {
                                0 => kernel.kept_u8(line, row),
                                _ => kernel.kept_part_u8(line, row, from),
                            };
                            same(
                                uart,
                                (pattern, n, p, h + from),
                                own,
                                one_by_one(line, plain, from, half),
                            )?;
                            cases += 1;
                        }
                    }
                    // Both products at once, of the row and of itself turned over.
                    let half = kernel.with_half_the_light();
                    let plain_sums = one_by_one(line, plain, 0, true);
                    let both = half.kept_both_u8(line, row, row);
                    same(
                        uart,
                        (pattern, n, p, h),
                        both,
                        (plain_sums, plain_sums.product),
                    )?;
                    let other = other.get_mut(h..h + n)?;
                    other
                        .iter_mut()
                        .zip(plain.iter())
                        .for_each(|(o, h)| *o = -h);
                    same(uart, (pattern, n, p, h), kernel.keep(other), true)?;
                    let both = half.kept_both_u8(line, row, other);
                    same(
                        uart,
                        (pattern, n, p, h),
                        both,
                        (plain_sums, -plain_sums.product),
                    )?;
                    cases += 2;
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
            core::hint::black_box(kernel.with_half_the_light().kept_u8(line, row));
            let instructions = counter.instructions(begin) - nothing;
            let _ = writeln!(
                uart,
                "kernel: {n} px, {start} beyond a word: {instructions} instructions"
            );
            let second = other.get(..n)?;
            let begin = counter.start();
            core::hint::black_box(kernel.with_half_the_light().kept_both_u8(line, row, second));
            let instructions = counter.instructions(begin) - nothing;
            let _ = writeln!(
                uart,
                "kernel: {n} px, {start} beyond a word, both products: {instructions} instructions"
            );
        }
        Some(())
    }

    /// One pixel after the other; the first of them is column `from`. `half`: the light of even columns.
    fn one_by_one(line: &[u8], coefficients: &[i8], from: usize, half: bool) -> LineSums {
        let pairs = (from..).zip(line.iter().zip(coefficients));
        pairs.fold(LineSums::default(), |sums, (x, (&p, &h))| LineSums {
            product: sums.product + i32::from(p) * i32::from(h),
            pixels: sums.pixels + if half && x % 2 == 1 { 0 } else { u32::from(p) },
        })
    }

    /// Of any row one that can be kept: see [`Kernel::keep`].
    fn make_keepable(row: &mut [i8]) {
        let n = row.len();
        for (x, h) in row.iter_mut().enumerate() {
            let inner = x >= 4 && x + 4 < n;
            *h = if inner { (*h).clamp(-63, 63) } else { 0 };
        }
        let odd = || (1..n).step_by(2);
        let mut sum: i32 = odd()
            .filter_map(|x| row.get(x))
            .map(|&h| i32::from(h))
            .sum();
        for x in odd().filter(|&x| x >= 4 && x + 4 < n) {
            if let Some(h) = row.get_mut(x) {
                let new = (i32::from(*h) - sum).clamp(-63, 63);
                sum -= i32::from(*h) - new;
                *h = new as i8;
            }
        }
    }

    /// `None`, and a word about the case, where these are not the same.
    fn same<T: PartialEq + core::fmt::Debug>(
        uart: &mut Uart,
        case: (u8, usize, usize, usize),
        own: T,
        expected: T,
    ) -> Option<()> {
        if own != expected {
            let _ = writeln!(uart, "kernel: {case:?}: {own:?}, not {expected:?}");
            return None;
        }
        Some(())
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
