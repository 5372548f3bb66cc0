#!/usr/bin/env python3
"""Publishes our motion-capture frames again as the messages of a driver of OptiTrack or Vicon.

Sends optitrack_frame_t (y up, x y z w, marker frames beside the axis) as config/paper_arm_optitrack.yaml describes it, or
rigid_transform_t as config/paper_arm_vicon.yaml does. Needs the Python of tools/python_environment.
"""
import argparse
import math
import sys
import time

import lcm
from softarm_messages import mocap_frame_t, optitrack_frame_t, optitrack_rigid_body_t, rigid_transform_t

# The frame S_i on every body: position in m, and angle in rad about an axis. As in config/paper_arm_optitrack.yaml.
MARKER_FRAMES = (((0.008, 0, 0), 0, (0, 0, 1)), ((0.008, 0, 0), 0, (0, 0, 1)), ((0.008, 0, 0), math.pi / 2, (0, 0, 1)),
          ((0, -0.008, 0), 0.02, (1, 0, 0)))
FIRST_ID = 100
NAMES = ("base", "segment_1", "segment_2", "segment_3")
Y_UP = ((1, 0, 0), (0, 0, 1), (0, -1, 0))  # our x, y, z are their x, z, -y


def product(a, b):
    """Of two matrices of rows."""
    return tuple(tuple(sum(x * y for x, y in zip(row, column)) for column in zip(*b)) for row in a)


def apply(a, v):
    return tuple(sum(x * y for x, y in zip(row, v)) for row in a)


def transposed(a):
    return tuple(zip(*a))


def about(axis, angle):
    """Rotation about a unit vector."""
    x, y, z = axis
    c, s, d = math.cos(angle), math.sin(angle), 1 - math.cos(angle)
    return ((c + x * x * d, x * y * d - z * s, x * z * d + y * s), (y * x * d + z * s, c + y * y * d, y * z * d - x * s),
            (z * x * d - y * s, z * y * d + x * s, c + z * z * d))


def matrix(w, x, y, z):
    """Of a unit quaternion."""
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))


def quaternion(r):
    """w, x, y, z of a rotation, by its largest component."""
    trace = r[0][0] + r[1][1] + r[2][2]
    squares = (1 + trace, 1 + 2 * r[0][0] - trace, 1 + 2 * r[1][1] - trace, 1 + 2 * r[2][2] - trace)
    k = max(range(4), key=lambda i: squares[i])
    rows = ((squares[0], r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]),
            (r[2][1] - r[1][2], squares[1], r[0][1] + r[1][0], r[0][2] + r[2][0]),
            (r[0][2] - r[2][0], r[0][1] + r[1][0], squares[2], r[1][2] + r[2][1]),
            (r[1][0] - r[0][1], r[0][2] + r[2][0], r[1][2] + r[2][1], squares[3]))
    scale = 0.5 / math.sqrt(squares[k])
    return tuple(scale * x for x in rows[k])


def body_pose(body, marker_frame, world):
    """Pose of the tracked body in the other system's world, from that of S_i in ours: position, (w, x, y, z)."""
    offset, angle, axis = marker_frame
    rotation = product(matrix(*body.orientation), transposed(about(axis, angle)))
    position = tuple(p - d for p, d in zip(body.position_m, apply(rotation, offset)))
    return apply(world, position), quaternion(product(world, rotation))


def optitrack_frame(frame):
    out = optitrack_frame_t()
    out.utime = time.time_ns() // 1000
    out.frame = frame.frame_number
    out.timestamp = 1e-6 * frame.capture_time_us
    for body, marker_frame in zip(frame.bodies, MARKER_FRAMES):
        rigid = optitrack_rigid_body_t()
        rigid.id = FIRST_ID + body.id
        rigid.xyz, (w, x, y, z) = body_pose(body, marker_frame, Y_UP)
        rigid.quat = (x, y, z, w)
        rigid.params = 1 if body.valid else 0
        out.rigid_bodies.append(rigid)
    out.num_rigid_bodies = len(out.rigid_bodies)
    return out


def publish_vicon(node, frame):
    for body, name in zip(frame.bodies, NAMES):
        if not body.valid:
            continue
        out = rigid_transform_t()
        out.utime = frame.capture_time_us
        out.trans, out.quat = body.position_m, body.orientation
        node.publish(f"VICON_{name}", out.encode())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--url", default=None, help="LCM provider (default: $LCM_DEFAULT_URL, else LCM's own)")
    parser.add_argument("--source", choices=("optitrack", "rigid_transform"), default="optitrack", help="whose messages")
    parser.add_argument("--from", dest="channel", default="SOFTARM_MOCAP", help="channel of our frames (default SOFTARM_MOCAP)")
    options = parser.parse_args()
    node = lcm.LCM(options.url) if options.url else lcm.LCM()

    def take(_channel, data):
        frame = mocap_frame_t.decode(data)
        if options.source == "optitrack":
            node.publish("OPTITRACK_FRAMES", optitrack_frame(frame).encode())
        else:
            publish_vicon(node, frame)

    node.subscribe(options.channel, take)
    print(f"{options.channel} -> {options.source}", flush=True)
    try:
        while True:
            node.handle()
    except KeyboardInterrupt:
        return 0


if __name__ == "__main__":
    sys.exit(main())
