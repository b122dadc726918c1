#!/usr/bin/env bash
# Builds the program for vehicles: it needs the system's C library, and uses Vulkan if it finds a
# loader. Prints its path.
#
#     host/package/onboard.sh x86_64|aarch64 [FEATURES]
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${1:?x86_64 or aarch64}-unknown-linux-gnu
. host/package/cross.sh
cross "$target"
cargo build --quiet --profile onboard -p raywake \
    --no-default-features --features "${2:-}" --target "$target" >&2
echo "target/$target/onboard/raywake"
