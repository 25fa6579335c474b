#!/usr/bin/env bash
# Instructions a second that the shapes of four tones over a whole picture take on the processors of a Raspberry Pi 5 and 4:
# examples/shapes.rs, built for them and run under emulation, with a counter (instructions.c) as the emulator's plugin.
#
#   boards/rpi/ci/shapes.sh [COLUMNS] [ROWS] [FPS]
#
# Fails above 1.2 billion a second, half a core of a Pi 5 at one instruction a cycle.
# Needs what tools/aarch64-cargo.sh needs, a C compiler, and Debian's qemu-user (the static one takes no plugins).
set -euo pipefail

columns=${1:-640} rows=${2:-480} fps=${3:-60} most=1200000000
root=$(cd "$(dirname "$0")/../../.." && pwd)
cd "$root"
command -v qemu-aarch64 >/dev/null || {
    echo "shapes.sh: no emulator that takes plugins: apt-get install qemu-user" >&2
    exit 1
}
tools/aarch64-cargo.sh build --quiet --locked --release -p rowtone --example shapes >&2
program=${CARGO_TARGET_DIR:-$root/target}/aarch64/aarch64-unknown-linux-gnu/release/examples/shapes
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cc -shared -fPIC -O2 -Wall -Wextra -o "$work/instructions.so" boards/rpi/ci/instructions.c

# Rounds are four frames.
few=2 many=6 status=0
for processor in cortex-a76 cortex-a72; do
    for rounds in $few $many; do
        qemu-aarch64 -cpu $processor -L /usr/aarch64-linux-gnu -plugin "$work/instructions.so" -d plugin \
            "$program" "$columns" "$rows" $rounds 2>"$work/$rounds" >/dev/null
    done
    awk -v frames=$(((many - few) * 4)) -v rows="$rows" -v fps="$fps" -v most=$most -v name=$processor '
        NR == FNR { n -= $1; next } { n += $1 }
        END {
            frame = n / frames
            printf "%s: %.0f instructions a line, %.1f million a second at %d fps (%d million at most)\n",
                name, frame / rows, frame * fps / 1e6, fps, most / 1e6
            exit frame * fps > most
        }' "$work/$few" "$work/$many" || status=1
done
exit $status
