#!/usr/bin/env bash
# The inner product of the Cortex-M33 against the portable one under QEMU, bit by bit, and its instructions.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
command -v qemu-system-arm >/dev/null || { echo "kernel.sh: no qemu-system-arm: apt-get install qemu-system-arm" >&2; exit 1; }
(cd "$root" && tools/embedded-cargo.sh build --quiet --profile firmware -p rowtone-mps2-an505 --bin kernel >&2)
exec qemu-system-arm -M mps2-an505 -display none -monitor none -serial stdio -icount shift=7 \
    -semihosting-config enable=on,target=native -kernel "$("$root/tools/embedded-cargo.sh" --where firmware kernel)" </dev/null
