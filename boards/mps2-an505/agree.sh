#!/usr/bin/env bash
# The same clip through `rowtone analyze` and through the firmware under QEMU: the last windows' peaks must agree
# within 0.01 Hz and 1 %, and the figures are printed.
#
#   boards/mps2-an505/agree.sh [CLIP.y4m --line-time-us T [--exposure-us T] [--fps F] [--window S]]
#
# Without a clip the simulator makes one: lines every 66 us, five tones, 3315 samples a window; one of eight tones;
# one unlike them, 45 frames a second, lines every 75 us, one tone of 0.4 px; one that creeps by 0.6 px/s, whose reference
# is moved after it; and one of 256x200 that is measured along both axes. Then the figures must also keep within limits:
# 650 instructions a line and 3000 at worst for the first clip, elsewhere 2 to 3 % above what was measured: two builds differ by
# as much.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
rowtone() { (cd "$root" && cargo run --quiet --release -p rowtone-cli -- "$@"); }

if [ $# = 0 ]; then
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
    # 51 samples of five rows a frame, 65 frames a window.
    simulate() { # NAME SIZE TONE...
        rowtone simulate -o "$folder/$1" --size "$2" --fps 59 --line-time-us 66 --exposure-us 500 --seconds 1.8 --seed 7 \
            "${@:3}" --tone 31.3:0.3 --tone 62.6:0.1 --tone 124.1:0.05 --tone 201.7:0.04 --tone 333.3:0.02 >&2
    }
    simulate five.y4m 256x252
    simulate both.y4m 256x200
    simulate eight.y4m 256x252 --tone 410.9:0.05 --tone 525.1:0.03 --tone 611.7:0.03
    rowtone simulate -o "$folder/other.y4m" --size 256x240 --fps 45 --line-time-us 75 --exposure-us 500 --seconds 1.5 --seed 7 \
        --tone 49.2:0.4 >&2
    rowtone simulate -o "$folder/creep.y4m" --size 256x252 --fps 59 --line-time-us 66 --exposure-us 500 --seconds 6 --seed 7 \
        --drift 0.6 --tone 31.3:0.3 >&2
    set -- "$folder/five.y4m" --line-time-us 66 --exposure-us 500 --window 1.1016
    mean_line=650 max_line=3000 max_spectrum=53900000
fi
clip=$(realpath "$1")
shift

# As the board does it: along the rows alone, if nothing else is asked for.
axes=(--axes x)
[[ " $* " != *" --axes "* ]] || axes=()
host=$(rowtone analyze "$clip" "$@" "${axes[@]}" --format json 2>/dev/null | tail -n 1)
board=$("$root/boards/mps2-an505/run.sh" "$clip" "$@" --icount)
echo "$board"

# hz and amplitude of each peak, a line each, lowest frequency first
host_peaks=$(python3 -c '
import json, sys
for peak in json.load(sys.stdin)["peaks"]:
    print(peak["hz"], peak["amplitude_px"])' <<<"$host" | sort -n)
board_peaks=$(grep '^\$RTRPT,' <<<"$board" | tail -n 1 | sed 's/\*.*//' | tr ',' '\n' \
    | awk -F/ 'NF == 8 { print $1, $3 }' | sort -n)
paste -d' ' <(echo "$host_peaks") <(echo "$board_peaks") | awk '
    NF != 4 { print "agree.sh: another number of peaks: " $0; bad = 1; next }
    {
        hz = $3 - $1; share = $4 / $2 - 1
        wrong = hz > 0.01 || hz < -0.01 || share > 0.01 || share < -0.01
        printf "host %.4f Hz %.6f px, board %+.4f Hz %+.3f %%%s\n", $1, $2, hz, 100 * share, wrong ? " WRONG" : ""
        bad = bad || wrong
    }
    END { exit bad || NR == 0 }'
echo "the board agrees with the host"

within() { # FIGURES NAME LIMIT
    local value
    value=$(grep -oE "(^| )$2=[0-9]+" <<<"$1" | cut -d= -f2)
    [ "$value" -le "$3" ] || { echo "agree.sh: $2=$value is above $3" >&2; exit 1; }
}
if [ -n "${max_line:-}" ]; then
    within "$board" insn_per_line "$mean_line"
    within "$board" max_insn_per_line "$max_line"
    within "$board" max_insn_per_spectrum "$max_spectrum"
    eight=$("$root/boards/mps2-an505/run.sh" "$folder/eight.y4m" "${@}" --icount | grep '^insn_per_line=')
    echo "eight tones: $eight"
    within "$eight" max_insn_per_spectrum 94400000
    other=$("$root/boards/mps2-an505/run.sh" "$folder/other.y4m" --line-time-us 75 --exposure-us 500 --icount | grep '^insn_per_line=')
    echo "another clip: $other"
    within "$other" insn_per_line 675
    within "$other" max_insn_per_line "$max_line"
    creep=$("$root/boards/mps2-an505/run.sh" "$folder/creep.y4m" "${@}" --icount | grep '^insn_per_line=')
    echo "creeping: $creep"
    within "$creep" max_insn_per_line 3310
    both=$("$root/boards/mps2-an505/run.sh" "$folder/both.y4m" "${@}" --axes xy --icount | grep '^insn_per_line=')
    echo "both axes: $both"
    within "$both" insn_per_line 1310
    within "$both" max_insn_per_line 4848
fi
