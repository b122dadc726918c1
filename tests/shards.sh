#!/usr/bin/env bash
# Many recordings on many machines: the same bytes as from one process, whatever distributes the
# shards, even if a task is killed and requeued. `shards.sh PROGRAM LAB`; steps that need GNU
# parallel, DuckDB, PyArrow or Slurm (Debian's slurm-wlm and munge, run here temporarily, as root)
# are skipped with a message if these are missing.
set -euo pipefail
program=$(realpath "$1")
lab=$(realpath "$2")
cd "$(dirname "$0")/.."
work=$PWD/target/shards
rm -rf "$work"
mkdir -p "$work"

"$lab" sim "$work/drives" --drives 8 --sweeps 3 --seed 5 >/dev/null
find "$work/drives" -name '*_sync' -type d | sort >"$work/list"
[ "$(wc -l <"$work/list")" = 8 ] || { echo "8 drives should have been simulated"; exit 1; }
cat >"$work/task" <<EOF
#!/bin/sh
exec "$program" run --list "$work/list" --out "\$1" --parquet --backend scalar --quiet \${2:-}
EOF
chmod +x "$work/task"

# Times differ between runs, and so do the files that contain them.
bytes_of() {
    (cd "$1" && find . \( -name '*.parquet' -o -name '*.feather' -o -name '*.ply' -o \
        -name '*.label' \) -exec sha256sum {} + | sort -k 2)
}
# `compare RESULTS [OTHERS]`: with those of one process.
compare() {
    local found expected
    found=$(bytes_of "$work/$1")
    expected=$(bytes_of "$work/${2:-one}")
    [ "$found" = "$expected" ] || { diff <(echo "$expected") <(echo "$found"); exit 1; }
    [ "$(find "$work/$1" -name done | wc -l)" = 8 ] || { echo "$1: not all are done"; exit 1; }
    echo "$1: $(wc -l <<<"$found") files, identical bytes"
}

"$work/task" "$work/one"
[ "$(bytes_of "$work/one" | wc -l)" = 24 ] || { echo "24 tables should have been written"; exit 1; }

# Killed at arbitrary points, and started again.
for delay in 0.2 0.5 0.9; do
    # `timeout` would kill itself too, before the task is gone, unless it is in the foreground.
    timeout --foreground -s KILL "$delay" "$work/task" "$work/killed" "--shard=0/2" || true
done
"$work/task" "$work/killed" "--shard=0/2"
"$work/task" "$work/killed" "--shard=1/2"
compare killed
before=$(find "$work/killed" -name '*.parquet' -newer "$work/task" -printf '%p %T@\n' | sort)
"$work/task" "$work/killed"
after=$(find "$work/killed" -name '*.parquet' -newer "$work/task" -printf '%p %T@\n' | sort)
[ "$before" = "$after" ] || { echo "finished work was done again"; exit 1; }

start=$SECONDS
seq 8 1000 | xargs -I {} "$work/task" "$work/none" "--shard={}/1001"
took=$((SECONDS - start))
echo "993 empty parts: $took s"
# Milliseconds each: nothing is read or written.
[ "$took" -lt 60 ] || { echo "empty parts should end at once"; exit 1; }

# The other commands.
for command in track clean; do
    for part in 0/1 0/2 1/2; do
        "$program" $command --list "$work/list" --out "$work/$command-of-${part#*/}" \
            --shard $part --backend scalar --quiet
    done
    compare $command-of-2 $command-of-1
done

if command -v parallel >/dev/null; then
    parallel --will-cite -j 2 "$work/task" "$work/parallel" --shard={}/4 ::: 0 1 2 3
    compare parallel
else
    echo "skipped: GNU parallel cannot be installed"
fi

# The code of the documents, on these results. With the environment of the module for Python.
python=target/python/fresh/bin
code_of() { awk -v "start=\`\`\`$1" '$0 == start {inside = 1; next} /^```$/ {inside = 0} inside' "$2"; }
if [ -x $python/pip ] &&
    $python/pip install --quiet --disable-pip-version-check duckdb==2.0.1 2>/dev/null; then
    "$lab" eval --list "$work/list" --out "$work/OUT" --rows-only >"$work/log" 2>&1 ||
        { cat "$work/log"; exit 1; }
    ln -s one "$work/results"
    for document in examples/cluster/README.md lab/README.md; do
        code_of sql $document >"$work/queries"
        (cd "$work" && "$OLDPWD/$python/python" -c 'import duckdb
for query in open("queries").read().split(";")[:-1]:
    rows = duckdb.sql(query).fetchall()
    assert rows and None not in rows[0], query
    print("DuckDB:", *rows[0])')
    done
    ln -s track-of-2 "$work/tracks"
    code_of python examples/cluster/README.md >"$work/tracks.py"
    if $python/python -c 'import pyarrow' 2>/dev/null; then
        (cd "$work" && "$OLDPWD/$python/python" tracks.py)
    else
        echo "skipped: the code for tracks, as PyArrow is not installed"
    fi
else
    echo "skipped: DuckDB cannot be installed"
fi

slurm() {
    local daemons=$work/slurm cores
    cores=$(nproc)
    mkdir -p "$daemons/state" "$daemons/spool" /run/munge
    chown munge: /run/munge
    pgrep munged >/dev/null || { [ -f /etc/munge/munge.key ] || mungekey; runuser -u munge munged; }
    cat >"$daemons/slurm.conf" <<EOF
ClusterName=raywake
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
StateSaveLocation=$daemons/state
SlurmdSpoolDir=$daemons/spool
SlurmctldPidFile=$daemons/slurmctld.pid
SlurmdPidFile=$daemons/slurmd.pid
JobRequeue=1
MinJobAge=3600
NodeName=$(hostname) NodeAddr=127.0.0.1 CPUs=$cores RealMemory=2048 State=UNKNOWN
PartitionName=all Nodes=$(hostname) Default=YES MaxTime=INFINITE State=UP
EOF
    export SLURM_CONF=$daemons/slurm.conf
    slurmctld && slurmd || return 1
    for _ in $(seq 100); do
        sinfo --noheader --format=%T | grep -q idle && return 0
        sleep 0.2
    done
    return 1
}
stop_slurm() { pkill -F "$work/slurm/slurmd.pid"; pkill -F "$work/slurm/slurmctld.pid"; } 2>/dev/null
trap 'stop_slurm || true' EXIT
if command -v slurmctld >/dev/null && [ "$(id -u)" = 0 ] && slurm; then
    mkdir "$work/bin"
    ln -s "$program" "$work/bin/raywake"
    job=$(PATH=$work/bin:$PATH sbatch --parsable --array=0-3 --output="$work/slurm/%a.log" \
        examples/cluster/slurm.sh "$work/list" "$work/slurm/out")
    # One task is killed while running, with everything it runs, and requeued.
    for _ in $(seq 100); do
        squeue --noheader --states=RUNNING --job "${job}_1" | grep -q . && break
        sleep 0.1
    done
    scontrol requeue "${job}_1"
    for _ in $(seq 240); do
        [ -z "$(squeue --noheader --job "$job")" ] && break
        # Slurm holds requeued tasks back for two minutes unless told otherwise.
        scontrol update JobId="${job}_1" StartTime=now >/dev/null 2>&1 || true
        sleep 0.5
    done
    scontrol show job "${job}_1" | grep -o 'Restarts=[0-9]*' | grep -x Restarts=1 ||
        { echo "the task was not killed while running"; exit 1; }
    mv "$work/slurm/out" "$work/array"
    compare array
else
    echo "skipped: Slurm cannot be run here"
fi
