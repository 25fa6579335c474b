#!/usr/bin/env bash
# The Debian package for Raspberry Pi OS (arm64), on a Debian machine of any kind:
#
#   boards/rpi/deb.sh [FOLDER]     (default: target/debian; prints the package's path)
#
# Cross-builds the program with libcamera (tools/aarch64-cargo.sh says what that needs; also g++-aarch64-linux-gnu,
# libclang-dev, pkg-config) and packs it with its unit, configuration and README.
set -euo pipefail
cd "$(dirname "$0")/../.."

target=${CARGO_TARGET_DIR:-$PWD/target}
out=${1:-$target/debian}
exec 3>&1 1>&2

sysroot=$(boards/rpi/ci/arm64-sysroot.sh)
export PKG_CONFIG_ALLOW_CROSS=1 PKG_CONFIG_SYSROOT_DIR=$sysroot
export PKG_CONFIG_LIBDIR=$sysroot/usr/lib/aarch64-linux-gnu/pkgconfig
export CXX_aarch64_unknown_linux_gnu=aarch64-linux-gnu-g++
export BINDGEN_EXTRA_CLANG_ARGS_aarch64_unknown_linux_gnu=-I/usr/aarch64-linux-gnu/include
# The libcamera that is linked against wants a newer C library than this machine's cross-compiler has; the Pi has it.
tools/aarch64-cargo.sh rustc --locked --release -p rowtone-rpi --features libcamera --bin rowtone-rpi -- \
    -Clink-arg=-Wl,--allow-shlib-undefined
program=$target/aarch64/aarch64-unknown-linux-gnu/release/rowtone-rpi

version=$(cargo pkgid --locked -p rowtone-rpi | sed 's/.*[#@]//')
# The newest version of each library's symbols that the program itself uses.
needs() { aarch64-linux-gnu-objdump -T "$program" | grep -o "$1_[0-9.]*" | sort -Vu | tail -1 | sed 's/.*_//'; }
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
chmod 755 "$stage" # mktemp's is for its owner only, and the package has it as /
put() { install -D -m "$1" "$2" "$stage/$3"; }
put 755 "$program" usr/bin/rowtone-rpi
aarch64-linux-gnu-strip "$stage/usr/bin/rowtone-rpi"
put 644 boards/rpi/debian/rowtone-rpi.toml etc/rowtone/rowtone-rpi.toml
put 644 boards/rpi/debian/rowtone-rpi.service usr/lib/systemd/system/rowtone-rpi.service
put 644 boards/rpi/debian/rowtone-rpi@.service usr/lib/systemd/system/rowtone-rpi@.service
put 644 boards/rpi/debian/rowtone.avahi etc/avahi/services/rowtone.service
put 644 docs/page.md usr/share/doc/rowtone-rpi/page.md
put 644 boards/rpi/README.md usr/share/doc/rowtone-rpi/README.md
put 644 boards/rpi/debian/copyright usr/share/doc/rowtone-rpi/copyright
put 755 boards/rpi/debian/postinst DEBIAN/postinst
put 755 boards/rpi/debian/prerm DEBIAN/prerm
printf '%s\n' /etc/rowtone/rowtone-rpi.toml /etc/avahi/services/rowtone.service >"$stage/DEBIAN/conffiles"
cat >"$stage/DEBIAN/control" <<CONTROL
Package: rowtone-rpi
Version: $version
Architecture: arm64
Maintainer: rowtone maintainers <rowtone@localhost>
Section: science
Priority: optional
Installed-Size: $(du -sk --apparent-size "$stage" | cut -f1)
Depends: libc6 (>= $(needs GLIBC)), libgcc-s1, libstdc++6, libcamera0.7, libcamera-ipa
Recommends: avahi-daemon
Description: vibration from a Raspberry Pi camera, reported over UART
 Reads the rows of a rolling-shutter camera as samples in time, measures how the
 picture moves, sends the vibration's frequencies and amplitudes over a serial
 line, and shows them on a page at http://NAME.local:7357.
CONTROL
mkdir -p "$out"
package=$out/rowtone-rpi_${version}_arm64.deb
dpkg-deb --root-owner-group --build "$stage" "$package"
echo "$package" >&3
