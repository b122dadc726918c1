"""Checks that raywake reads what others write, and that others read what raywake writes.

    python viewers.py RAYWAKE FOLDER

Needs mcap-ros2-support, numpy and rerun-sdk. FOLDER takes the files that the test writes.
"""
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer

RAYWAKE, FOLDER = sys.argv[1], Path(sys.argv[2])
POINT = "float64 x\nfloat64 y\nfloat64 z\n"
QUATERNION = POINT + "float64 w\n"


def definition(own, **others):
    """A message's definition, with those of its parts."""
    parts = {k.replace("__", "/"): v for k, v in others.items()}
    head = "=" * 80
    return own + "".join(f"\n{head}\nMSG: {k}\n{v}" for k, v in parts.items())


HEADER = {
    "std_msgs__Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces__Time": "int32 sec\nuint32 nanosec\n",
}
CLOUD = definition(
    "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
    "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    sensor_msgs__PointField="string name\nuint32 offset\nuint8 datatype\nuint32 count\n",
    **HEADER,
)
TF = definition(
    "geometry_msgs/TransformStamped[] transforms\n",
    geometry_msgs__TransformStamped="std_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform\n",
    geometry_msgs__Transform="geometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n",
    geometry_msgs__Vector3=POINT,
    geometry_msgs__Quaternion=QUATERNION,
    **HEADER,
)


def raywake(*args):
    subprocess.run([RAYWAKE, *map(str, args), "--quiet"], check=True)


def header(ns, frame):
    return {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": frame}


def clouds(path, topic):
    """Time and returns of every cloud."""
    kinds = {2: "u1", 5: "<i4", 7: "<f4"}
    for message in read_ros2_messages(str(path), topics=[topic]):
        cloud = message.ros_msg
        row = np.dtype({
            "names": [f.name for f in cloud.fields],
            "formats": [kinds[f.datatype] for f in cloud.fields],
            "offsets": [f.offset for f in cloud.fields],
            "itemsize": cloud.point_step,
        })
        yield message.log_time_ns, np.frombuffer(bytes(cloud.data), row)


def two_lidars(path, sweeps):
    """A bag of two lidars without poses, half of the returns each, one turned by a right angle."""
    with open(path, "wb") as file:
        writer = Writer(file)
        tf = writer.register_msgdef("tf2_msgs/msg/TFMessage", TF)
        cloud = writer.register_msgdef("sensor_msgs/msg/PointCloud2", CLOUD)
        ns = sweeps[0][0]
        turn = {"x": 0.0, "y": 0.0, "z": math.sqrt(0.5), "w": math.sqrt(0.5)}
        none = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
        at = {"x": 0.0, "y": 0.0, "z": 0.0}
        transforms = [
            {"header": header(ns, "base_link"), "child_frame_id": frame,
             "transform": {"translation": at, "rotation": rotation}}
            for frame, rotation in [("left", turn), ("right", none)]
        ]
        writer.write_message("/tf_static", tf, {"transforms": transforms}, ns, ns)
        for ns, returns in sweeps:
            x, y, z = (returns[axis].astype("<f4") for axis in "xyz")
            # In the frame of the sensor turned to the left, +x points to the left.
            for frame, chosen, places in [("left", y > 0, (y, -x, z)), ("right", y <= 0, (x, y, z))]:
                rows = np.stack([p[chosen] for p in places], axis=1)
                fields = [{"name": n, "offset": 4 * i, "datatype": 7, "count": 1}
                          for i, n in enumerate("xyz")]
                message = {"header": header(ns, frame), "height": 1, "width": len(rows),
                           "fields": fields, "is_bigendian": False, "point_step": 12,
                           "row_step": 12 * len(rows), "data": rows.tobytes(), "is_dense": True}
                writer.write_message(f"/{frame}/points", cloud, message, ns, ns)
        writer.finish()


def check(what, holds):
    print(("ok      " if holds else "FAILED  ") + what)
    if not holds:
        sys.exit(1)


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    raywake("demo", "--backend", "scalar", "--out", FOLDER / "demo")
    demo = FOLDER / "demo" / "demo.mcap"
    sweeps = list(clouds(demo, "/raywake/points"))
    moving = sum(int((returns["status"] == 1).sum()) for _, returns in sweeps)
    check(f"the demo's {len(sweeps)} clouds are read, {moving} returns move", moving > 1000)

    bag = FOLDER / "two.mcap"
    two_lidars(bag, sweeps)
    common = ["--deskew", "off", "--backend", "scalar"]
    flow, objects = FOLDER / "flow.mcap", FOLDER / "objects.mcap"
    raywake("run", bag, "--mcap", flow, "--summary", FOLDER / "run.json", *common)
    summary = json.loads((FOLDER / "run.json").read_text())
    found = summary["registration"]
    check(f"two lidars without poses: {summary['pairs']} pairs", summary["pairs"] == len(sweeps) - 1)
    check(f"all sweeps located: {found}", found["registered"] == len(sweeps) - 1)
    again = list(clouds(flow, "/raywake/points"))
    check("no return is lost", all(len(a[1]) == len(b[1]) for a, b in zip(sweeps, again)))
    same = sum(int((r["status"] == 1).sum()) for _, r in again)
    check(f"{same} of its returns move", same > 0.8 * moving * len(again) / len(sweeps))
    raywake("clean", bag, "--out", FOLDER / "clean", *common)
    raywake("track", bag, "--mcap", objects, "--front-end", "flow", *common)

    scenes = [m.ros_msg for m in read_ros2_messages(str(objects), topics=["/raywake/scene"])]
    tracked = [m.ros_msg for m in read_ros2_messages(str(objects), topics=["/raywake/tracked_objects"])]
    boxes = [c for scene in scenes for e in scene.entities for c in e.cubes]
    sizes = [o.shape.dimensions for t in tracked for o in t.objects]
    check(f"{len(boxes)} boxes for Foxglove are those for Autoware",
          [(s.x, s.y) for s in sizes] == [(b.size.x, b.size.y) for b in boxes] and len(boxes) > 20)
    fast = [o for t in tracked for o in t.objects if not o.kinematics.is_stationary]
    speeds = [o.kinematics.twist_with_covariance.twist.linear for o in fast]
    check(f"{len(fast)} of them move along their length",
          len(fast) > 20 and np.median([abs(v.y) / max(math.hypot(v.x, v.y), 0.1) for v in speeds]) < 0.1)
    for file in (flow, objects):
        rrd = file.with_suffix(".rrd")
        convert = ["rerun", "mcap", "convert", str(file), "-o", str(rrd)]
        subprocess.run([Path(sys.executable).parent / convert[0], *convert[1:]], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        check(f"Rerun takes {file.name}: {rrd.stat().st_size} bytes", rrd.stat().st_size > 100_000)


main()
