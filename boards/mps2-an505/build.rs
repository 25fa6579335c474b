//! Links the firmware with this folder's own script.
//!
//! cortex-m-rt's `link.x` includes `memory.x`, and the linker looks for that in the workspace's root
//! first, where the RP2350's lies.

fn main() {
    println!("cargo:rerun-if-changed=an505.x");
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let here = std::env::var("CARGO_MANIFEST_DIR").unwrap();
        println!("cargo:rustc-link-arg-bins=-T{here}/an505.x");
        println!("cargo:rustc-link-arg-bins=--nmagic");
    }
}
