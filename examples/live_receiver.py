#!/usr/bin/env python3
"""Prints what `raywake live --send 127.0.0.1:9000` sends.

A datagram, little-endian, consists of a header and records of one kind. The header: `RWF2`, the
kind (u16), the number of records that follow, the number of this datagram and how many there are of
its kind (u16 each), the sweep's number (u32) and its stamp (u64, ns since 1970). Positions, in m,
and velocities over ground, in m/s, are along the vehicle's axes at that sweep. Kinds:

0 sweep, sent after the rest of it: x, y, z and quaternion x, y, z, w of the vehicle in the world
  (f64); time since the previous sweep, s, and latency from the last packet, ms (f32); sweeps
  dropped so far (u64); numbers of columns, tracklets and objects sent, and 0 (u32); stamp of the
  previous sweep, ns (u64)
1 moving column in the previous sweep: x, y, velocity x, y, covariance xx, xy, yy, P(moves) (f32)
2 moving tracklet: x, y, velocity x, y, turn rate, rad/s (f32); observations (u32); standard
  deviation of the speed, P(moves) (f32)
3 object in the previous sweep, with `--objects`: number, observations, class (u32: 4 car, 5 large
  vehicle, 6 person, 7 two-wheeler, others static, 255 unknown); its share of the returns, P(moves)
  (NaN: unknown), time since the stamp when last seen, x, y, z of its centre, heading, length,
  width, height, velocity x, y, turn rate, covariance xx, xy, yy of its position, variances of
  heading and speed (f32)
"""

import socket
import struct
import sys

HEAD = struct.Struct("<4s4HIQ")
RECORDS = {
    0: struct.Struct("<7d2fQ4IQ"),
    1: struct.Struct("<8f"),
    2: struct.Struct("<5fI2f"),
    3: struct.Struct("<3I18f"),
}


CLASSES = {4: "car", 5: "large vehicle", 6: "person", 7: "two-wheeler"}


def main(port: int) -> None:
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", port))
    fastest = 0.0
    while True:
        datagram = receiver.recv(2048)
        magic, kind, count, _part, _parts, sweep, _stamp = HEAD.unpack_from(datagram)
        assert magic == b"RWF2", magic
        record = RECORDS[kind]
        assert len(datagram) == HEAD.size + count * record.size
        for values in record.iter_unpack(datagram[HEAD.size :]):
            if kind == 3:
                number, _, kind_of_object = values[:3]
                x, y = values[6:8]
                u, v = values[13:15]
                if (u, v) != (0.0, 0.0):
                    name = CLASSES.get(kind_of_object, "object")
                    print(f"  {name} {number} at ({x:.1f}, {y:.1f}) m: ({u:.1f}, {v:.1f}) m/s")
            elif kind == 2:
                fastest = max(fastest, (values[2] ** 2 + values[3] ** 2) ** 0.5)
            elif kind == 0:
                latency, left_out, columns, tracklets = values[8:12]
                print(
                    f"sweep {sweep}: {columns} columns and {tracklets} tracklets move, up to "
                    f"{fastest:.1f} m/s; {latency:.1f} ms, {left_out} left out",
                    flush=True,
                )
                fastest = 0.0


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 9000)
