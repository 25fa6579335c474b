#!/usr/bin/env bash
# An emulator of 64-bit Arm programs that knows how serial ports are opened today (termios2); Debian 12's does not.
#
#   boards/rpi/ci/qemu-aarch64.sh [FILE]     (default: target/qemu-aarch64; prints it)
#
# Debian's qemu-user of a later suite, one program of it unpacked, not installed. About 70 MB to fetch.
set -euo pipefail

root=$(cd "$(dirname "$0")/../../.." && pwd)
file=${1:-${CARGO_TARGET_DIR:-$root/target}/qemu-aarch64}
suite=forky

if [ -x "$file" ]; then
    echo "$file"
    exit
fi
exec 3>&1 1>&2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/lists/partial"
touch "$work/status"
. "$root/boards/rpi/ci/archives.sh"
archives deb "$suite" >"$work/sources.list"
apt_options=(-o "Dir::Etc::sourcelist=$work/sources.list" -o Dir::Etc::sourceparts=/dev/null
    -o "Dir::State::lists=$work/lists" -o "Dir::State::status=$work/status" -o "Dir::Cache=$work"
    -o APT::Sandbox::User=root)
apt-get "${apt_options[@]}" update -qq || true # a source that has not got the suite may fail
(cd "$work" && apt-get "${apt_options[@]}" download -qq qemu-user)
dpkg-deb -x "$work"/qemu-user_*.deb "$work/root"
install -D "$work/root/usr/bin/qemu-aarch64" "$file"
echo "$file" >&3
