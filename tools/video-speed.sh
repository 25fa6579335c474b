#!/usr/bin/env bash
# How fast `rowtone analyze` reads a 1080p H.264 file, against ffmpeg that decodes it and throws it away:
#
#   tools/video-speed.sh [RUNS]            # 5 runs of each, alternating; least and median
#   CLIP=some.mp4 tools/video-speed.sh     # another file
#
# The clip: 20 s at 30 fps and 8 Mb/s, a moving test picture with noise. Needs ffmpeg with x264.
# ROWTONE names another program than target/release/rowtone. The part is the middle of the picture: all rows
# are decoded and come through the pipe, whatever is measured of them.
set -euo pipefail
cd "$(dirname "$0")/.."

runs=${1:-5}
rowtone=${ROWTONE:-target/release/rowtone}
[ -x "$rowtone" ] || cargo build --release --locked -q -p rowtone-cli
clip=${CLIP:-}
if [ -z "$clip" ]; then
    clip=$(mktemp --suffix=.mp4)
    trap 'rm -f "$clip"' EXIT
    ffmpeg -nostdin -v error -y -f lavfi -i testsrc2=size=1920x1080:rate=30,noise=alls=8:allf=t -t 20 \
        -pix_fmt yuv420p -c:v libx264 -preset veryfast -b:v 8M -g 30 "$clip"
fi
frames=$(ffprobe -v error -select_streams V:0 -count_packets -show_entries stream=nb_read_packets -of csv=p=0 "$clip")

TIMEFORMAT='%R'
timed() { # COMMAND...: wall seconds; what it prints is thrown away
    { time "$@" >/dev/null 2>&1; } 2>&1
}
decode() { timed ffmpeg -nostdin -v error -i "$clip" -map 0:V:0 -f null -; }
analyze() { timed "$rowtone" analyze "$clip" --line-time-us 15 --exposure-us 500 --roi "${ROI:-640,0,640,1080}" --format json; }

# Once each, so that file and programs are in memory.
decode >/dev/null
analyze >/dev/null
decoded=() analyzed=()
for ((i = 0; i < runs; i++)); do
    decoded+=("$(decode)")
    analyzed+=("$(analyze)")
done

figures() { # VALUES...: least and median
    printf '%s\n' "$@" | sort -n | awk '{ v[NR] = $1 } END { print v[1], v[int((NR + 1) / 2)] }'
}
read -r decode_least decode_median < <(figures "${decoded[@]}")
read -r least median < <(figures "${analyzed[@]}")
awk -v a="$decode_least" -v b="$decode_median" -v c="$least" -v d="$median" -v n="$frames" -v runs="$runs" 'BEGIN {
    printf "%d frames; wall time, s    least  median   frames a second (of %d runs, alternating)\n", n, runs
    printf "ffmpeg -f null -           %.3f  %.3f    %.0f\n", a, b, n / a
    printf "rowtone analyze            %.3f  %.3f    %.0f\n", c, d, n / c
    printf "throughput                 %.2f   %.2f\n", a / c, b / d
}'
