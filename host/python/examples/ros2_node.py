"""A ROS 2 node: takes PointCloud2; publishes PointCloud2 with velocity, P(moves) and status of
every point, and objects as a MarkerArray of boxes.

    pip install FOLDER/raywake-*.whl
    python ros2_node.py --ros-args -r points:=/lidar/points -p ground:=-1.8

Poses come from registration or, with `-p find_poses:=false`, from tf (`world_frame` to the cloud's
frame). What is published belongs to the cloud before the last.
"""

from array import array

import numpy as np
import raywake

#: Types of sensor_msgs/PointField.
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def as_array(cloud):
    """Returns the points of a PointCloud2 as a structured array, copied only if rows are padded."""
    order = ">" if cloud.is_bigendian else "<"
    fields = [field for field in cloud.fields if field.count <= 1]
    row = np.dtype(
        {
            "names": [field.name for field in fields],
            "formats": [order + TYPES[field.datatype] for field in fields],
            "offsets": [field.offset for field in fields],
            "itemsize": cloud.point_step,
        }
    )
    data = np.frombuffer(memoryview(cloud.data), np.uint8)
    rows = data[: cloud.height * cloud.row_step].reshape(cloud.height, cloud.row_step)
    rows = np.ascontiguousarray(rows[:, : cloud.width * cloud.point_step])
    return rows.view(row).reshape(-1)


def times_of(points, stamp):
    """Returns the time of every point after the stamp, s; None if the cloud has no times."""
    for name in ("t", "time", "timestamp", "time_offset", "offset_time"):
        if name in (points.dtype.names or ()):
            time = points[name].astype(np.float64)
            if points.dtype[name].kind in "iu":
                time *= 1e-9
            return time - stamp if time.size and abs(time).max() > 1e6 else time
    return None


def positions_of(points):
    """Returns the positions, N x 3."""
    return np.stack([points[axis] for axis in "xyz"], axis=1)


#: What is published for a point.
OUT = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("velocity_x", "<f4"),
        ("velocity_y", "<f4"),
        ("velocity_z", "<f4"),
        ("p_moves", "<f4"),
        ("status", "u1"),
    ]
)


def with_velocity(positions, flow):
    """Returns positions and results, relative to the sensor, as an array of OUT."""
    out = np.zeros(len(positions), OUT)
    for n, axis in enumerate("xyz"):
        out[axis] = positions[:, n]
        out["velocity_" + axis] = flow["velocity_ego_mps"][:, n]
    out["p_moves"], out["status"] = flow["probability"], flow["status"]
    return out


def as_boxes(objects, world_from_vehicle):
    """Yields number, class, whether it moves, position, heading, size and velocity over ground of
    every object, in the vehicle frame."""
    vehicle_from_world = np.linalg.inv(world_from_vehicle)
    turn = vehicle_from_world[:3, :3]
    yaw = np.arctan2(turn[1, 0], turn[0, 0])
    for o in objects:
        kind = raywake.CLASSES[o["class_id"]] if o["class_id"] < len(raywake.CLASSES) else "object"
        yield {
            "id": int(o["id"]),
            "class": kind,
            "moves": bool(o["moves"]),
            "place": turn @ o["position_world_m"] + vehicle_from_world[:3, 3],
            "heading": float(o["heading_rad"] + yaw),
            "size": o["size_m"].tolist(),
            "velocity": turn[:2, :2] @ o["velocity_world_mps"],
        }


class Flow:
    """The node's processing of a cloud, without ROS."""

    def __init__(self, ground, find_poses, timed):
        timing = dict(timing="offset", distorted=True, start=-0.1, span=0.2) if timed else {}
        rig = raywake.Rig(ground=ground, **timing)
        self.pipeline = raywake.Pipeline(rig=rig, find_poses=find_poses, objects=True)
        self.before = None

    def step(self, points, stamp, pose=None):
        """Takes a cloud. Returns the previous cloud as an array of OUT and its objects, or None."""
        positions = positions_of(points)
        step = self.pipeline.step(positions, stamp, pose, time=times_of(points, stamp))
        before, self.before = self.before, (positions, step.pose)
        if step.dt is None:
            return None
        return with_velocity(before[0], step.points), list(as_boxes(step.objects, before[1]))


def main():
    import rclpy
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from rclpy.time import Time
    from sensor_msgs.msg import PointCloud2, PointField
    from tf2_ros import Buffer, TransformException, TransformListener
    from visualization_msgs.msg import Marker, MarkerArray

    class FlowNode(Node):
        def __init__(self):
            super().__init__("raywake")
            self.ground = self.declare_parameter("ground", -1.73).value
            self.find_poses = self.declare_parameter("find_poses", True).value
            self.world = self.declare_parameter("world_frame", "odom").value
            self.flow, self.header = None, None
            self.tf = Buffer()
            self.listener = TransformListener(self.tf, self)
            self.out = self.create_publisher(PointCloud2, "points_with_velocity", 10)
            self.objects = self.create_publisher(MarkerArray, "objects", 10)
            self.create_subscription(
                PointCloud2, "points", self.on_cloud, qos_profile_sensor_data
            )

        def pose(self, header):
            if self.find_poses:
                return None
            at = self.tf.lookup_transform(self.world, header.frame_id, Time.from_msg(header.stamp))
            t, r = at.transform.translation, at.transform.rotation
            return [t.x, t.y, t.z, r.x, r.y, r.z, r.w]

        def on_cloud(self, cloud):
            points = as_array(cloud)
            stamp = cloud.header.stamp.sec + 1e-9 * cloud.header.stamp.nanosec
            if self.flow is None:
                timed = times_of(points, stamp) is not None
                self.flow = Flow(self.ground, self.find_poses, timed)
            try:
                found = self.flow.step(points, stamp, self.pose(cloud.header))
            except (TransformException, ValueError) as e:
                self.get_logger().warning(f"cloud skipped: {e}")
                return
            header, self.header = self.header, cloud.header
            if found is not None:
                points, boxes = found
                self.out.publish(self.message(header, points))
                self.objects.publish(MarkerArray(markers=[self.marker(header, b) for b in boxes]))

        def marker(self, header, box):
            marker = Marker(header=header, ns=box["class"], id=box["id"], type=Marker.CUBE)
            place, half = marker.pose, 0.5 * box["heading"]
            place.position.x, place.position.y, place.position.z = map(float, box["place"])
            place.orientation.z, place.orientation.w = np.sin(half), np.cos(half)
            marker.scale.x, marker.scale.y, marker.scale.z = box["size"]
            marker.color.r, marker.color.b = (0.8, 0.2) if box["moves"] else (0.4, 0.6)
            marker.color.a = 0.6
            marker.lifetime.nanosec = 250_000_000
            u, v = box["velocity"]
            marker.text = f"{box['class']} {box['id']} {np.hypot(u, v):.1f} m/s"
            return marker

        def message(self, header, found):
            fields = [
                PointField(
                    name=name,
                    offset=OUT.fields[name][1],
                    datatype=PointField.UINT8 if OUT[name].kind == "u" else PointField.FLOAT32,
                    count=1,
                )
                for name in OUT.names
            ]
            return PointCloud2(
                header=header,
                height=1,
                width=len(found),
                fields=fields,
                point_step=OUT.itemsize,
                row_step=found.nbytes,
                # Of bytes, rclpy would check every one.
                data=array("B", found.tobytes()),
                is_dense=False,
            )

    rclpy.init()
    rclpy.spin(FlowNode())


if __name__ == "__main__":
    main()
