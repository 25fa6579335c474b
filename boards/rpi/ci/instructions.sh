#!/usr/bin/env bash
# Instructions that a line takes on the processors of a Raspberry Pi 5 and 4, in the core alone and in this program:
# examples/cost.rs, built for them and run under emulation, with a counter (instructions.c) as the emulator's plugin.
#
#   boards/rpi/ci/instructions.sh [functions|totals] [COLUMNS]
#
# functions: those of more than one instruction a line, too. Lines have 640 columns where nothing else is said.
#
# Needs what tools/aarch64-cargo.sh needs, a C compiler, and Debian's qemu-user (the static one takes no plugins).
set -euo pipefail

what=${1:-totals} columns=${2:-640}
root=$(cd "$(dirname "$0")/../../.." && pwd)
cd "$root"
command -v qemu-aarch64 >/dev/null || {
    echo "instructions.sh: no emulator that takes plugins: apt-get install qemu-user" >&2
    exit 1
}
tools/aarch64-cargo.sh build --quiet --locked --release -p rowtone-rpi --example cost >&2
program=${CARGO_TARGET_DIR:-$root/target}/aarch64/aarch64-unknown-linux-gnu/release/examples/cost
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cc -shared -fPIC -O2 -Wall -Wextra -o "$work/instructions.so" boards/rpi/ci/instructions.c

# Rounds are two frames of 480 rows, and the picture is learned in the first five.
few=20 many=60 lines=$(((60 - 20) * 2 * 480))

count() { # PROCESSOR FORMAT PART ROUNDS
    qemu-aarch64 -cpu "$1" -L /usr/aarch64-linux-gnu -plugin "$work/instructions.so" -d plugin \
        "$program" "$2" "$3" "$4" "$columns" 2>"$work/$4" >/dev/null
}

a_line() { # PROCESSOR FORMAT PART: sets $insn
    count "$1" "$2" "$3" $few &
    count "$1" "$2" "$3" $many
    wait $!
    insn=$(awk -v lines=$lines 'NR == FNR { n -= $1; next } { n += $1 } END { printf "%.0f", n / lines }' "$work/$few" "$work/$many")
}

functions() {
    awk -v lines=$lines 'NR == FNR { n[$2] = $1; next }
        ($1 - n[$2]) / lines >= 1 { printf "%12.1f %s\n", ($1 - n[$2]) / lines, $2 }' "$work/$few" "$work/$many" | sort -rn
}

for processor in cortex-a76 cortex-a72; do
    before=
    for format in "8 bit" "10 bit packed, upper 8" "12 bit packed, upper 8" "16 bit, upper 8" "10 bit packed, all 10"; do
        # What the core is given: a byte a pixel, or a word.
        case $format in *all*) ready=16 ;; *) ready=8 ;; esac
        if [ "$ready" != "$before" ]; then
            a_line $processor "$format" core
            core=$insn before=$ready
            echo "$processor: $core instructions a line of $columns px in the core, $ready bits"
            [ "$what" != functions ] || functions
        fi
        a_line $processor "$format" program
        awk -v core="$core" -v all="$insn" -v format="$format" \
            'BEGIN { printf "%26s  %5d with this program: %+.1f %%\n", format, all, 100 * (all / core - 1) }'
        [ "$what" != functions ] || functions
    done
done
