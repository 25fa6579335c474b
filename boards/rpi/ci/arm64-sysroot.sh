#!/usr/bin/env bash
# libcamera 0.7 for 64-bit Arm, with all that it needs to run: to link the program against, and to run it under
# emulation.
#
#   boards/rpi/ci/arm64-sysroot.sh [FOLDER]     (default: target/arm64-sysroot; prints the folder)
#
# Debian's arm64 packages, unpacked, not installed: no package of this machine changes. About 60 MB to fetch, from the
# mirror that this machine's own packages come from, one suite on.
set -euo pipefail

root=$(cd "$(dirname "$0")/../../.." && pwd)
folder=${1:-${CARGO_TARGET_DIR:-$root/target}/arm64-sysroot}
case $folder in /*) ;; *) folder=$PWD/$folder ;; esac
suite=forky

if [ -e "$folder/.complete" ]; then
    echo "$folder"
    exit
fi
exec 3>&1 1>&2
rm -rf "$folder"
mkdir -p "$folder"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/lists/partial" "$work/archives/partial"
touch "$work/status" # nothing is installed
. "$root/boards/rpi/ci/archives.sh"
archives "deb [arch=arm64]" "$suite" >"$work/sources.list"
apt_options=(-o APT::Architecture=arm64 -o APT::Architectures=arm64 -o "Dir::Etc::sourcelist=$work/sources.list"
    -o Dir::Etc::sourceparts=/dev/null -o "Dir::State::lists=$work/lists" -o "Dir::State::status=$work/status"
    -o "Dir::Cache=$work" -o "Dir::Cache::archives=$work/archives" -o APT::Sandbox::User=root)
apt-get "${apt_options[@]}" update -qq || true # a source that has not got the suite may fail
apt-get "${apt_options[@]}" install -qq -y --download-only --no-install-recommends libcamera-dev libcamera-ipa
for package in "$work"/archives/*.deb; do
    # What only draws on screens stays out.
    case $(basename "$package") in libllvm* | mesa-* | libgl1-mesa* | libz3* | libgallium*) continue ;; esac
    dpkg-deb -x "$package" "$folder"
done
[ -e "$folder/lib" ] || ln -s usr/lib "$folder/lib"
touch "$folder/.complete"
echo "$folder" >&3
