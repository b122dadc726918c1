"""Shows what `raywake run DATA --mcap flow.mcap` wrote in Rerun, with an arrow per moving return.

    pip install rerun-sdk mcap-ros2-support numpy
    python rerun_flow.py flow.mcap
"""
import sys

import numpy as np
import rerun as rr
from mcap_ros2.reader import read_ros2_messages

TYPES = {2: "u1", 7: "<f4"}  # UINT8 and FLOAT32 of sensor_msgs/PointField

rr.init("raywake", spawn="--save" not in sys.argv)
if "--save" in sys.argv:
    rr.save(sys.argv[-1])
for message in read_ros2_messages(sys.argv[1], topics=["/raywake/points"]):
    cloud = message.ros_msg
    row = np.dtype({
        "names": [f.name for f in cloud.fields],
        "formats": [TYPES[f.datatype] for f in cloud.fields],
        "offsets": [f.offset for f in cloud.fields],
        "itemsize": cloud.point_step,
    })
    returns = np.frombuffer(bytes(cloud.data), row)
    at = np.stack([returns[axis] for axis in "xyz"], axis=1)
    moving = returns["status"] == 1
    v = np.stack([returns["velocity_x"], returns["velocity_y"], 0 * returns["speed"]], axis=1)
    rr.set_time("time", timestamp=message.log_time_ns * 1e-9)
    rr.log("points", rr.Points3D(at, colors=np.where(moving[:, None], [215, 38, 41], [150, 160, 170])))
    rr.log("motion", rr.Arrows3D(origins=at[moving], vectors=0.5 * v[moving]))
