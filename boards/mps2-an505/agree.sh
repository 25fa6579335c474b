#!/usr/bin/env bash
# The same clip through `rowtone analyze` and through the firmware under QEMU: the last windows' peaks must agree
# within 0.01 Hz and 1 %, and the figures are printed.
#
#   boards/mps2-an505/agree.sh [CLIP.y4m --line-time-us T [--exposure-us T] [--fps F] [--window S]]
#
# Without a clip the simulator makes one.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
rowtone() { (cd "$root" && cargo run --quiet --release -p host-sim -- "$@"); }

if [ $# = 0 ]; then
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
    rowtone simulate -o "$folder/clip.y4m" --size 256x240 --fps 57 --line-time-us 67 --exposure-us 500 \
        --seconds 1.5 --seed 7 --tone 31.3:0.3 --tone 62.6:0.1 --tone 124.1:0.05 --tone 201.7:0.04 --tone 333.3:0.02 >&2
    set -- "$folder/clip.y4m" --line-time-us 67 --exposure-us 500
fi
clip=$(realpath "$1")
shift

host=$(rowtone analyze "$clip" "$@" --format json 2>/dev/null | tail -n 1)
board=$("$root/boards/mps2-an505/run.sh" "$clip" "$@" --icount)
echo "$board"

# hz and amplitude of each peak, a line each, lowest frequency first
host_peaks=$(grep -oE '"hz":[0-9.]+,"hz_sd":[^,]+,"amplitude_px":[0-9.eE-]+' <<<"$host" \
    | sed -E 's/"hz":([^,]+),.*"amplitude_px":(.*)/\1 \2/' | sort -n)
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
