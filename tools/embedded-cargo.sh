#!/usr/bin/env bash
# cargo for the microcontroller (thumbv8m.main-none-eabihf: Cortex-M33 with FPU, as in the RP2350).
#
#   tools/embedded-cargo.sh build --profile firmware -p rowtone-pico2
#
# Two ways to get the target's core library, and this script alone decides which:
# - rustup has the target installed (`rustup target add thumbv8m.main-none-eabihf`): plain cargo.
# - otherwise Debian's rustc-web, cargo-web, rust-web-src and lld: the core library is built from source.
# `tools/embedded-cargo.sh --where PROFILE NAME` prints where that way puts a program.
# ROWTONE_TARGET names another target (the core builds for more than this one); ROWTONE_CORE=rustup or =debian
# takes that way and no other.
set -euo pipefail

target=${ROWTONE_TARGET:-thumbv8m.main-none-eabihf}
debian_rustc=${ROWTONE_DEBIAN_RUSTC:-/usr/bin/rustc}
debian_cargo=${ROWTONE_DEBIAN_CARGO:-/usr/bin/cargo}

# Flags for the host (CI's `-D warnings`, say) would replace the target's own of .cargo/config.toml.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS

verb=${1:?usage: tools/embedded-cargo.sh build|clippy|doc [cargo options]}
shift

has_target() { # RUSTC: it has a core library for the target
    [ "${ROWTONE_CORE:-rustup}" = rustup ] || return 1
    ls "$("$1" --print sysroot)/lib/rustlib/$target/lib/"libcore-*.rlib >/dev/null 2>&1
}

# A folder of its own for Debian's: the two rustcs would throw each other's work away.
target_dir=${CARGO_TARGET_DIR:-$(cd "$(dirname "$0")/.." && pwd)/target}
has_target rustc || target_dir+=/embedded
if [ "$verb" = --where ]; then
    echo "$target_dir/$target/$1/$2"
    exit
fi

# Panic messages name source files: without the folders that this machine has them in, and 3 KiB smaller.
flags=()
for folder in "$(cd "$(dirname "$0")/.." && pwd)/" "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/ \
    "$("$debian_rustc" --print sysroot 2>/dev/null || true)"/lib/rustlib/src/rust/; do
    [ ! -d "$folder" ] || flags+=("'--remap-path-prefix=$folder='")
done
cargo_flags=(--target "$target" --config "target.$target.rustflags=[$(IFS=,; echo "${flags[*]}")]")

if has_target rustc; then
    exec cargo "$verb" "${cargo_flags[@]}" "$@"
fi
[ "${ROWTONE_CORE:-debian}" = debian ] || { echo "embedded-cargo.sh: rustup has no $target" >&2; exit 1; }
for need in "$debian_rustc" "$debian_cargo" "$(command -v ld.lld || echo ld.lld)"; do
    if [ ! -x "$need" ]; then
        echo "embedded-cargo.sh: no core library for $target and no $need: run \`rustup target add $target\`" \
            "or, on Debian, \`apt-get install rustc-web cargo-web rust-web-src lld\`" >&2
        exit 1
    fi
done
if [ ! -d "$("$debian_rustc" --print sysroot)/lib/rustlib/src/rust/library/core" ]; then
    echo "embedded-cargo.sh: $debian_rustc has no library source: \`apt-get install rust-web-src\`" >&2
    exit 1
fi
linker_variable="CARGO_TARGET_$(echo "$target" | tr 'a-z.-' 'A-Z__')_LINKER"
mkdir -p "$target_dir"
# RUSTC_BOOTSTRAP only lets cargo accept -Zbuild-std; no crate of this workspace uses an unstable feature.
exec env -u RUSTC_WRAPPER -u RUSTUP_TOOLCHAIN RUSTC_BOOTSTRAP=1 RUSTC="$debian_rustc" "$linker_variable=ld.lld" \
    CARGO_TARGET_DIR="$target_dir" \
    "$debian_cargo" "$verb" "${cargo_flags[@]}" -Zbuild-std=core "$@"
