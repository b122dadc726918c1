#!/usr/bin/env bash
# Builds the wheel for Linux on the given architecture, with maturin on the path:
#
#     host/python/wheel.sh x86_64|aarch64 FOLDER [PROFILE]
set -euo pipefail
[ $# = 2 ] || [ $# = 3 ] || { echo "wheel.sh x86_64|aarch64 FOLDER [PROFILE]" >&2; exit 2; }
mkdir -p "$2"
folder=$(cd "$2" && pwd)
cd "$(dirname "$0")/../.."
other=()
if [ "$1" != "$(uname -m)" ]; then
    . host/package/cross.sh
    cross "$1-unknown-linux-gnu"
    other=(--target "$1-unknown-linux-gnu")
fi
# With a profile in which panics unwind: a defect raises an exception and does not end the
# interpreter.
maturin build --quiet --profile "${3:-library}" --manifest-path host/python/Cargo.toml \
    --target-dir target "${other[@]}" --out "$folder"
