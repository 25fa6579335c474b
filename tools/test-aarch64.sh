#!/usr/bin/env bash
# The core's unit tests on 64-bit Arm (Raspberry Pi), on a machine of another kind: built for
# it, run under user-mode emulation, once on a processor with the dot-product instructions (Raspberry Pi 5)
# and once without (3, 4, Zero 2). The kernels' test compares every one of them bit by bit with plain Rust.
#
#   tools/test-aarch64.sh [test filters]
#
# Needs what tools/aarch64-cargo.sh needs, and Debian's qemu-user-static.
set -euo pipefail
cd "$(dirname "$0")/.."

command -v qemu-aarch64-static >/dev/null || {
    echo "test-aarch64.sh: no emulator: apt-get install qemu-user-static" >&2
    exit 1
}
for processor in max cortex-a53; do
    case $processor in max) kernel=NeonDot ;; *) kernel=Neon ;; esac
    echo "== $processor: $kernel"
    ROWTONE_EXPECT_KERNEL=$kernel \
        CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64-static -cpu $processor -L /usr/aarch64-linux-gnu" \
        tools/aarch64-cargo.sh test -p rowtone --features std --lib --release -- "$@"
done
