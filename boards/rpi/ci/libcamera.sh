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

# The machine's own archives, with another suite and type; both of apt's formats. Suites with a dash
# (updates, security) have no source package of ours.
mkdir -p "$work/lists/partial" "$work/source"
shopt -s nullglob
{
    for list in /etc/apt/sources.list.d/*.sources; do
        awk -v RS= '{
            uri = ""; plain = 0
            lines = split($0, line, "\n")
            for (i = 1; i <= lines; i++) {
                words = split(line[i], word, " ")
                if (word[1] == "URIs:") uri = word[2]
                if (word[1] == "Suites:") for (k = 2; k <= words; k++) if (word[k] !~ /[-\/]/) plain = 1
            }
            if (plain) print uri
        }' "$list"
    done
    for list in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
        [ ! -e "$list" ] || awk '$1 == "deb" { sub(/\[[^]]*\]/, ""); if ($3 !~ /[-\/]/) print $2 }' "$list"
    done
} | sort -u | sed "s|.*|deb-src & $suite main|" >"$work/sources.list"
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
