#!/usr/bin/env bash
# libcamera 0.7 with the virtual pipeline, for tests without a camera: built once into PREFIX.
#
#   boards/rpi/ci/libcamera.sh [PREFIX]     (default: target/libcamera; prints the prefix)
#
# On a Raspberry Pi use the system's own libcamera-dev instead. Needs root for apt-get, about 90 s on two
# idle cores. The source comes from the mirror that this machine's own packages come from, one suite on.
set -euo pipefail

root=$(cd "$(dirname "$0")/../../.." && pwd)
prefix=${1:-${ROWTONE_LIBCAMERA:-${CARGO_TARGET_DIR:-$root/target}/libcamera}}
case $prefix in /*) ;; *) prefix=$PWD/$prefix ;; esac
suite=forky

if [ -e "$prefix/.complete" ]; then
    echo "$prefix"
    exit
fi
exec 3>&1 1>&2
mkdir -p "$prefix"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

packages=(build-essential pkg-config meson ninja-build python3-yaml python3-jinja2 python3-ply libyaml-dev
    libyuv-dev libgnutls28-dev openssl libevent-dev libudev-dev libclang-dev libjpeg-dev dpkg-dev)
if ! dpkg-query -W "${packages[@]}" >/dev/null 2>&1; then
    apt-get update -qq
    apt-get install -y -qq --no-install-recommends "${packages[@]}"
fi

mkdir -p "$work/lists/partial" "$work/source"
. "$root/boards/rpi/ci/archives.sh"
archives deb-src "$suite" >"$work/sources.list"
apt_options=(-o "Dir::Etc::sourcelist=$work/sources.list" -o Dir::Etc::sourceparts=/dev/null
    -o "Dir::State::lists=$work/lists" -o APT::Sandbox::User=root)
apt-get "${apt_options[@]}" update -qq || true # a source that has not got the suite may fail
(cd "$work/source" && apt-get "${apt_options[@]}" --download-only source -qq libcamera)
mkdir "$work/libcamera"
tar -xf "$work"/source/libcamera_*.orig.tar.* -C "$work/libcamera" --strip-components=1

off=()
for option in documentation cam-output-kms cam-output-sdl2 cam-jpeg qcam gstreamer pycamera v4l2 tracing \
    lc-compliance android libdw libunwind softisp-gpu rpi-awb-nn apps-output-dng; do
    off+=("-D$option=disabled")
done
cd "$work/libcamera"
export PATH=/usr/bin:/bin:$PATH # Debian's python3 has Debian's modules, another one before it has not
# udev: without it the camera manager fails with ENODEV.
meson setup build --prefix="$prefix" --libdir=lib --buildtype=release -Dpipelines=virtual -Dipas= -Dtest=false \
    -Dcam=enabled -Dudev=enabled "${off[@]}" >"$prefix/setup.log" 2>&1 || {
    tail -20 "$prefix/setup.log"
    exit 1
}
ninja -C build -j"$(nproc)" install >"$prefix/build.log" 2>&1 || {
    tail -40 "$prefix/build.log"
    exit 1
}
touch "$prefix/.complete"
echo "$prefix" >&3
