#!/usr/bin/env bash
# The names of all tests, so that none vanishes behind a feature, a move or a merge.
#
#   tools/test-names.sh            prints them, sorted: target and name
#   tools/test-names.sh --check    says which names of tests/names.txt are gone, and fails if there are any
#   tools/test-names.sh --sources  the same in a second, by what the sources say, without the doc tests
#
# A name may move: what counts is its last part (of a doc test, the item it belongs to), and how often it occurs.
# Where a test was merged or dropped, its line in tests/names.txt ends with ` # REASON`.
# Everything that this machine can build is listed by cargo, with all features but those below; tests behind
# libcamera, tests of other processors and fuzz targets are found in the sources.
set -euo pipefail
cd "$(dirname "$0")/.."

# `libcamera` needs a camera's library; the buses of pico2 exclude each other.
features() {
    cargo metadata --locked --no-deps --format-version 1 | python3 -c '
import json, sys
without = {"default", "libcamera", "bus-1bit", "bus-4bit"}
for package in json.load(sys.stdin)["packages"]:
    for feature in sorted(package["features"]):
        if feature not in without:
            print(package["name"] + "/" + feature)'
}

built() { # The last line of an empty list says so on standard error; a failed build must not pass for one.
    local out
    out=$(cargo test --locked --workspace --features "$(features | paste -sd,)" -- --list 2>&1) || {
        echo "$out" | tail -n 30 >&2
        return 1
    }
    awk '
        # Running unittests src/lib.rs (target/debug/deps/rowtone-0123456789abcdef)
        / Running / { target = $NF; sub(/.*\//, "", target); sub(/-[0-9a-f]+\)$/, "", target)
                      if ($2 == "unittests") target = target " unit"; next }
        /Doc-tests / { target = $2 " doc"; next }
        / (test|benchmark|bench)$/ && /: / {
            name = $0
            sub(/: [a-z]+$/, "", name)
            if (target ~ / doc$/) { sub(/^[^ ]* - /, "", name); sub(/ ?\(line [0-9]+\).*/, "", name) }
            gsub(/ /, "", name)
            print target, (name == "" ? "crate" : name)
        }' <<<"$out"
}

# NAME after each `#[test]` of a file, whatever stands between.
tests_of() { # FILE...
    awk 'FNR == 1 { found = 0 }
         /#\[test\]/ { found = 1 }
         found && match($0, /fn [a-z_0-9]+/) { print FILENAME " source", substr($0, RSTART + 3, RLENGTH - 3); found = 0 }' "$@"
}

in_sources() {
    local file
    # What is built only elsewhere.
    git ls-files '*.rs' | grep -E 'libcamera|/(aarch64|cortex_m|x86_64[a-z_0-9]*)\.rs$' | while read -r file; do
        tests_of "$file"
    done
    git ls-files 'fuzz/fuzz_targets/*.rs' | sed 's|.*/\(.*\)\.rs|fuzz target \1|'
}

names() {
    { built && in_sources; } | LC_ALL=C sort
}

gone() { # NOW BEFORE: says which names of the second list are not in the first, and fails if there are any
    awk '
        function last(line) { sub(/ # .*/, "", line); sub(/.*(::| )/, "", line); return line }
        FNR == NR { left[last($0)]++; next }
        / # / || /^#/ { next }
        left[last($0)]-- <= 0 { print "gone: " $0; gone++ }
        END { exit (gone > 0) }' "$1" "$2"
}

case ${1:-} in
    '') names ;;
    --check | --sources)
        now=$(mktemp)
        before=$(mktemp)
        trap 'rm "$now" "$before"' EXIT
        if [ "$1" = --check ]; then
            names >"$now"
            cp tests/names.txt "$before"
        else
            git ls-files '*.rs' | while read -r file; do tests_of "$file"; done >"$now"
            grep -v -e ' doc ' -e '^fuzz target ' tests/names.txt >"$before"
            # Fewer than a name a line is a list that was not read.
            [ "$(wc -l <"$before")" -gt 500 ]
        fi
        gone "$now" "$before"
        echo "all names of tests/names.txt are still there ($(wc -l <"$now") tests)"
        ;;
    *) echo "usage: tools/test-names.sh [--check | --sources]" >&2 && exit 2 ;;
esac
