#!/usr/bin/env bash
# The processor time of a first build of the main command, as a newcomer has it: empty target directory,
# no cache, packages already downloaded.
#
#   tools/first-build.sh [COMMIT...]        [default: HEAD]
#
# Prints user + system seconds of each commit's `cargo build --release` of the command. Other programs
# at work on the machine make it slower: measure on an idle one, both commits in one go.
set -euo pipefail
cd "$(dirname "$0")/.."
repository=$PWD
[ $# -gt 0 ] || set -- HEAD

trees=$(mktemp -d)
trap 'rm -rf "$trees"; git -C "$repository" worktree prune' EXIT
TIMEFORMAT='%U %S'
for commit in "$@"; do
    tree=$trees/$commit
    git worktree add --quiet --detach "$tree" "$commit"
    # The command's package had another name once.
    package=rowtone-cli
    [ -d "$tree/cli" ] || package=host-sim
    (
        cd "$tree"
        unset RUSTC_WRAPPER CARGO_TARGET_DIR RUSTFLAGS CARGO_BUILD_RUSTC_WRAPPER
        unset CARGO_PROFILE_DEV_DEBUG CARGO_PROFILE_RELEASE_DEBUG CARGO_PROFILE_RELEASE_INCREMENTAL
        cargo fetch --locked --quiet
        { time cargo build --locked --release --quiet -p "$package" 2>"$trees/errors"; } 2>"$trees/time" || {
            cat "$trees/errors" >&2
            exit 1
        }
        packages=$(cargo tree --locked -p "$package" -e normal,build --prefix none | sed 's/ (\*)//' | sort -u | wc -l)
        awk -v commit="$commit" -v packages="$packages" \
            '{ printf "%-12s %6.1f s of processor time, %d packages\n", commit, $1 + $2, packages }' "$trees/time"
    )
    git worktree remove --force "$tree"
done
