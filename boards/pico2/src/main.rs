//! rowtone on the RP2350. See README.md.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod firmware;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "This is firmware for the RP2350: boards/pico2/README.md says how to build and flash it."
    );
}
