#!/usr/bin/env bash
# How long `rowtone analyze` takes against one plain read of the same file, both from the page cache:
#
#   tools/analyze-speed.sh [RUNS]            # 10 runs of each, alternating; least and median
#   CLIP=big.y4m tools/analyze-speed.sh      # keeps the clip there (1.8 GB) or takes the one that is there
#
# The clip: 640x480, 6000 frames, motion 0.2 px. Needs Linux, dd and GNU time's figures from bash alone.
# ROWTONE names another program than target/release/rowtone.
set -euo pipefail
cd "$(dirname "$0")/.."

runs=${1:-10}
rowtone=${ROWTONE:-target/release/rowtone}
[ -x "$rowtone" ] || cargo build --release --locked -q -p rowtone-cli
clip=${CLIP:-}
if [ -z "$clip" ]; then
    clip=$(mktemp --suffix=.y4m)
    trap 'rm -f "$clip"' EXIT
fi
[ -s "$clip" ] || "$rowtone" simulate --preset imx219-480p --size 640x480 --tone 49.2:0.2 --frames 6000 -o "$clip"

TIMEFORMAT='%R %U %S'
timed() { # COMMAND...: wall, user and system seconds; what it prints is thrown away
    { time "$@" >/dev/null 2>&1; } 2>&1
}
read_plainly() { timed dd if="$clip" of=/dev/null bs=1M; }
analyze() { timed "$rowtone" analyze "$clip" --line-time-us 9.45 --exposure-us 500 --format json; }

# Once each, so that file and program are in memory.
read_plainly >/dev/null
analyze >/dev/null
plain=() analyzed=()
for ((i = 0; i < runs; i++)); do
    plain+=("$(read_plainly)")
    analyzed+=("$(analyze)")
done

column() { # N VALUES...: least and median of column N
    local n=$1
    shift
    printf '%s\n' "$@" | awk -v n="$n" '{ print $n }' | sort -n |
        awk '{ v[NR] = $1 } END { print v[1], v[int((NR + 1) / 2)] }'
}
read -r dd_least dd_median < <(column 1 "${plain[@]}")
read -r least median < <(column 1 "${analyzed[@]}")
read -r user _ < <(column 2 "${analyzed[@]}")
read -r system _ < <(column 3 "${analyzed[@]}")
awk -v a="$dd_least" -v b="$dd_median" -v c="$least" -v d="$median" -v u="$user" -v s="$system" -v runs="$runs" 'BEGIN {
    printf "wall time, s         least  median   (of %d runs, alternating)\n", runs
    printf "dd bs=1M             %.3f  %.3f\n", a, b
    printf "rowtone analyze      %.3f  %.3f   (least user + system: %.3f + %.3f)\n", c, d, u, s
    printf "ratio                 %.2f   %.2f\n", c / a, d / b
}'

# Memory does not grow with time: the most that is resident at once, of the first 1000 frames and of all.
peak_kb() { # CLIP
    "$rowtone" analyze "$1" --line-time-us 9.45 --exposure-us 500 --format json >/dev/null 2>&1 &
    local peak=0 now
    while now=$(awk '/VmHWM/ { print $2 }' "/proc/$!/status" 2>/dev/null) && [ -n "$now" ]; do peak=$now; done
    echo "$peak"
}
part=$(mktemp --suffix=.y4m)
head -c $((64 + 1000 * (6 + 640 * 480))) "$clip" >"$part"
printf 'most resident memory: %d KB with 1000 frames, %d KB with 6000\n' "$(peak_kb "$part")" "$(peak_kb "$clip")"
rm -f "$part"
