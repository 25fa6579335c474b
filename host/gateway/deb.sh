#!/usr/bin/env bash
# The Debian package of the gateway (the command `rowtone` with its unit and a configuration to fill in), for the kind of
# machine it is built on:
#
#   host/gateway/deb.sh [FOLDER]     (default: target/debian; prints the package's path)
set -euo pipefail
cd "$(dirname "$0")/../.."

target=${CARGO_TARGET_DIR:-$PWD/target}
out=${1:-$target/debian}
exec 3>&1 1>&2

cargo build --locked --release -p rowtone-cli --features gateway
version=$(cargo pkgid --locked -p rowtone-cli | sed 's/.*[#@]//')
program=$target/release/rowtone
# The newest version of the C library's symbols that the program uses.
glibc=$(objdump -T "$program" | grep -o 'GLIBC_[0-9.]*' | sort -Vu | tail -1 | sed 's/.*_//')
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
chmod 755 "$stage" # mktemp's is for its owner only, and the package has it as /
put() { install -D -m "$1" "$2" "$stage/$3"; }
put 755 "$program" usr/bin/rowtone
strip "$stage/usr/bin/rowtone"
# A password stands elsewhere: the unit says where.
put 644 host/gateway/debian/gateway.toml etc/rowtone/gateway.toml
put 644 host/gateway/debian/rowtone-gateway.service usr/lib/systemd/system/rowtone-gateway.service
put 644 docs/gateway.md usr/share/doc/rowtone-gateway/gateway.md
put 644 docs/plant.md usr/share/doc/rowtone-gateway/plant.md
put 644 docs/json.md usr/share/doc/rowtone-gateway/json.md
put 644 boards/rpi/debian/copyright usr/share/doc/rowtone-gateway/copyright
put 755 host/gateway/debian/postinst DEBIAN/postinst
put 755 host/gateway/debian/prerm DEBIAN/prerm
echo /etc/rowtone/gateway.toml >"$stage/DEBIAN/conffiles"
cat >"$stage/DEBIAN/control" <<CONTROL
Package: rowtone-gateway
Version: $version
Architecture: $(dpkg --print-architecture)
Maintainer: rowtone maintainers <rowtone@localhost>
Section: science
Priority: optional
Installed-Size: $(du -sk --apparent-size "$stage" | cut -f1)
Depends: libc6 (>= $glibc), libgcc-s1
Recommends: ffmpeg
Suggests: mosquitto
Description: reports of vibration boards, published to an MQTT broker
 Reads the boards on the serial lines it is told, asks again for what was lost,
 keeps reports on disk until the broker has them, and publishes them as JSON or
 Sparkplug B. With the command rowtone, which also measures videos.
CONTROL
mkdir -p "$out"
package=$out/rowtone-gateway_${version}_$(dpkg --print-architecture).deb
dpkg-deb --root-owner-group --build "$stage" "$package"
echo "$package" >&3
