#!/usr/bin/env python3
"""Moves the end of the first segment in a slow circle, by references sent over LCM, and prints how well it follows.

Needs a softarmd whose reference is `live` (config/one_segment_live.yaml), and the Python of tools/python_environment.
"""
import argparse
import math
import sys
import time

import lcm
from softarm_messages import controller_status_t, curvature_reference_t

MODES = ("INIT", "WAIT_FRAMES", "ACTIVE", "HOLD", "VENT", "FAULT")
ACTIVE = MODES.index("ACTIVE")
RATE_HZ = 100.0
RISE_S = 2.0  # enter and leave the circle slowly: a reference that jumps is refused


def ramp(t):
    """From 0 to 1 within RISE_S, with its first two derivatives; at rest at both ends."""
    s = min(max(t / RISE_S, 0.0), 1.0)
    return (s ** 3 * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) ** 2 / RISE_S,
            60 * s * (1 - s) * (1 - 2 * s) / RISE_S ** 2)


def circle(t, duration, bend_rad, rate_radps):
    """u = theta (cos phi, sin phi) of a segment with bend theta and phi = rate t, with two derivatives."""
    rising = t < duration / 2
    r, dr, ddr = (bend_rad * x for x in ramp(t if rising else duration - t))
    dr = dr if rising else -dr
    w, c, s = rate_radps, math.cos(rate_radps * t), math.sin(rate_radps * t)
    return ((r * c, r * s), (dr * c - r * w * s, dr * s + r * w * c),
            ((ddr - r * w * w) * c - 2 * dr * w * s, (ddr - r * w * w) * s + 2 * dr * w * c))


class Follower:
    def __init__(self, node, channels):
        self.node = node
        self.reference_channel = channels.reference
        self.status = None
        self.statuses = 0
        self.squares = []
        self.sequence = time.time_ns()  # also counts up from one run to the next
        node.subscribe(channels.status, self.take_status)

    def take_status(self, _channel, data):
        self.status = controller_status_t.decode(data)
        self.statuses += 1
        if self.status.mode == ACTIVE:
            # The reference that the daemon followed in this tick, and what the cameras saw.
            self.squares += [(a - b) ** 2 for a, b in zip(self.status.u_rad[0], self.status.reference_u_rad[0])]

    def handle_until(self, end):
        while (left := end - time.monotonic()) > 0:
            self.node.handle_timeout(max(1, int(1000 * left)))

    def wait_for_active(self, patience_s):
        end = time.monotonic() + patience_s
        while time.monotonic() < end and not (self.status and self.status.mode == ACTIVE):
            self.handle_until(time.monotonic() + 0.05)
        return bool(self.status) and self.status.mode == ACTIVE

    def send(self, parts):
        segments = self.status.num_segments
        message = curvature_reference_t()
        self.sequence += 1
        message.sequence = self.sequence
        message.dimension = 2 * segments
        straight = [0.0] * (2 * segments - 2)  # all segments after the first
        message.u_rad, message.velocity_radps, message.acceleration_radps2 = (list(part) + straight for part in parts)
        self.node.publish(self.reference_channel, message.encode())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--url", default=None, help="LCM provider (default: $LCM_DEFAULT_URL, else LCM's own)")
    parser.add_argument("--duration", type=float, default=20.0, help="s, rise and fall included (default 20)")
    parser.add_argument("--bend", type=float, default=0.3, help="theta in rad (default 0.3)")
    parser.add_argument("--rate", type=float, default=1.0, help="of the circle in rad/s (default 1)")
    parser.add_argument("--reference", default="SOFTARM_REFERENCE", help="channel of references")
    parser.add_argument("--status", default="SOFTARM_STATUS", help="channel of the daemon's status")
    options = parser.parse_args()
    if options.duration < 2 * RISE_S:
        parser.error(f"--duration: at least {2 * RISE_S:g} s")

    follower = Follower(lcm.LCM(options.url) if options.url else lcm.LCM(), options)
    if not follower.wait_for_active(10.0):
        what = MODES[follower.status.mode] if follower.status else f"no status on {options.status}: is softarmd running?"
        print(f"not ACTIVE within 10 s: {what}", file=sys.stderr)
        return 1
    start = time.monotonic()
    follower.squares.clear()
    printed_s = 0.0
    for tick in range(int(options.duration * RATE_HZ) + 1):
        t = tick / RATE_HZ
        follower.handle_until(start + t)
        follower.send(circle(t, options.duration, options.bend, options.rate))
        if t - printed_s >= 1.0:
            printed_s = t
            print(f"{t:5.1f} s  {MODES[follower.status.mode]:<11} theta {follower.status.theta_rad[0]:.3f} rad  "
                  f"phi {follower.status.phi_rad[0]:+.3f} rad  frame age {1e3 * follower.status.frame_age_s:.1f} ms", flush=True)
    if not follower.squares:
        print("was never ACTIVE", file=sys.stderr)
        return 1
    rms = math.sqrt(sum(follower.squares) / len(follower.squares))
    print(f"reference minus estimate of u, rms: {1e3 * rms:.2f} mrad over {follower.statuses} statuses")
    return 0


if __name__ == "__main__":
    sys.exit(main())
