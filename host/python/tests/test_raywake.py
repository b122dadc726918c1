"""Tests the wheel against the program, and with invalid input.

Run with RAYWAKE_SWEEPS=FILE, from dump_sweeps, RAYWAKE_DIGEST=what the program prints for it,
RAYWAKE_RECORDS=FILE, from records.c, and RAYWAKE_PROGRAM=the program.
"""

import ast
import gc
import importlib.util
import os
import struct
import subprocess
import sys
import tempfile
import threading
import types
import unittest
import unittest.mock
from pathlib import Path

import numpy as np
import raywake

try:
    from pyarrow import feather
except ImportError:
    feather = None


class Flat:
    """A file written by dump_sweeps."""

    RETURN = np.dtype([("xyz", "<f4", 3), ("time", "<f4"), ("sensor", "<u4")])

    def __init__(self, path):
        self.data = Path(path).read_bytes()
        timing, distorted, start, span, ground = struct.unpack_from("<2I3d", self.data)
        own = struct.unpack_from("<4f", self.data, 32)
        (count,) = struct.unpack_from("<Q", self.data, 48)
        sensors = np.frombuffer(self.data, "<f8", 7 * count, 56).reshape(count, 7)
        self.rig = raywake.Rig(
            list(sensors),
            timing=["stamp", "offset", "azimuth"][timing],
            start=start,
            span=span or 0.1,
            distorted=bool(distorted),
            ground=ground,
            own_vehicle=own if any(own) else None,
        )
        self.start = 56 + sensors.nbytes

    def __iter__(self):
        at = self.start
        while at < len(self.data):
            stamp, *numbers = struct.unpack_from("<14d", self.data, at)
            (count,) = struct.unpack_from("<Q", self.data, at + 112)
            returns = np.frombuffer(self.data, self.RETURN, count, at + 120)
            yield stamp, numbers[:7], numbers[7:], returns
            at += 120 + returns.nbytes


SWEEPS = Flat(os.environ["RAYWAKE_SWEEPS"])

# Fields of records and the columns of the program's tables that have the same numbers.
MOTION = {
    "velocity_world_mps": ["vx_world_mps", "vy_world_mps"],
    "velocity_covariance": ["cov_xx", "cov_xy", "cov_yy"],
    "probability": ["p_moves"],
    "age": ["age"],
}
PLACE = {
    "cell": ["cell_i", "cell_j"],
    "position_world_m": ["x_world_m", "y_world_m"],
    "position_vehicle_m": ["x_m", "y_m"],
    "velocity_ego_mps": ["vx_ego_mps", "vy_ego_mps"],
}
STATE = ["x", "y", "heading", "speed", "turn"]
TABLES = {
    "columns": PLACE | MOTION | {
        "displacement_m": ["dx_world_m", "dy_world_m"],
        "displacement_covariance": ["cov_dx_dx", "cov_dx_dy", "cov_dy_dy"],
        "basis": ["foreground", "valid"],
        "class_id": ["class"],
    },
    "points": MOTION | {
        "velocity_ego_mps": ["vx_ego_mps", "vy_ego_mps", "vz_ego_mps"],
        "status": ["status"],
        "basis": ["foreground", "valid"],
        "class_id": ["class"],
    },
    "tracklets": PLACE | {
        "velocity_world_mps": MOTION["velocity_world_mps"],
        "probability": ["p_moves"],
        "age": ["age"],
        "heading_rad": ["heading_world_rad"],
        "speed_mps": ["speed_mps"],
        "turn_rate_radps": ["turn_rate_radps"],
        "covariance": [
            f"cov_{a}_{b}"
            for n, a in enumerate(STATE)
            for b in STATE[n:]
        ],
    },
}


def drive(points=lambda xyz: xyz, most=None, **options):
    """Steps through the sweeps; returns the digest and the last step."""
    pipeline = raywake.Pipeline(rig=SWEEPS.rig, **options)
    for n, (stamp, pose, twist, returns) in enumerate(SWEEPS):
        if n == most:
            break
        arrays = {"time": returns["time"], "sensor": returns["sensor"]}
        step = pipeline.step(points(returns["xyz"]), stamp, pose, twist=twist, **arrays)
        digest = pipeline.update_digest()
    return digest, step


class Same(unittest.TestCase):
    def test_digest_of_the_program(self):
        for threads in (1, 2):
            digest, step = drive(threads=threads)
            self.assertEqual(digest, os.environ["RAYWAKE_DIGEST"])
        self.assertGreater(np.count_nonzero(step.points["status"] == raywake.MOVING), 100)

    def test_arrays_of_any_kind(self):
        expected, _ = drive(most=3)
        wide = lambda xyz: np.hstack([xyz, np.ones((len(xyz), 2), "f4")])
        kinds = {
            "double": lambda xyz: xyz.astype("f8"),
            "big-endian": lambda xyz: xyz.astype(">f4"),
            "Fortran": np.asfortranarray,
            "strided": lambda xyz: np.repeat(xyz, 2, axis=0)[::2],
            "backwards": lambda xyz: xyz[::-1].copy()[::-1],
            "wide": wide,
            "part of wide": lambda xyz: wide(xyz)[:, :3],
            "packed": lambda xyz: np.frombuffer(b"x" + xyz.tobytes(), "f4", xyz.size, 1).reshape(
                xyz.shape
            ),
            "list": lambda xyz: [list(row) for row in xyz[:]],
        }
        for name, kind in kinds.items():
            with self.subTest(name):
                self.assertEqual(drive(kind, most=3)[0], expected)

    def test_arrays_are_the_callers_again(self):
        expected, _ = drive(most=3)

        class Made:
            """Makes an array that nobody else keeps."""

            def __init__(self, xyz):
                self.xyz = xyz

            def __array__(self, dtype=None, copy=None):
                return self.xyz.astype(dtype or "f8")

        self.assertEqual(drive(Made, most=3)[0], expected)
        pipeline = raywake.Pipeline(rig=SWEEPS.rig)
        for stamp, pose, twist, returns in list(SWEEPS)[:3]:
            arrays = [returns[name].copy() for name in ("xyz", "time", "sensor")]
            xyz, time, sensor = arrays
            pipeline.step(xyz, stamp, pose, twist=twist, time=time, sensor=sensor)
            [array.fill(7) for array in arrays]
            del arrays, xyz, time, sensor
            gc.collect()
            digest = pipeline.update_digest()
        self.assertEqual(digest, expected)

    def test_records_outlive_all(self):
        pipeline = raywake.Pipeline(rig=SWEEPS.rig)
        kept = []
        for stamp, pose, twist, returns in SWEEPS:
            step = pipeline.step(returns["xyz"].copy(), stamp, pose, twist=twist)
            kept.append((step.points, step.points.copy()))
            if len(kept) == 4:
                break
        columns, tracklets = step.columns, step.tracklets
        self.assertIs(step.columns, columns)
        del step, pipeline, returns
        gc.collect()
        for array, copy in kept:
            self.assertTrue((array == copy).all())
        self.assertEqual(columns.dtype, raywake.COLUMN_DTYPE)
        self.assertEqual(tracklets["covariance"].shape, (len(tracklets), 25))
        view = columns["velocity_world_mps"]
        self.assertTrue(view.shape == (len(columns), 2) and np.shares_memory(view, columns))
        self.assertTrue(0 <= columns["probability"].min() <= columns["probability"].max() <= 1)

    def test_records_of_c(self):
        _, step = drive(objects=True)
        with open(os.environ["RAYWAKE_RECORDS"], "rb") as records:
            for ours in (step.columns, step.points, step.tracklets, step.objects):
                (count,) = struct.unpack("<Q", records.read(8))
                theirs = np.frombuffer(records.read(count * ours.itemsize), ours.dtype)
                self.assertGreater(count, 0)
                for name in ours.dtype.names:
                    self.assertEqual(ours[name].tobytes(), theirs[name].tobytes(), name)
            self.assertEqual(records.read(), b"")

    @unittest.skipIf(feather is None, "pyarrow is missing")
    def test_tables_of_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            for n, (_, _, _, returns) in enumerate(list(SWEEPS)[:8]):
                rows = np.hstack([returns["xyz"], np.zeros((len(returns), 1), "f4")])
                Path(folder, f"{n:06}.bin").write_bytes(rows.tobytes())
            out = Path(folder, "out")
            asked = ["--ground", "-1.7", "--poses", "register", "--backend", "scalar", "--quiet"]
            program = os.environ["RAYWAKE_PROGRAM"]
            subprocess.run([program, "run", folder, "--out", out, *asked], check=True)
            recording = raywake.Recording(folder, ground=-1.7)
            pipeline = raywake.Pipeline(rig=recording.rig, find_poses=True)
            steps = [pipeline.step(sweep) for sweep in recording]
            # Flow is that of the sweep before the last.
            for kind, frame in {"columns": 6, "points": 6, "tracklets": 7}.items():
                table = feather.read_table(out / kind / f"{frame:010}.feather", memory_map=False)
                self.same(getattr(steps[-1], kind), table, TABLES[kind])

    def same(self, records, table, fields):
        self.assertEqual(set(fields), set(records.dtype.names))
        self.assertEqual((len(records) > 0, len(records)), (True, table.num_rows))
        for name, columns in fields.items():
            theirs = np.stack([table[column].to_numpy() for column in columns], -1)
            ours = records[name].reshape(len(records), -1)
            if name == "covariance":
                rows, columns = np.triu_indices(5)
                ours = ours.reshape(-1, 5, 5)[:, rows, columns]
            if name == "basis":
                ours = np.hstack([ours > 0, ours > 1])
            np.testing.assert_array_equal(ours, theirs, name)

    def test_objects(self):
        found = {}
        for asked in (False, True):
            pipeline = raywake.Pipeline(rig=SWEEPS.rig, objects=asked)
            for stamp, pose, twist, returns in list(SWEEPS)[:8]:
                step = pipeline.step(
                    returns["xyz"], stamp, pose, twist=twist, time=returns["time"],
                    sensor=returns["sensor"],
                )
                pipeline.update_digest()
            found[asked] = (step.objects, pipeline.update_digest())
        self.assertEqual(found[False][1], found[True][1])
        self.assertEqual(len(found[False][0]), 0)
        objects = found[True][0]
        self.assertEqual(objects.dtype, raywake.OBJECT_DTYPE)
        moving = objects[objects["moves"] == 1]
        self.assertGreater(len(moving), 0)
        self.assertGreater(np.hypot(*moving["velocity_world_mps"].T).max(), 1)
        self.assertTrue((objects["class_id"] <= 7).any())
        self.assertEqual(len(set(objects["id"])), len(objects))

    def test_flow_without_poses(self):
        (_, pose_a, _, a), (_, pose_b, _, b) = list(SWEEPS)[4:6]
        found = raywake.flow(a["xyz"], b["xyz"])
        self.assertEqual(found.points.dtype, raywake.FLOW_DTYPE)
        self.assertEqual(len(found.points), len(a))
        given = raywake.flow(a["xyz"], b["xyz"], pose=found.pose, ground=found.ground)
        for field in ("flow_m", "status"):
            self.assertTrue((given.points[field] == found.points[field]).all())
        there = np.hypot(*(np.subtract(pose_b[:2], pose_a[:2])))
        self.assertAlmostEqual(np.hypot(*found.pose[:2, 3]), there, delta=0.1)

    def test_poses_are_found(self):
        pipeline = raywake.Pipeline(rig=SWEEPS.rig, find_poses=True)
        found = []
        for stamp, _, _, returns in list(SWEEPS)[:4]:
            step = pipeline.step(returns["xyz"], stamp, time=returns["time"])
            found.append(step.located)
        self.assertEqual(found, ["start", "registered", "registered", "registered"])
        self.assertEqual(step.pose.shape, (4, 4))

    def test_recordings(self):
        with tempfile.TemporaryDirectory() as folder:
            for n, (_, _, _, returns) in enumerate(list(SWEEPS)[:3]):
                rows = np.hstack([returns["xyz"], np.zeros((len(returns), 1), "f4")])
                Path(folder, f"{n:06}.bin").write_bytes(rows.tobytes())
            recording = raywake.Recording(folder, ground=-1.7)
            self.assertEqual((len(recording), recording.located), (3, False))
            self.assertAlmostEqual(recording.rig.ground, -1.7)
            last = recording[-1]
            self.assertIsNone(last.pose)
            with self.assertRaisesRegex(ValueError, "poses must be given"):
                raywake.Pipeline(rig=recording.rig).step(last)
            with self.assertRaisesRegex(TypeError, "a Sweep already has stamp, pose, twist"):
                raywake.Pipeline(rig=recording.rig).step(last, twist=[0.0] * 6)
            self.assertEqual(last.points.tobytes(), returns["xyz"].tobytes())
            self.assertEqual((len(last), last.time.shape), (len(returns), last.intensity.shape))
            self.assertIs(last.points, last.points)
            self.assertFalse(last.points.flags.writeable or last.sensor.flags.writeable)
            pipeline = raywake.Pipeline(rig=recording.rig, find_poses=True)
            self.assertEqual([pipeline.step(s).reset for s in recording], ["first", None, None])
            self.assertEqual(raywake.odometry(folder).shape, (3, 4, 4))
            out = Path(folder, "out")
            self.assertIn("map.ply", raywake.clean(folder, out, "--ground", "-1.7"))
            self.assertEqual(len(list(out.glob("labels/*.label"))), 3)
            with self.assertRaises(IndexError):
                recording[3]


class Refused(unittest.TestCase):
    def setUp(self):
        self.pipeline = raywake.Pipeline(threads=1)
        self.points = np.zeros((5, 3), "f4")

    def refuses(self, error, words, *args, call=None, **named):
        with self.assertRaisesRegex(error, words):
            (call or self.pipeline.step)(*args, **named)

    def test_points(self):
        eye = np.eye(4)
        cases = [
            (ValueError, "N x 3", np.zeros(3)),
            (ValueError, "N x 3", np.zeros((2, 3, 3))),
            (ValueError, "N x 3", 5.0),
            (ValueError, "3 numbers", np.zeros((2, 2))),
            (TypeError, "real numbers", np.zeros((2, 3), complex)),
            (TypeError, "real numbers", np.zeros((2, 3), object)),
            (TypeError, "real numbers", np.zeros((2, 3), bool)),
            (TypeError, "real numbers", [["a", "b", "c"]]),
            (TypeError, "real numbers", None),
            (TypeError, "masked", np.ma.zeros((2, 3))),
            (ValueError, "at most", np.broadcast_to(np.float32(0), (1 << 36, 3))),
            (ValueError, "at most", np.broadcast_to(np.float32(0), (1 << 59, 3))),
            (ValueError, "inhomogeneous|sequence", [[1, 2, 3], [4]]),
        ]
        for error, words, points in cases:
            with self.subTest(words=words, points=points):
                self.refuses(error, words, points, 0.0, eye)

    def test_what_comes_with_points(self):
        eye = np.eye(4)
        self.refuses(TypeError, "stamp", self.points)
        self.refuses(TypeError, "pose: expected real", self.points, 0.0, eye + 0j)
        self.refuses(ValueError, "given with every", self.points, 0.0)
        self.refuses(ValueError, "finite", self.points, np.nan, eye)
        self.refuses(ValueError, "possible", self.points, 1e300, eye)
        self.refuses(ValueError, "not finite", self.points, 0.0, np.full((4, 4), np.nan))
        self.refuses(ValueError, "rotation", self.points, 0.0, 2 * np.diag([1, 1, 1, 0.5]))
        self.refuses(ValueError, "matrix", self.points, 0.0, np.eye(3))
        self.refuses(ValueError, "matrix", self.points, 0.0, np.ones((4, 4)))
        self.refuses(ValueError, "unit", self.points, 0.0, np.ones(7))
        self.refuses(ValueError, "vx", self.points, 0.0, eye, twist=[1, 2])
        self.refuses(ValueError, "one number", self.points, 0.0, eye, time=np.zeros(4))
        self.refuses(ValueError, "one number", self.points, 0.0, eye, sensor=np.zeros((5, 1)))
        self.refuses(TypeError, "real", self.points, 0.0, eye, time=["x"] * 5)
        # None of them was accepted.
        self.assertEqual(self.pipeline.step(self.points, 0.0, eye).reset, "first")

    def test_what_is_counted(self):
        points = np.full((6, 3), 5.0)
        points[0, 1], points[1, 2], points[2] = np.nan, 1e300, 0
        step = self.pipeline.step(points, 0.0, np.eye(4), sensor=[0, 0, 0, 1, -1, np.nan])
        dropped = step.dropped
        self.assertEqual((dropped["not_finite"], dropped["no_return"]), (2, 1))
        self.assertEqual(dropped["unknown_sensor"], 3)
        self.assertEqual((len(step.points), step.dt), (0, None))
        empty = self.pipeline.step(np.zeros((0, 3)), 0.1, np.eye(4))
        self.assertEqual((len(empty.points), empty.dt), (6, 0.1))

    def test_options(self):
        make = raywake.Pipeline
        self.refuses(ValueError, "no profile", "hdl65", call=make)
        self.refuses(ValueError, "no parameter", settings={"sied": 3}, call=make)
        self.refuses(ValueError, "whole number", settings={"side": 1.5}, call=make)
        self.refuses(ValueError, "odd", settings={"side": 100}, call=make)
        self.refuses(ValueError, "weights", settings={"levels": 12}, call=make)
        self.refuses(MemoryError, "bytes", points_max=1 << 48, call=make)
        self.refuses(MemoryError, "bytes", points_max=1 << 62, call=make)
        self.refuses(ValueError, "timing", timing="x", call=raywake.Rig)
        self.refuses(ValueError, "at most 8", [np.eye(4)] * 9, call=raywake.Rig)
        self.refuses(ValueError, "rig", rig=raywake.Rig([]), call=make)
        self.refuses(ValueError, "rig", rig=raywake.Rig(ground=np.inf), call=make)
        lower = raywake.Pipeline(settings={"moves_min": 0.1, "tracklet.gate_d2": 9.0})
        self.assertGreater(lower.memory, 1 << 20)
        few = raywake.Pipeline(points_max=4)
        self.refuses(ValueError, "4 returns", self.points, 0.0, np.eye(4), call=few.step)

    def test_a_step_that_is_past(self):
        first = self.pipeline.step(self.points, 0.0, np.eye(4))
        self.pipeline.step(self.points, 0.1, np.eye(4))
        self.refuses(RuntimeError, "gone on", call=lambda: first.points)

    def test_two_threads(self):
        points = np.random.default_rng(1).normal(0, 10, (100_000, 3))
        errors, done = [], threading.Event()

        def steps():
            for n in range(20):
                try:
                    self.pipeline.step(points, float(n), np.eye(4))
                except RuntimeError as e:
                    errors.append(str(e))
                except ValueError as e:
                    errors.append(str(e))
            done.set()

        threads = [threading.Thread(target=steps) for _ in range(2)]
        [t.start() for t in threads]
        [t.join() for t in threads]
        self.assertTrue(done.is_set())
        self.assertTrue(errors and all("another thread" in e for e in errors), errors)

    def test_reading_during_a_step(self):
        points = np.random.default_rng(1).normal(0, 10, (100_000, 3))
        past = self.pipeline.step(points, 0.0, np.eye(4))
        calls = [
            lambda: self.pipeline.memory,
            lambda: self.pipeline.threads,
            lambda: self.pipeline.update_digest(),
            lambda: past.columns,
        ]
        for call in calls:
            refused = None
            # A call may come before or after the step.
            for _ in range(50):
                if refused is not None:
                    break
                thread = threading.Thread(
                    target=self.pipeline.step, args=(points, 0.0, np.eye(4))
                )
                thread.start()
                while thread.is_alive() and refused is None:
                    try:
                        call()
                    except RuntimeError as e:
                        refused = str(e) if "gone on" not in str(e) else None
                thread.join()
            self.assertIn("another thread", refused or "nothing was refused")

    def test_clouds_and_recordings(self):
        noise = np.random.default_rng(2).normal(0, 10, (2, 5000, 3))
        self.refuses(ValueError, "registered|ground", *noise, call=raywake.flow)
        self.refuses(ValueError, "dt", *noise, dt=0, call=raywake.flow)
        self.refuses(OSError, "No such file", "/nonexistent", call=raywake.Recording)
        # The decoder panics on it.
        corpus = Path(__file__).parents[2] / "io/fuzz/corpus/recording"
        bundle = (corpus / "mcap/record-longer-than-chunk").read_bytes()
        with tempfile.TemporaryDirectory() as folder:
            damaged = Path(folder) / "a.mcap"
            damaged.write_bytes(bundle.partition(b"%%% a.mcap\n")[2])
            self.refuses(OSError, "damaged", damaged, call=raywake.Recording)
        with self.assertRaises(raywake.CommandError) as caught:
            raywake.clean("/nonexistent", "/nonexistent")
        self.assertEqual(caught.exception.code, 3)


class Package(unittest.TestCase):
    def test_stubs_name_what_is_there(self):
        module = raywake._raywake
        tree = ast.parse(Path(module.__file__).with_name("_raywake.pyi").read_text())
        named = {n.name for n in tree.body if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
        named |= {n.target.id for n in tree.body if isinstance(n, ast.AnnAssign)}
        there = {n for n in vars(module) if not n.startswith("__") or n == "__version__"}
        self.assertEqual(named, there)
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                members = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
                members |= {n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}
                real = {n for n in vars(getattr(module, node.name)) if not n.startswith("__")}
                self.assertEqual({m for m in members if not m.startswith("__")}, real, node.name)

    def test_everything_says_what_it_is(self):
        for name in raywake.__all__:
            self.assertTrue(getattr(raywake, name).__doc__, name)

    def test_program(self):
        for call in ([sys.executable, "-m", "raywake"], [Path(sys.executable).with_name("raywake")]):
            said = subprocess.run([*call, "--version"], capture_output=True, text=True, check=True)
            self.assertEqual(said.stdout.strip(), f"raywake {raywake.__version__}")


def load(path):
    """Returns the module in a file, a path from the root of the source."""
    path = Path(__file__).parents[3] / path
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def stand_in(**names):
    """Returns a module with these names."""
    module = types.ModuleType("stand_in")
    vars(module).update(names)
    return module


class Message(types.SimpleNamespace):
    """A message: whatever it is not given is a message."""

    CUBE, UINT8, FLOAT32 = 1, 2, 7

    def __getattr__(self, name):
        setattr(self, name, Message())
        return getattr(self, name)


class RosNode:
    """What the example uses of rclpy's node."""

    def __init__(self, name):
        self.published, self.warnings = [], []

    def declare_parameter(self, name, default):
        value = SWEEPS.rig.ground if name == "ground" else default
        return types.SimpleNamespace(value=value)

    def create_publisher(self, kind, topic, depth):
        publish = lambda message: self.published.append((topic, message))
        return types.SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, callback, qos):
        self.callback = callback

    def get_logger(self):
        return types.SimpleNamespace(warning=self.warnings.append)


class Node(unittest.TestCase):
    """How the example for ROS 2 handles messages."""

    def setUp(self):
        self.node = load("host/python/examples/ros2_node.py")

    def cloud(self, returns, order="<", stamp_ns=0):
        """A cloud of two rows, with padding after each point and each row."""
        row = np.dtype(
            {
                "names": ["x", "y", "z", "t"],
                "formats": [order + "f4"] * 3 + [order + "u4"],
                "offsets": [0, 4, 8, 20],
                "itemsize": 26,
            }
        )
        points = np.zeros(len(returns) // 2 * 2, row)
        for n, axis in enumerate("xyz"):
            points[axis] = returns["xyz"][: len(points), n]
        points["t"] = (returns["time"][: len(points)] * 1e9 + 1e8).astype("u4")
        rows = points.reshape(2, -1).view(np.uint8).reshape(2, -1)
        data = np.pad(rows, ((0, 0), (0, 5)))
        field = lambda name, n, type: types.SimpleNamespace(
            name=name, offset=n, datatype=type, count=1
        )
        return types.SimpleNamespace(
            fields=[field("x", 0, 7), field("y", 4, 7), field("z", 8, 7), field("t", 20, 6)],
            is_bigendian=order == ">",
            point_step=26,
            height=2,
            width=len(points) // 2,
            row_step=data.shape[1],
            data=data.tobytes(),
        )

    def test_clouds_of_messages(self):
        returns = next(iter(SWEEPS))[3]
        for order in "<>":
            points = self.node.as_array(self.cloud(returns, order))
            places = self.node.positions_of(points)
            self.assertTrue((places == returns["xyz"][: len(places)]).all())
            times = self.node.times_of(points, 0.0)
            self.assertLess(np.abs(times - returns["time"][: len(times)] - 0.1).max(), 1e-6)

    def test_velocities_of_messages(self):
        flow = self.node.Flow(ground=SWEEPS.rig.ground, find_poses=True, timed=False)
        found = []
        for stamp, _, _, returns in list(SWEEPS)[:8]:
            found.append(flow.step(self.node.as_array(self.cloud(returns)), stamp))
        self.assertIsNone(found[0])
        self.assertEqual([points.dtype for points, _ in found[1:]], [self.node.OUT] * 7)
        points = found[2][0]
        p_moves, moving = points["p_moves"], points["status"] == raywake.MOVING
        standing = points["status"] == raywake.STATIC
        self.assertGreater(p_moves[moving].min(), p_moves[standing].mean())
        points, boxes = found[-1]
        self.assertGreater(sum(box["moves"] for box in boxes), 0)
        places = self.node.positions_of(points)
        for box in boxes:
            # In the frame of the cloud: the object's own returns lie there.
            near = np.linalg.norm(places[:, :2] - box["place"][:2], axis=1) < 3
            self.assertTrue(near.any(), box)

    def test_whole_node(self):
        nodes = []
        ros = {
            "rclpy": stand_in(init=lambda: None, spin=nodes.append),
            "rclpy.node": stand_in(Node=RosNode),
            "rclpy.qos": stand_in(qos_profile_sensor_data=None),
            "rclpy.time": stand_in(Time=None),
            "sensor_msgs": stand_in(),
            "sensor_msgs.msg": stand_in(PointCloud2=Message, PointField=Message),
            "tf2_ros": stand_in(
                Buffer=Message, TransformException=KeyError, TransformListener=lambda *_: None
            ),
            "visualization_msgs": stand_in(),
            "visualization_msgs.msg": stand_in(Marker=Message, MarkerArray=Message),
        }
        with unittest.mock.patch.dict(sys.modules, ros):
            self.node.main()
        (node,) = nodes
        for stamp, _, _, returns in list(SWEEPS)[:8]:
            cloud = self.cloud(returns)
            seconds = int(stamp)
            at = types.SimpleNamespace(sec=seconds, nanosec=round((stamp - seconds) * 1e9))
            cloud.header = types.SimpleNamespace(stamp=at, frame_id="lidar")
            node.callback(cloud)
        # A cloud that is refused is skipped.
        cloud.header.stamp.sec = 10**300
        node.callback(cloud)
        self.assertEqual(len(node.warnings), 1, node.warnings)
        clouds = [message for topic, message in node.published if topic == "points_with_velocity"]
        arrays = [message for topic, message in node.published if topic == "objects"]
        self.assertEqual((len(clouds), len(arrays)), (7, 7))
        points = self.node.as_array(Message(**vars(clouds[-1]), is_bigendian=False))
        self.assertEqual(points.dtype, self.node.OUT)
        self.assertTrue(arrays[-1].markers)
        for marker in arrays[-1].markers:
            turn = marker.pose.orientation
            self.assertAlmostEqual(turn.z**2 + turn.w**2, 1)


class Labels(unittest.TestCase):
    def test_ray(self):
        """The example for Ray, on one machine: a recording, and one that does not exist."""

        class Failed(Exception):
            def __init__(self, cause):
                self.cause = cause

        def remote(**resources):
            return lambda label: types.SimpleNamespace(remote=lambda path: (label, path))

        def get(task):
            try:
                return task[0](task[1])
            except Exception as e:
                raise Failed(e)

        ray = stand_in(
            remote=remote,
            wait=lambda waiting: (waiting[:1], waiting[1:]),
            get=get,
            exceptions=types.SimpleNamespace(RayTaskError=Failed),
        )
        with unittest.mock.patch.dict(sys.modules, {"ray": ray}):
            example = load("examples/cluster/ray_label.py")
        with tempfile.TemporaryDirectory() as folder:
            clouds = Path(folder, "clouds")
            clouds.mkdir()
            for n, (_, _, _, returns) in enumerate(list(SWEEPS)[:3]):
                rows = np.hstack([returns["xyz"], np.zeros((len(returns), 1), "f4")])
                Path(clouds, f"{n:06}.bin").write_bytes(rows.tobytes())
            listed, out = Path(folder, "list"), Path(folder, "labels.csv")
            listed.write_text(f"# two\n{clouds}\n/nonexistent\n")
            with self.assertRaisesRegex(SystemExit, "1 of 2 recordings failed"):
                example.main(listed, out)
            header, *rows = out.read_text().splitlines()
            self.assertEqual(header, "recording,stamp_s,returns,moving,fastest_mps")
            recording, expected = raywake.Recording(clouds), []
            pipeline = raywake.Pipeline(rig=recording.rig, find_poses=True)
            for sweep in recording:
                step = pipeline.step(sweep)
                if step.dt is not None:
                    moving = np.count_nonzero(step.points["status"] == raywake.MOVING)
                    expected.append([str(clouds), str(len(step.points)), str(moving)])
            fields = [row.split(",") for row in rows]
            self.assertEqual([[f[0], *f[2:4]] for f in fields], expected)


if __name__ == "__main__":
    unittest.main()
