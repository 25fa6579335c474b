//! The rowtone core on a Cortex-M33, fed with a clip instead of a camera. See README.md.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod firmware;
#[cfg(target_os = "none")]
mod lines;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "This is firmware: boards/mps2-an505/run.sh builds it for a Cortex-M33 and runs it under QEMU."
    );
}
