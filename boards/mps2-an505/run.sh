#!/usr/bin/env bash
# Run the firmware under QEMU on a clip: text reports as the board's UART sends them, on standard output.
set -euo pipefail

usage() {
    cat >&2 <<'USAGE'
usage: boards/mps2-an505/run.sh CLIP.y4m (--line-time-us T | --calibration FILE) [--exposure-us T] [--fps F] [--window S] [--axes x|xy] [--icount]
example: boards/mps2-an505/run.sh motor.y4m --line-time-us 40 --exposure-us 500 --icount

  --line-time-us T   time from one row to the next
  --calibration FILE line time, and exposure where it was measured, from `rowtone calibrate -o FILE`
  --exposure-us T    exposure of a row (default: the calibration's, or 0)
  --fps F            frame rate, Hz (default: the clip's)
  --window S         length of a report's window, s (default 1.0)
  --axes x|xy        motion along the rows alone, or along rows and columns (default x)
  --icount           count instructions, and print one line of figures at the end
USAGE
    exit 2
}

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
clip='' line_time='' exposure='' calibration='' fps='' window=1.0 axes=1 icount=0
while [ $# -gt 0 ]; do
    case $1 in
        --line-time-us | --exposure-us | --fps | --window)
            [ $# -ge 2 ] || usage
            [[ $2 =~ ^[0-9]*\.?[0-9]+([eE][-+]?[0-9]+)?$ ]] || { echo "run.sh: $1: '$2' is no number" >&2; exit 2; }
            case $1 in
                --line-time-us) line_time=$2 ;;
                --exposure-us) exposure=$2 ;;
                --fps) fps=$2 ;;
                --window) window=$2 ;;
            esac
            shift 2
            ;;
        --axes)
            case ${2:-} in
                x) axes=1 ;;
                xy) axes=2 ;;
                *) usage ;;
            esac
            shift 2
            ;;
        --calibration) [ $# -ge 2 ] || usage; calibration=$2; shift 2 ;;
        --icount) icount=1; shift ;;
        -*) usage ;;
        *) [ -z "$clip" ] || usage; clip=$1; shift ;;
    esac
done
# figure KEY: microseconds of a key of the calibration, which is in seconds; nothing where it is not there.
figure() {
    awk -v key="$1" -v file="$calibration" '
        /^[ \t]*\[/ { exit }
        { at = index($0, "="); name = substr($0, 1, at - 1); value = substr($0, at + 1) }
        { gsub(/[ \t\r]/, "", name); sub(/#.*/, "", value); gsub(/[ \t\r_]/, "", value) }
        name == key {
            if (value !~ /^\+?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?$/) {
                printf "run.sh: %s: line %d: %s is no number, at least 0\n", file, NR, key > "/dev/stderr"; exit 1
            }
            printf "%.9g", value * 1e6; exit
        }' "$calibration"
}
if [ -n "$calibration" ]; then
    [ -z "$line_time" ] || { echo "run.sh: --line-time-us and --calibration: give one of them" >&2; exit 2; }
    [ -r "$calibration" ] || { echo "run.sh: $calibration cannot be read" >&2; exit 1; }
    line_time=$(figure line_time_s) || exit 1
    [ -n "$line_time" ] || { echo "run.sh: $calibration: no line_time_s: make the file with rowtone calibrate -o FILE" >&2; exit 1; }
    ! grep -Eq '^[[:space:]]*rolling[[:space:]]*=[[:space:]]*"up"' "$calibration" \
        || { echo "run.sh: $calibration: the last row is read first: turn the clip upside down, this board does not" >&2; exit 1; }
    if [ -z "$exposure" ]; then exposure=$(figure exposure_s) || exit 1; fi
fi
[ -n "$clip" ] && [ -n "$line_time" ] || usage
exposure=${exposure:-0}
[ -r "$clip" ] || { echo "run.sh: $clip cannot be read" >&2; exit 1; }
command -v qemu-system-arm >/dev/null || { echo "run.sh: no qemu-system-arm: apt-get install qemu-system-arm" >&2; exit 1; }

(cd "$root" && tools/embedded-cargo.sh build --quiet --profile firmware -p rowtone-mps2-an505 --bin rowtone-mps2-an505 >&2)
firmware=$("$root/tools/embedded-cargo.sh" --where firmware rowtone-mps2-an505)

scaled() { awk -v v="$1" -v by="$2" 'BEGIN { printf "%.0f", v * by }'; }
words="rowtone line_time_ps=$(scaled "$line_time" 1e6) exposure_ns=$(scaled "$exposure" 1e3) window_ms=$(scaled "$window" 1e3)"
[ -z "$fps" ] || words+=" fps_uhz=$(scaled "$fps" 1e6)"
words+=" axes=$axes icount=$icount clip=$(realpath "$clip")"
counting=()
[ "$icount" = 0 ] || counting=(-icount shift=7)
exec qemu-system-arm -M mps2-an505 -display none -monitor none -serial stdio "${counting[@]}" \
    -semihosting-config "enable=on,target=native,arg=${words//,/,,}" -kernel "$firmware" </dev/null
