#!/usr/bin/env bash
# Builds the program as one file that needs nothing else, for the CPU alone: a static program cannot
# load Vulkan. It prints where that is.
#
#     host/package/static.sh x86_64|aarch64
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${1:?x86_64 or aarch64}-unknown-linux-musl
rustup target add "$target" >&2
if [ "$1" != "$(uname -m)" ]; then
    # The C compiler of another architecture links; what it links is Rust's own.
    linker=CARGO_TARGET_$(tr 'a-z-' 'A-Z_' <<<"$target")_LINKER
    export "$linker=${!linker:-$1-linux-gnu-gcc}"
    export RUSTFLAGS="${RUSTFLAGS:-} -C link-self-contained=yes"
fi
cargo build --quiet --profile onboard -p raywake --no-default-features --target "$target" >&2
echo "target/$target/onboard/raywake"
