#!/usr/bin/env bash
# libraywake from C and C++: the program's digest, and invalid calls, with allocations counted,
# under the address sanitizer and under Valgrind. `run.sh PROGRAM` compares with the program
# `raywake`.
set -euo pipefail
program=$(realpath "$1")
cd "$(dirname "$0")/../../.."
out=$PWD/target/capi
mkdir -p "$out"

host/capi/install.sh "$out"
export PKG_CONFIG_PATH=$out/lib/pkgconfig
flags=(-std=c11 -Wall -Wextra -Werror -pedantic -O2 -g)
static=(-I"$out/include" "$out/lib/libraywake.a" -lm -lpthread -ldl)
# shellcheck disable=SC2207
shared=($(pkg-config --cflags --libs raywake) -Wl,-rpath,"$out/lib")
source=host/capi/examples/replay.c

dump() { cargo run --quiet --release -p raywake-capi --example dump_sweeps -- "$@"; }
dump demo "$out/demo.sweeps" 20
dump demo "$out/short.sweeps" 3

digest_of() { sed -n 's/^digest *//p'; }
# Results of another build would count as results of other settings.
rm -rf "$out/demo"
expected=$("$program" demo --backend scalar --out "$out/demo" | digest_of)
compare() {
    local found
    found=$("${@:2}" | digest_of)
    echo "$1: $found"
    [ -n "$found" ] && [ "$found" = "$expected" ] || { echo "the program: $expected"; exit 1; }
}
gcc "${flags[@]}" "$source" -o "$out/replay" "${static[@]}"
gcc "${flags[@]}" "$source" -o "$out/replay-shared" "${shared[@]}"
compare "C, two threads" "$out/replay" "$out/demo.sweeps" 2
compare "C, one thread, shared library" "$out/replay-shared" "$out/demo.sweeps" 1
small_stack() { (ulimit -s 512 && "$@"); }
compare "C, one thread, 512 KiB of stack" small_stack "$out/replay" "$out/demo.sweeps" 1

# The tests of the module for Python compare these with its records.
gcc "${flags[@]}" host/capi/tests/records.c -o "$out/records" "${static[@]}"
"$out/records" "$out/demo.sweeps" "$out/demo.records"

# Another architecture, under its emulator.
target=aarch64-unknown-linux-gnu
if [ "$(uname -m)" = x86_64 ] && command -v aarch64-linux-gnu-gcc >/dev/null &&
    command -v qemu-aarch64-static >/dev/null && rustup target add $target >/dev/null 2>&1; then
    other=$out/aarch64
    host/capi/install.sh "$other" $target
    aarch64-linux-gnu-gcc "${flags[@]}" -I"$other/include" "$source" -L"$other/lib" -lraywake \
        -Wl,-rpath,"$other/lib" -o "$out/replay-aarch64"
    compare "C, aarch64, shared library" qemu-aarch64-static -L /usr/aarch64-linux-gnu \
        "$out/replay-aarch64" "$out/demo.sweeps" 1
else
    echo "skipped: no compiler, target or emulator for aarch64"
fi

# The header is also valid C++, and the shared library is found by its ABI.
echo '#include <raywake.h>
#include <cstdio>
int main(int count, char **) {
    if (count > 1) std::printf("%u", RAYWAKE_ABI_VERSION);
    return raywake_abi_version() - RAYWAKE_ABI_VERSION;
}' >"$out/abi.cc"
g++ -std=c++11 -Wall -Wextra -Werror -pedantic "$out/abi.cc" -o "$out/abi" "${shared[@]}"
"$out/abi"
readelf -d "$out/abi" | grep -q "NEEDED.*libraywake.so.$("$out/abi" number)"
# Initial states are zeros, which take no room in the file; one that is not shows up here.
bytes=$(stat -L -c %s "$out/lib/libraywake.so")
echo "shared library: $bytes bytes"
[ "$bytes" -le 2000000 ] || { echo "larger than 2,000,000 bytes"; exit 1; }
exported=$(nm -D --defined-only "$out/lib/libraywake.so" | awk '$2 == "T" {print $3}')
[ -z "$(grep -v '^raywake_' <<<"$exported")" ] || { echo "exported: $exported"; exit 1; }

misuse() { gcc "${flags[@]}" "$@" host/capi/tests/misuse.c -o "$out/misuse" "${static[@]}"; }
misuse -DCOUNT_ALLOCATIONS
"$out/misuse" "$out/short.sweeps" | sed 's/^/allocations: /'
misuse -fsanitize=address,undefined -fno-sanitize-recover=all
"$out/misuse" "$out/short.sweeps" | sed 's/^/address sanitizer: /'
misuse
# Valgrind runs all threads on one core: without fairness, the disturbing thread would keep it.
valgrind --quiet --error-exitcode=1 --fair-sched=yes \
    --leak-check=full --show-leak-kinds=definite --errors-for-leak-kinds=definite \
    "$out/misuse" "$out/short.sweeps" | sed 's/^/valgrind: /'
