"""Flow of a recording in Rerun, as it is computed: returns in grey, an arrow per moving return.

    pip install FOLDER/raywake-*.whl rerun-sdk
    python rerun_flow.py RECORDING [--save FILE.rrd]
"""

import sys

import numpy as np
import raywake
import rerun as rr

rr.init("raywake", spawn="--save" not in sys.argv)
if "--save" in sys.argv:
    rr.save(sys.argv[-1])

recording = raywake.Recording(sys.argv[1])
pipeline = raywake.Pipeline(rig=recording.rig, find_poses=not recording.located)
before = None
for sweep in recording:
    step = pipeline.step(sweep)
    if step.dt is not None:
        # The flow is that of the previous sweep.
        at, flow = before.points, step.points
        moving = flow["status"] == raywake.MOVING
        colours = np.where(moving[:, None], [215, 38, 41], [150, 160, 170])
        rr.set_time("time", duration=before.stamp)
        rr.log("points", rr.Points3D(at, colors=colours))
        # Over ground, along the vehicle's axes: where it will be in 0.5 s.
        velocity = np.pad(flow["velocity_world_mps"][moving], ((0, 0), (0, 1)))
        in_vehicle = velocity @ pose[:3, :3]
        rr.log("motion", rr.Arrows3D(origins=at[moving], vectors=0.5 * in_vehicle))
    before, pose = sweep, step.pose
