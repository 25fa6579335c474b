//! Links the firmware: cortex-m-rt's script, which includes `memory.x` of the workspace's root, and defmt's.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let root = format!("{}/../..", std::env::var("CARGO_MANIFEST_DIR").unwrap());
        println!("cargo:rustc-link-search={root}");
        println!("cargo:rustc-link-arg-bins=--nmagic");
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
}
