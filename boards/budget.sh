#!/usr/bin/env bash
# What a firmware takes of flash and RAM, against its budget, as a row of the table in the board's README.
#
#   boards/budget.sh NAME ELF
#
# Fails where a budget is exceeded or an allocator is linked.
set -euo pipefail

name=${1:?usage: boards/budget.sh NAME ELF}
elf=${2:?usage: boards/budget.sh NAME ELF}
[ -f "$elf" ] || { echo "budget.sh: $elf is not there" >&2; exit 1; }
# The RP2350 has 4 MiB of flash and 520 KiB of RAM.
max_flash=$((512 * 1024))
max_ram=$((500 * 1024))

size=$(command -v llvm-size || command -v rust-size || command -v size)
nm=$(command -v llvm-nm || command -v rust-nm || command -v nm)

# Sections with an address: those in RAM (0x2… and 0x3…) take RAM, and .data its initial values in flash besides.
read -r flash ram < <("$size" -A "$elf" | awk '
    $3 ~ /^[0-9]+$/ && $3 > 0 {
        in_ram = $3 >= 536870912
        if (in_ram) ram += $2
        if (!in_ram || $1 == ".data") flash += $2
    }
    END { print flash + 0, ram + 0 }')

status=0
# The core's memory starts as zeros: as initial values it would lie in flash once more.
data=$("$size" -A "$elf" | awk '$1 == ".data" { print $2 }')
[ "${data:-0}" -le 16384 ] || { echo "budget.sh: $name: $data bytes of initial values in flash; a static is not all zeros" >&2; status=1; }
if "$nm" "$elf" | grep -qE '__rust_alloc|__rg_alloc|malloc'; then
    echo "budget.sh: $name: an allocator is linked" >&2
    status=1
fi
[ "$flash" -le "$max_flash" ] || { echo "budget.sh: $name: $flash bytes of flash, $max_flash allowed" >&2; status=1; }
[ "$ram" -le "$max_ram" ] || { echo "budget.sh: $name: $ram bytes of static RAM, $max_ram allowed" >&2; status=1; }
echo "| $name | $flash | $max_flash | $ram | $max_ram | none |"
exit $status
