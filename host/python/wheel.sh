#!/usr/bin/env bash
# Builds the wheel for Linux on an architecture, with maturin on the path:
#
#     host/python/wheel.sh x86_64|aarch64 FOLDER
set -euo pipefail
[ $# = 2 ] || { echo "wheel.sh x86_64|aarch64 FOLDER" >&2; exit 2; }
mkdir -p "$2"
folder=$(cd "$2" && pwd)
cd "$(dirname "$0")/../.."
other=()
if [ "$1" != "$(uname -m)" ]; then
    target=$1-unknown-linux-gnu
    rustup target add "$target" >&2
    linker=CARGO_TARGET_$(tr 'a-z-' 'A-Z_' <<<"$target")_LINKER
    export "$linker=${!linker:-$1-linux-gnu-gcc}"
    # What is C in it, the compression.
    export "CC_${target//-/_}=${!linker}"
    other=(--target "$target")
fi
# The program's profile: its dependencies are compiled already.
maturin build --quiet --profile release --manifest-path host/python/Cargo.toml \
    --target-dir target "${other[@]}" --out "$folder"
