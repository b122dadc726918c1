#!/usr/bin/env bash
# Runs every check in one command. On Debian it installs what is missing, so that nothing is
# skipped: the software Vulkan device, validation layers, spirv-val, a browser, compilers and
# emulators for aarch64, Valgrind, Python's venv, Slurm, GNU parallel and debootstrap.
#
#   RAYWAKE_DATA=FOLDER   also run the tests on recorded drives found there
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s (after %d min)\n' "$*" $((SECONDS / 60)); }

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }

# Services that run checks set CI. Their machines start from nothing, and some have little room.
discard() { [ -z "${CI:-}" ] || rm -rf "$@"; }

missing_packages() {
    local package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q ' installed' ||
            echo "$package"
    done
}

install() {
    local packages
    packages=$(missing_packages "$@")
    [ -z "$packages" ] && return 0
    say "installing" $packages
    as_root apt-get update -qq
    # shellcheck disable=SC2086
    as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends $packages >/dev/null
}

if command -v apt-get >/dev/null; then
    install libvulkan1 mesa-vulkan-drivers vulkan-validationlayers spirv-tools gcc g++ \
        pkg-config valgrind
fi
# Opens a report; nothing else needs it.
browser() { [ -n "${RAYWAKE_BROWSER:-}" ] || command -v chromium chromium-browser google-chrome; }
if ! browser >/dev/null && command -v apt-get >/dev/null; then
    install chromium || echo "chromium cannot be installed"
fi
export RAYWAKE_VULKAN=${RAYWAKE_VULKAN:-required}
# The Python module works with any interpreter; none is needed to compile it.
export PYO3_NO_PYTHON=1

say "format and lints"
cargo fmt --all --check
cargo clippy --workspace --all-targets --quiet -- -D warnings

say "documentation"
# Links to private items resolve, since these are documented too.
RUSTDOCFLAGS="-D warnings -A rustdoc::private-intra-doc-links" \
    cargo doc --workspace --no-deps --document-private-items --quiet

say "licences and versions of dependencies"
if command -v cargo-deny >/dev/null || cargo install --quiet --locked cargo-deny@0.20.2; then
    cargo deny --log-level error check licenses bans sources
else
    echo "skipped: cargo-deny cannot be installed"
fi

say "core without an operating system"
if rustup target add thumbv7em-none-eabihf >/dev/null 2>&1; then
    cargo check --quiet --target thumbv7em-none-eabihf \
        -p raywake-core -p raywake-objects -p raywake-registration -p raywake-embed
    echo "checks for thumbv7em-none-eabihf"
else
    echo "skipped: the target thumbv7em-none-eabihf cannot be installed"
fi

say "undefined behaviour"
# Findings vary from one nightly compiler to the next, so the date is fixed. Miri is about a
# thousand times slower than native: it runs the unsafe code, and those parts of core that do not
# process whole sweeps. This target, because for others libm has assembly, which Miri does not
# support.
nightly=nightly-2026-10-29
if rustup toolchain install $nightly --profile minimal -c miri -c rust-src >/dev/null 2>&1; then
    miri() { CARGO_TARGET_DIR=target/miri cargo +$nightly miri test --quiet --lib "$@" 2>&1; }
    miri -p raywake-alloc-guard
    # Its memory is borrowed permanently.
    MIRIFLAGS=-Zmiri-ignore-leaks \
        miri --target riscv64gc-unknown-linux-gnu -p raywake-embed
    miri --target riscv64gc-unknown-linux-gnu -p raywake-core --features pipeline -- continuity:: \
        cues:: digest:: footprint:: frame:: motion_compensation:: output:: params:: pose:: \
        prepare:: record:: surface:: weights:: map::tests::b map::tests::p stages::compact:: \
        stages::grid::columns:: stages::grid::shift:: stages::grid::walk:: \
        stages::map::reduce_by_key:: tracklet::ekf::tests::the_gate tracklet::tests::t
else
    echo "skipped: Miri cannot be installed"
fi

say "fuzzers compile"
CARGO_TARGET_DIR=target/fuzz cargo check --quiet --locked --manifest-path host/io/fuzz/Cargo.toml

# The same results as on the host, bit for bit.
bare() {
    rustup target add aarch64-unknown-none >/dev/null 2>&1 || return 1
    command -v qemu-system-aarch64 >/dev/null || { command -v apt-get >/dev/null &&
        install qemu-system-arm; } || return 1
    cargo build --quiet --release -p raywake-bare --target aarch64-unknown-none || exit 1
    timeout 120 qemu-system-aarch64 -machine virt -cpu cortex-a72 -m 256M -nographic -nic none \
        -kernel target/aarch64-unknown-none/release/raywake-bare </dev/null | tr -d '\r' >target/bare
    cargo run --quiet --release -p raywake-bare >target/hosted || exit 1
    grep -q digest target/hosted || exit 1
    cmp <(grep digest target/bare) <(grep digest target/hosted) || exit 1
    # What README says; 113,696 bytes at the time of writing.
    stack=$(sed -n 's/^stack *\([0-9]*\) bytes$/\1/p' target/bare)
    [ "$stack" -le 131072 ] || { echo "$stack bytes of stack, more than 128 KiB"; exit 1; }
    echo "on a bare aarch64 machine and here: $(grep digest target/bare), $stack bytes of stack"
}
bare || echo "skipped: no target or emulator for a bare aarch64 machine available"

say "the program alone, onboard, with every index clamped, and for aarch64"
cargo build --quiet --release -p raywake --all-features
onboard=$(host/package/onboard.sh "$(uname -m)")
RAYWAKE_KERNELS=restrict cargo build --quiet --release -p raywake --target-dir target/restrict
# States are zero-initialised, which takes no room in a file; one that is not would show here.
bytes=$(wc -c <"$onboard")
echo "onboard binary: $bytes bytes"
[ "$bytes" -le 4000000 ] || { echo "larger than 4,000,000 bytes"; exit 1; }
others=(target/release/raywake "$onboard" target/restrict/release/raywake)

# As a single file without dependencies.
static() {
    rustup target add "$1-unknown-linux-musl" >/dev/null 2>&1 || return 1
    local bytes
    program=$(host/package/static.sh "$1") || exit 1
    bytes=$(wc -c <"$program")
    echo "static binary for $1: $bytes bytes"
    [ "$bytes" -le 6000000 ] || { echo "larger than 6,000,000 bytes"; exit 1; }
    readelf --program-headers "$program" >target/headers.txt || exit 1
    ! grep INTERP target/headers.txt || { echo "not static"; exit 1; }
}
if static "$(uname -m)"; then
    others+=("$program")
else
    echo "skipped: no static binary, as its target cannot be installed"
fi

# The same bits on another instruction set: an emulator wrapped as one more program.
emulated() {
    printf '#!/bin/sh\nexec qemu-aarch64-static %s "$@"\n' "$2" >"$1"
    chmod +x "$1"
    others+=("$1")
}
aarch64() {
    [ "$(uname -m)" = x86_64 ] || return 1
    command -v apt-get >/dev/null || return 1
    install gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static || return 1
    static aarch64 || return 1
    emulated target/raywake-aarch64 "$PWD/$program"
    program=$(host/package/onboard.sh aarch64) || exit 1
    emulated target/raywake-aarch64-onboard "-L /usr/aarch64-linux-gnu $PWD/$program"
}
aarch64 || echo "skipped: no aarch64 compiler, linker or emulator available"
RAYWAKE_DIGEST_OF=$(printf "$PWD/%s:" "${others[@]}")
export RAYWAKE_DIGEST_OF=${RAYWAKE_DIGEST_OF%:}
# Of programs that are now built, what they were built from: beside the fingerprints.
mapfile -t built < <(find target -type d -name .fingerprint -prune -printf '%h\n' |
    grep -v -x -e target/debug -e target/release)
discard "${built[@]/%//deps}" "${built[@]/%//build}" target/doc

say "tests"
unable=()
browser >/dev/null || {
    echo "skipped: reports in a browser, as there is none"
    unable=(--skip a_browser)
}
if [ -n "${RAYWAKE_DATA:-}" ]; then
    cargo test --workspace --quiet -- --include-ignored "${unable[@]}"
else
    cargo test --workspace --quiet
    cargo test --quiet -p raywake-lab --lib a_browser -- --ignored "${unable[@]}"
fi

say "tests with a reduced set of features"
cargo test --quiet -p raywake -p raywake-io --no-default-features --features raywake/demo,raywake/png
# Those of the README for a vehicle.
for features in pcap pcap,arrow; do
    cargo check --quiet -p raywake --no-default-features --features $features
done

say "the library for C"
host/capi/tests/run.sh target/release/raywake

say "other programs' recordings in, ours into theirs"
# Wheels that are installed or can be; a failure of what they run is a failure.
viewers() {
    ! command -v apt-get >/dev/null || install python3-venv || return 1
    python3 -m venv target/viewers 2>/dev/null || return 1
    target/viewers/bin/pip install --quiet --disable-pip-version-check \
        mcap-ros2-support==0.6.0 numpy==2.4.6 rerun-sdk==0.41.0 2>/dev/null
}
if viewers; then
    # Recordings of another build would be results of other settings.
    rm -rf target/viewers/recordings
    target/viewers/bin/python tests/viewers.py target/release/raywake target/viewers/recordings
else
    echo "skipped: mcap-ros2-support, numpy and rerun-sdk cannot be installed"
fi

say "the module for Python"
if ! command -v apt-get >/dev/null || install python3-venv; then
    code=0
    host/python/tests/run.sh target/release/raywake || code=$?
    case $code in
        0) ;;
        77) echo "skipped: maturin and numpy cannot be installed" ;;
        *) exit "$code" ;;
    esac
else
    echo "skipped: python3-venv cannot be installed"
fi

discard target/viewers

# In a Debian that has nothing else, with what the package says it needs.
fresh_root() {
    . /etc/os-release
    { [ "$ID" = debian ] && [ "$(id -u)" = 0 ] && install debootstrap; } || return 1
    local root=target/root digest
    rm -rf "$root"
    debootstrap --variant=minbase "$VERSION_CODENAME" "$root" >target/root.log 2>&1 || return 1
    cp "$1" "$root/raywake.deb"
    chroot "$root" apt-get install -y -qq --no-install-recommends ./raywake.deb >/dev/null || exit 1
    digest=$(chroot "$root" raywake demo | grep ^digest) || exit 1
    echo "installed in a fresh root: $digest"
    grep -qx "$digest" <(cd target/installed && ../release/raywake demo) ||
        { echo "which is not the program's"; exit 1; }
    rm -rf "$root"
}

say "the Debian package"
if command -v dpkg-deb >/dev/null && { command -v cargo-deb >/dev/null ||
    cargo install --quiet --locked cargo-deb@3.8.0; }; then
    # The package profile takes minutes to compile, and changes nothing in the package.
    package=$(host/package/deb.sh release)
    rm -rf target/installed
    dpkg-deb --extract "$package" target/installed
    target/installed/usr/bin/raywake --version
    for file in etc/default/raywake usr/lib/systemd/system/raywake.service \
        usr/share/man/man1/raywake-live.1.gz; do
        [ -s "target/installed/$file" ] || { echo "$file is missing"; exit 1; }
    done
    if command -v systemd-analyze >/dev/null; then
        # As if it were installed. Whatever it has to say is a mistake.
        sed "s|/usr/bin/|$PWD/target/installed/usr/bin/|" \
            target/installed/usr/lib/systemd/system/raywake.service >target/raywake.service
        said=$(systemd-analyze verify --man=no "$PWD/target/raywake.service" 2>&1) && [ -z "$said" ] ||
            { echo "$said"; exit 1; }
        echo "the unit for systemd is valid"
    else
        echo "skipped: the unit for systemd is not checked, as systemd is not installed"
    fi
    fresh_root "$package" || echo "skipped: a fresh Debian cannot be made here"
else
    echo "skipped: no Debian package can be built here"
fi

say "many recordings, many processes"
if command -v apt-get >/dev/null; then
    # What cannot be installed is skipped there.
    install slurm-wlm munge || true
    install parallel || true
fi
cargo build --quiet -p raywake-lab -p raywake-faulty-layer
tests/shards.sh target/release/raywake target/debug/raywake-lab

say "instructions of every stage, identical on both runs"
if command -v valgrind >/dev/null; then
    instructions() {
        target/debug/raywake-lab instructions -n 3 --out target/instructions | grep -v report
    }
    instructions >target/counted
    grep -q '^refine' target/counted
    cmp target/counted <(instructions)
else
    echo "skipped: there is no Valgrind"
fi

say "five minutes of sweeps and faults"
tests/soak.sh target/debug/raywake-lab target/debug/libraywake_faulty_layer.so 2.5

say "variants side by side, two sweeps each"
cargo test --quiet -p raywake-tests --benches

say "all passed"
