#!/usr/bin/env bash
# The boards' part of CI: build both firmwares, check their budgets, and run the core on a Cortex-M33 under QEMU on
# a clip that the simulator makes; its peaks must agree with `rowtone analyze` within 0.01 Hz and 1 %, and its inner
# product with the portable one to the bit.
#
# Installs what it needs with apt-get where that is missing and it may (CI runs as root).
set -euo pipefail
cd "$(dirname "$0")/.."

need() { # COMMAND PACKAGE...
    command -v "$1" >/dev/null && return
    shift
    echo "boards/ci.sh: installing $*"
    apt-get update -qq && apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}
need qemu-system-arm qemu-system-arm
need llvm-size llvm
if ! ls "$(rustc --print sysroot)"/lib/rustlib/thumbv8m.main-none-eabihf/lib/libcore-*.rlib >/dev/null 2>&1; then
    [ -x /usr/bin/rustc ] && [ -d /usr/lib/rustlib/src/rust/library/core ] && command -v ld.lld >/dev/null \
        || { apt-get update -qq && apt-get install -y -qq --no-install-recommends rustc-web cargo-web rust-web-src lld >/dev/null; }
fi

cargo test --locked -p rowtone-pico2 -p rowtone-mps2-an505
cargo clippy --locked -p rowtone-pico2 -p rowtone-mps2-an505 --all-targets -- -D warnings

# The other camera modules: one data pin, and four. The last build is the one with eight.
for bus in bus-1bit bus-4bit; do
    tools/embedded-cargo.sh build --locked --profile firmware -p rowtone-pico2 --bin rowtone-pico2 --features "$bus"
    boards/budget.sh "pico2 $bus" "$(tools/embedded-cargo.sh --where firmware rowtone-pico2)"
done

for package in rowtone-pico2 rowtone-mps2-an505; do
    tools/embedded-cargo.sh build --locked --profile firmware -p "$package" --bin "$package"
done

echo "| firmware | flash, bytes | allowed | static RAM, bytes | allowed | allocator |"
echo "| --- | --- | --- | --- | --- | --- |"
pico2=$(tools/embedded-cargo.sh --where firmware rowtone-pico2)
boards/budget.sh pico2 "$pico2"
boards/budget.sh mps2-an505 "$(tools/embedded-cargo.sh --where firmware rowtone-mps2-an505)"

# Core 1's stack with everything at once, and a panic on top (boards/pico2/README.md): start and executor, a window, in its
# midst the task that talks with its interrupt, in the midst of that the UART's, and twice what the processor pushes.
deepest() { boards/stack.py "$pico2" "$1" | sort -n | tail -n 1 | cut -d' ' -f1; }
used=$((512 + $(deepest compute_task) + $(deepest talk_task) + $(deepest SWI_IRQ_1) + $(deepest UART0_IRQ) + 2 * 104 + $(deepest rust_begin_unwind)))
echo "core 1: $used bytes of stack at most, a panic included, of 45056"
[ "$used" -le 45056 ] || { echo "boards/ci.sh: core 1's stack is too small" >&2; exit 1; }

boards/mps2-an505/kernel.sh
