#!/usr/bin/env bash
# rowtone-rpi's own tests, on a Debian machine without a camera:
#
#   boards/rpi/ci.sh [all|host|libcamera|aarch64]
#
# host: the package without libcamera (simulated camera). libcamera: builds libcamera 0.7 with its virtual
# pipeline (once, kept in target/libcamera or $ROWTONE_LIBCAMERA), then the package with it and the program
# against it, its UART on a pseudo-terminal. aarch64: the core's tests and the bit-identity of its kernels under
# emulation, and the program cross-built. libcamera and aarch64 install Debian packages where they are missing.
set -euo pipefail
cd "$(dirname "$0")/../.."

host() {
    cargo clippy --locked -p rowtone-rpi --all-targets -- -D warnings
    cargo test --locked -p rowtone-rpi
}

libcamera() {
    prefix=$(boards/rpi/ci/libcamera.sh)
    export PKG_CONFIG_PATH=$prefix/lib/pkgconfig LD_LIBRARY_PATH=$prefix/lib ROWTONE_LIBCAMERA=$prefix
    export LIBCAMERA_LOG_LEVELS='*:WARN'
    cargo clippy --locked -p rowtone-rpi --features libcamera --all-targets -- -D warnings
    cargo test --locked --release -p rowtone-rpi --features libcamera --test libcamera -- --nocapture
}

aarch64() {
    packages=(gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static)
    if ! dpkg -s "${packages[@]}" >/dev/null 2>&1; then
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
    fi
    tools/test-aarch64.sh
    tools/aarch64-cargo.sh build --locked --release -p rowtone-rpi
}

case ${1:-all} in
    host | libcamera | aarch64) "$1" ;;
    all)
        host
        libcamera
        aarch64
        ;;
    *) echo "usage: boards/rpi/ci.sh [all|host|libcamera|aarch64]" >&2 && exit 2 ;;
esac
