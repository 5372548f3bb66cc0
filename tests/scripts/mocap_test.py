"""The daemon follows frames that an independent client publishes: the Python package lcm. Argument: folder of the programs.

Runs in the Python of tools/python_environment; skipped where that was not made.
"""
import os
import pathlib
import struct
import sys
import tempfile
import unittest

from running_arm import PYTHON, ROOT, go_on_in_our_python, main_at_once, own_url, skip_without_multicast, start, tracks_within, write_config

EXAMPLE = ROOT / "examples/republish.py"

skip_without_multicast()
go_on_in_our_python()

import lcm  # noqa: E402
from softarm_messages import controller_status_t, optitrack_frame_t  # noqa: E402

PROGRAMS = pathlib.Path(sys.argv.pop(1))
# It is 1.4 mrad with the frames of config/paper_arm.yaml; 4 mm between marker frame and axis unknown to the daemon are more than this.
BOUND_RAD = 0.01


class Mocap(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.url = own_url()

    def config(self, base, more=""):
        return write_config(self.folder, f"{base}.yaml", self.url, more)

    def closes(self, config, source):
        start(self, self.folder, PYTHON, "-B", EXAMPLE, "--url", self.url, "--source", source)
        start(self, self.folder, PROGRAMS / "softarmd", config)
        tracks_within(self, PROGRAMS, config, BOUND_RAD)

    def test_the_loop_closes_through_optitrack_frames_and_modbus(self):
        port = str(20000 + os.getpid() % 12000)
        valves = f"valves: {{port: {port}}}\n"
        every = self.config("paper_arm_every_interface", valves)
        # A machine that is busy with other things must not look like a faulty terminal.
        config = every.parent / "patient.yaml"
        config.write_text(f"include: {every}\nname: patient\nvalves: {{tolerated_failures: 100, failsafe_timeout_s: 0.5}}\n"
                          "daemon: {safety: {pressure_tolerance_bar: 0, valve_silence_s: 2}}\n", encoding="utf-8")
        start(self, self.folder, PROGRAMS / "softarm-plant", "--modbus", port, self.config("paper_arm_modbus", valves))
        start(self, self.folder, PROGRAMS / "softarm-valves", config)
        self.closes(config, "optitrack")

    def test_the_loop_closes_through_rigid_transforms_of_single_bodies(self):
        start(self, self.folder, PROGRAMS / "softarm-plant", self.config("paper_arm"))
        self.closes(self.config("paper_arm_vicon"), "rigid_transform")

    def test_the_simulated_arm_speaks_optitrack_and_hostile_lengths_hurt_nobody(self):
        config = self.config("paper_arm_optitrack")
        node, frames, malformed = lcm.LCM(self.url), [], []
        node.subscribe("OPTITRACK_FRAMES", lambda _channel, data: frames.append(data))
        node.subscribe("SOFTARM_STATUS",
                       lambda _channel, data: malformed.append(controller_status_t.decode(data).messages_malformed))
        start(self, self.folder, PROGRAMS / "softarm-plant", config)
        while not frames:
            self.assertGreater(node.handle_timeout(20000), 0, "no frame")
        whole = frames[0]
        frame = optitrack_frame_t.decode(whole)
        self.assertEqual([body.id for body in frame.rigid_bodies], [100, 101, 102, 103])
        self.assertTrue(all(body.params & 1 for body in frame.rigid_bodies))
        self.assertAlmostEqual(frame.rigid_bodies[3].xyz[1], -0.33, delta=0.02)  # y is up there, and the arm hangs
        daemon = start(self, self.folder, PROGRAMS / "softarmd", config)
        while not malformed:
            self.assertGreater(node.handle_timeout(20000), 0, "no status")
        sent = 0
        for at in range(20, 32, 4):  # the counts that come first: marker sets, markers of none, rigid bodies
            for length in (-1, -2 ** 31, 2 ** 28, 2 ** 31 - 1, 1000):
                node.publish("OPTITRACK_FRAMES", whole[:at] + struct.pack(">i", length) + whole[at + 4:])
                sent += 1
        while malformed[-1] < sent:
            self.assertGreater(node.handle_timeout(20000), 0, "no status any more")
        self.assertEqual(malformed[-1], sent)
        self.assertIsNone(daemon.poll())
        tracks_within(self, PROGRAMS, config, BOUND_RAD)


if __name__ == "__main__":
    main_at_once()
