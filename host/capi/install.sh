#!/usr/bin/env bash
# Builds libraywake and installs it, its header and raywake.pc under a folder:
#
#     host/capi/install.sh PREFIX [TARGET]
set -euo pipefail
[ $# -ge 1 ] || { echo "install.sh PREFIX [TARGET]" >&2; exit 2; }
mkdir -p "$1"
prefix=$(cd "$1" && pwd)
cd "$(dirname "$0")"

if [ $# -ge 2 ]; then
    . ../package/cross.sh
    cross "$2"
fi
cargo build --quiet --profile library -p raywake-capi --lib ${2:+--target "$2"}
built=$(cargo metadata --no-deps --format-version 1 | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
built=$built/${2:+$2/}library
version=$(cargo pkgid -p raywake-capi | sed 's/.*[#@]//')

mkdir -p "$prefix/include" "$prefix/lib/pkgconfig"
install -m 644 include/raywake.h "$prefix/include/"
install -m 644 "$built/libraywake_c.a" "$prefix/lib/libraywake.a"
abi=$(sed -n 's/^#define RAYWAKE_ABI_VERSION //p' include/raywake.h)
install -m 755 "$built/libraywake_c.so" "$prefix/lib/libraywake.so.$abi"
ln -sf "libraywake.so.$abi" "$prefix/lib/libraywake.so"
sed -e "s|@PREFIX@|$prefix|" -e "s|@VERSION@|$version|" raywake.pc.in \
    >"$prefix/lib/pkgconfig/raywake.pc"
