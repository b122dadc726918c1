"""Dynamic motion estimation from LIDAR: a velocity, and whether it moves, for every return.

    flow = raywake.flow(a, b)                      # from one cloud to the next, without poses

    pipeline = raywake.Pipeline()                  # a sweep at a time, at sensor rate
    for sweep in raywake.Recording("drive"):
        step = pipeline.step(sweep)
        moving = step.points["status"] == raywake.MOVING

Frames: x forward, y left, z up, metres and seconds. A pose is a 4x4 matrix (world_from_vehicle) or
x, y, z, qx, qy, qz, qw. Arrays of records have one element per column, return, tracklet or object;
their fields are views. They belong to the caller: no later step changes them.
"""

from __future__ import annotations

import os
import subprocess
import sys

from ._raywake import (
    COLUMN_DTYPE,
    FLOW_DTYPE,
    OBJECT_DTYPE,
    POINT_DTYPE,
    TRACKLET_DTYPE,
    CloudFlow,
    Pipeline,
    Recording,
    Rig,
    Step,
    Sweep,
    __version__,
    flow,
    odometry,
)

#: Outcome for a return: field ``status`` of its record.
STATIC, MOVING, UNMATCHED, OUTSIDE_WINDOW, OVER_CAPACITY, OWN_VEHICLE, NO_ECHO, INVALID = range(8)

#: Classes of a column: field ``class_id`` of a record; 255 if unknown.
CLASSES = (
    "ground",
    "structure",
    "vegetation",
    "pole",
    "car",
    "large vehicle",
    "person",
    "two-wheeler",
)

__all__ = [
    "CLASSES",
    "COLUMN_DTYPE",
    "FLOW_DTYPE",
    "INVALID",
    "MOVING",
    "NO_ECHO",
    "OBJECT_DTYPE",
    "OUTSIDE_WINDOW",
    "OVER_CAPACITY",
    "OWN_VEHICLE",
    "POINT_DTYPE",
    "STATIC",
    "TRACKLET_DTYPE",
    "UNMATCHED",
    "CloudFlow",
    "CommandError",
    "Pipeline",
    "Recording",
    "Rig",
    "Step",
    "Sweep",
    "__version__",
    "clean",
    "command",
    "flow",
    "odometry",
]


class CommandError(RuntimeError):
    """A command ended with an error. ``code`` is its exit code (see ``raywake --help``)."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


def command(*args: str | os.PathLike[str]) -> str:
    """Does what ``raywake ARGS`` does, in a separate process, and returns what it printed.

    Raises CommandError with its error message if it fails.
    """
    call = [sys.executable, "-m", "raywake", *map(os.fspath, args)]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise CommandError(done.stderr.strip() or done.stdout.strip(), done.returncode)
    return done.stdout


def clean(
    data: str | os.PathLike[str], out: str | os.PathLike[str], *options: str
) -> str:
    """Removes what moves from a recording: writes labels, clouds and a static map to ``out``.

    ``options`` are those of ``raywake clean --help``.
    """
    return command("clean", data, "--out", out, *options)
