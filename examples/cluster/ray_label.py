"""Labels many recordings on a Ray cluster: share of moving returns, per recording and sweep.

    pip install FOLDER/raywake-*.whl "ray[data]"
    python ray_label.py drives.txt labels.csv
"""

import csv
import sys
from pathlib import Path

import numpy as np
import ray
import raywake


@ray.remote(num_cpus=2)
def label(path):
    """Returns a row per pair of sweeps: recording, stamp, returns, moving returns, fastest, m/s."""
    recording = raywake.Recording(path)
    pipeline = raywake.Pipeline(
        rig=recording.rig, find_poses=not recording.located, threads=2
    )
    rows = []
    for sweep in recording:
        step = pipeline.step(sweep)
        if step.dt is None:
            continue
        moving = step.points["status"] == raywake.MOVING
        speed = np.hypot(*step.points["velocity_world_mps"][moving].T)
        rows.append((path, sweep.stamp - step.dt, len(moving), moving.sum(), speed.max(initial=0)))
    return rows


def main(listed, out):
    """Labels all recordings of a list. One that fails is reported, and the others go on."""
    lines = [line.strip() for line in Path(listed).read_text().splitlines()]
    paths = [line for line in lines if line and line[0] != "#"]
    waiting = [label.remote(path) for path in paths]
    failed = 0
    with open(out, "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["recording", "stamp_s", "returns", "moving", "fastest_mps"])
        while waiting:
            done, waiting = ray.wait(waiting)
            for task in done:
                try:
                    rows.writerows(ray.get(task))
                except ray.exceptions.RayTaskError as error:
                    failed += 1
                    print(error.cause, file=sys.stderr)
    if failed:
        sys.exit(f"{failed} of {len(paths)} recordings failed")


if __name__ == "__main__":
    main(*sys.argv[1:])
