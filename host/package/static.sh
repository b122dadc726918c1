#!/usr/bin/env bash
# Builds the program as one file without dependencies, for the CPU only: a static program cannot
# load Vulkan. It reads KITTI and Argoverse drives and clouds in files, and writes tables. With
# features for more formats it survives a recording on which a decoder panics, for 12 % more bytes.
# Prints its path.
#
#     host/package/static.sh x86_64|aarch64 [FEATURES]
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${1:?x86_64 or aarch64}-unknown-linux-musl
. host/package/cross.sh
cross "$target"
profile=onboard
[ -z "${2:-}" ] || profile=library
cargo build --quiet --profile "$profile" -p raywake \
    --no-default-features --features "${2:-arrow}" --target "$target" >&2
echo "target/$target/$profile/raywake"
