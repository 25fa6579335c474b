#!/usr/bin/env bash
# rowtone-rpi's own tests, on a Debian machine without a camera:
#
#   boards/rpi/ci.sh [all|host|libcamera|aarch64|deb]
#
# host: the package without libcamera (simulated camera), and its unit. libcamera: builds libcamera 0.7 with its
# virtual pipeline (once, kept in target/libcamera or $ROWTONE_LIBCAMERA), then the package with it and the program
# against it, its UART on a pseudo-terminal. aarch64: the core's tests and the bit-identity of its kernels under
# emulation, and the instructions that a line takes. deb: the Debian package for arm64, installed into a folder, and the program in it under emulation: on its
# simulated camera and on Debian's arm64 libcamera, peaks at the other end of its pseudo-terminal. Installs Debian
# packages where they are missing.
set -euo pipefail
cd "$(dirname "$0")/../.."

need() { # PACKAGE...
    if ! dpkg-query -W "$@" >/dev/null 2>&1; then
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends "$@" >/dev/null
    fi
}

host() {
    cargo clippy --locked -p rowtone-rpi --all-targets -- -D warnings
    cargo test --locked -p rowtone-rpi
    if command -v systemd-analyze >/dev/null; then
        folder=$(mktemp -d)
        # The program need not be installed for that.
        for unit in rowtone-rpi.service rowtone-rpi@.service; do
            sed 's|/usr/bin/rowtone-rpi|/bin/true|' "boards/rpi/debian/$unit" >"$folder/$unit"
            systemd-analyze verify --man=no "$folder/${unit/@/@cam1}"
            systemd-analyze security --offline=yes --threshold=16 "$folder/$unit" | tail -1
        done
        rm -r "$folder"
    fi
}

libcamera() {
    prefix=$(boards/rpi/ci/libcamera.sh)
    with_libcamera cargo clippy --locked -p rowtone-rpi --features libcamera --all-targets -- -D warnings
    ROWTONE_LIBCAMERA=$prefix with_libcamera cargo test --locked --release -p rowtone-rpi --features libcamera \
        --test libcamera -- --nocapture
}

with_libcamera() { # COMMAND...: with the libcamera that was built for this machine
    PKG_CONFIG_PATH=$prefix/lib/pkgconfig LD_LIBRARY_PATH=$prefix/lib LIBCAMERA_LOG_LEVELS='*:FATAL' "$@"
}

aarch64() {
    need gcc gcc-aarch64-linux-gnu libc6-dev libc6-dev-arm64-cross qemu-user qemu-user-static
    tools/test-aarch64.sh
    boards/rpi/ci/instructions.sh
}

deb() {
    need gcc-aarch64-linux-gnu g++-aarch64-linux-gnu libc6-dev-arm64-cross libclang-dev pkg-config
    package=$(boards/rpi/deb.sh)
    dpkg-deb --info "$package"
    dpkg-deb --contents "$package"
    # Installed into a folder: no script can run there, so they are told to keep out of it.
    folder=$(mktemp -d)
    mkdir -p "$folder/var/lib/dpkg/info" "$folder/var/lib/dpkg/updates"
    touch "$folder/var/lib/dpkg/status"
    dpkg --root="$folder" --force-script-chrootless --force-architecture --force-depends --force-not-root \
        --install "$package"
    sysroot=$(boards/rpi/ci/arm64-sysroot.sh)
    qemu=$(boards/rpi/ci/qemu-aarch64.sh)
    export ROWTONE_PROGRAM="$qemu -L $sysroot $folder/usr/bin/rowtone-rpi"
    cargo test --locked -p rowtone-rpi --test program -- --test-threads 1
    # And with its own libcamera's virtual camera; the test itself is this machine's and links to the one built here.
    prefix=$(boards/rpi/ci/libcamera.sh)
    ROWTONE_LIBCAMERA=$sysroot/usr with_libcamera cargo test --locked --release -p rowtone-rpi --features libcamera \
        --test libcamera -- --nocapture
    unset ROWTONE_PROGRAM
    dpkg --root="$folder" --force-script-chrootless --force-architecture --force-not-root --purge rowtone-rpi
    left=$(find "$folder" -path "$folder/var" -prune -o -type f -print)
    rm -r "$folder"
    [ -z "$left" ] || { echo "left behind by the package: $left" >&2 && exit 1; }
}

case ${1:-all} in
    host | libcamera | aarch64 | deb) "$1" ;;
    all)
        host
        libcamera
        aarch64
        deb
        ;;
    *) echo "usage: boards/rpi/ci.sh [all|host|libcamera|aarch64|deb]" >&2 && exit 2 ;;
esac
