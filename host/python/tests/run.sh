#!/usr/bin/env bash
# Tests the wheel, built and installed into a fresh environment, against the program and with
# invalid input. `run.sh PROGRAM` compares with the program `raywake`; exit code 77: tools
# unavailable.
set -euo pipefail
program=$(realpath "$1")
cd "$(dirname "$0")/../../.."
out=$PWD/target/python
python=$out/fresh/bin/python
mkdir -p "$out"

python3 -m venv "$out/tools" &&
    "$out/tools/bin/pip" install --quiet --disable-pip-version-check maturin==1.16.0 || exit 77

rm -rf "$out/wheels" "$out/other" "$out/fresh"
# Built like the program: optimising across crates takes minutes and changes no result.
PATH=$out/tools/bin:$PATH host/python/wheel.sh "$(uname -m)" "$out/wheels" release

python3 -m venv "$out/fresh"
start=$SECONDS
"$out/fresh/bin/pip" install --quiet --disable-pip-version-check "$out"/wheels/raywake-*.whl || exit 77
"$python" -c 'import numpy, raywake
wall = numpy.stack(numpy.meshgrid([8.0], numpy.arange(-9, 9, 0.1), numpy.arange(-1.7, 3, 0.1)), -1)
ground = numpy.stack(numpy.meshgrid(numpy.arange(-9, 9, 0.1), numpy.arange(-9, 9, 0.1), [-1.7]), -1)
side = numpy.stack(numpy.meshgrid(numpy.arange(-9, 8, 0.1), [9.0], numpy.arange(-1.7, 3, 0.1)), -1)
cloud = numpy.concatenate([part.reshape(-1, 3) for part in (wall, ground, side)])
print(raywake.flow(cloud, cloud))'
took=$((SECONDS - start))
echo "from pip install to the flow of two arrays: $took s"
[ "$took" -lt 60 ] || { echo "it should take less than a minute"; exit 1; }

# The example for Rerun, if Rerun is installed: alongside recordings of the program.
viewers=$PWD/target/viewers/bin
if [ -x "$viewers/rerun" ]; then
    "$viewers/pip" install --quiet --disable-pip-version-check --no-deps --force-reinstall \
        "$out"/wheels/raywake-*.whl
    recording=target/viewers/recordings/two.mcap
    "$viewers/python" host/python/examples/rerun_flow.py "$recording" --save "$out/flow.rrd"
    # Not through a pipe: Rerun treats one that is closed early as a defect.
    "$viewers/rerun" rrd stats "$out/flow.rrd" >"$out/flow.txt" 2>&1
    grep -q motion "$out/flow.txt"
    echo "the example for Rerun: $recording"
fi

dump() { cargo run --quiet --release -p raywake-capi --example dump_sweeps -- "$@"; }
dump demo "$out/demo.sweeps" 20
# Results of another build would count as results of other settings.
rm -rf "$out/demo"
# Reads the program's tables.
"$out/fresh/bin/pip" install --quiet --disable-pip-version-check pyarrow==26.0.1 ||
    echo "skipped: records against tables, as pyarrow cannot be installed"
RAYWAKE_PROGRAM=$program RAYWAKE_SWEEPS=$out/demo.sweeps \
    RAYWAKE_RECORDS=$PWD/target/capi/demo.records \
    RAYWAKE_DIGEST=$("$program" demo --backend scalar --out "$out/demo" | sed -n 's/^digest *//p') \
    "$python" host/python/tests/test_raywake.py

# For another architecture: that it is one; it is not run.
if [ "$(uname -m)" = x86_64 ] && command -v aarch64-linux-gnu-gcc >/dev/null; then
    PATH=$out/tools/bin:$PATH host/python/wheel.sh aarch64 "$out/other" release
    "$python" -m zipfile -e "$out"/other/raywake-*aarch64.whl "$out/other"
    readelf -h "$out"/other/raywake/*.so | grep -q AArch64
    echo "the wheel for aarch64: $(stat -c %s "$out"/other/raywake-*aarch64.whl) bytes"
else
    echo "skipped: no wheel for aarch64, as there is no compiler"
fi
