#!/usr/bin/env bash
# cargo for 64-bit Arm Linux (Raspberry Pi OS) on a machine of another kind.
#
#   tools/aarch64-cargo.sh build --release -p rowtone-rpi      # without libcamera; with it: boards/rpi/deb.sh
#
# With rustup's target (`rustup target add aarch64-unknown-linux-gnu`) plain cargo is run; without it Debian's
# rustc-web, cargo-web and rust-web-src build the standard library from source. The linker is Debian's
# gcc-aarch64-linux-gnu (with libc6-dev-arm64-cross).
set -euo pipefail

target=aarch64-unknown-linux-gnu
debian_rustc=${ROWTONE_DEBIAN_RUSTC:-/usr/bin/rustc}
debian_cargo=${ROWTONE_DEBIAN_CARGO:-/usr/bin/cargo}
verb=${1:?usage: tools/aarch64-cargo.sh build|test|clippy [cargo options]}
shift

# Flags and wrappers for the host are not for another machine.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS RUSTUP_TOOLCHAIN RUSTC_WRAPPER
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
command -v aarch64-linux-gnu-gcc >/dev/null || {
    echo "aarch64-cargo.sh: no linker: apt-get install gcc-aarch64-linux-gnu libc6-dev-arm64-cross" >&2
    exit 1
}
root=$(cd "$(dirname "$0")/.." && pwd)
# A folder of its own: two rustcs would throw each other's work away.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}/aarch64

if ls "$(rustc --print sysroot)/lib/rustlib/$target/lib/"libstd-*.rlib >/dev/null 2>&1; then
    exec cargo "$verb" --target "$target" "$@"
fi
if [ ! -x "$debian_cargo" ] || [ ! -d "$("$debian_rustc" --print sysroot)/lib/rustlib/src/rust/library/std" ]; then
    echo "aarch64-cargo.sh: no standard library for $target: run \`rustup target add $target\` or, on Debian," \
        "\`apt-get install rustc-web cargo-web rust-web-src\`" >&2
    exit 1
fi
# RUSTC_BOOTSTRAP only lets cargo accept -Zbuild-std; no crate of this workspace uses an unstable feature.
exec env RUSTC_BOOTSTRAP=1 RUSTC="$debian_rustc" "$debian_cargo" "$verb" --target "$target" -Zbuild-std "$@"
