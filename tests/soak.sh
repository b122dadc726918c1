#!/usr/bin/env bash
# Sweeps in a loop, with faults in between, for MINUTES each on the CPU and on a device that is lost
# now and then. `soak.sh LAB LAYER MINUTES`; the full disk (needs root) and the device are skipped
# with a message if not available.
set -euo pipefail
lab=$(realpath "$1")
layer=$(realpath "$2")
hours=$(awk "BEGIN { print $3 / 60 }")
cd "$(dirname "$0")/.."
out=$PWD/target/soak
mkdir -p "$out/disk"

options=()
if mount -t tmpfs -o size=256k tmpfs "$out/disk" 2>/dev/null; then
    trap 'umount "$out/disk"' EXIT
    options=(--full-disk "$out/disk")
else
    echo "skipped: a full disk, as none can be mounted"
fi
soak() { "$lab" soak --hours "$hours" -n 30 "${options[@]}" --out "$out/$1" --backend "$@"; }
soak scalar
if [ "${RAYWAKE_VULKAN:-}" = required ]; then
    soak vulkan --faulty-layer "$layer"
else
    echo "skipped: a lost device, as none is required"
fi
