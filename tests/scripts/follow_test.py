"""examples/follow.py moves the simulated arm in a circle. Argument: folder of the programs.

Runs in the Python of tools/python_environment, which has the package lcm; skipped where that was not made.
"""
import importlib.util
import math
import pathlib
import sys
import tempfile
import time
import unittest

from running_arm import PATIENCE_S, PYTHON, ROOT, go_on_in_our_python, own_url, skip_without_multicast, start, write_config

EXAMPLE = ROOT / "examples/follow.py"

skip_without_multicast()
go_on_in_our_python()

import lcm  # noqa: E402
from softarm_messages import plant_state_t  # noqa: E402

PROGRAMS = pathlib.Path(sys.argv.pop(1))
BEND_RAD = 0.3


class Follow(unittest.TestCase):
    def test_the_arm_really_goes_round(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        folder = pathlib.Path(temporary.name)
        url = own_url()
        config = write_config(folder, "one_segment_live.yaml", url)
        bends = []
        node = lcm.LCM(url)

        def take_plant(_channel, data):
            bends.append(plant_state_t.decode(data).u_rad[0])

        node.subscribe("SOFTARM_PLANT", take_plant)
        start(self, folder, PROGRAMS / "softarm-plant", config)
        start(self, folder, PROGRAMS / "softarmd", config)
        example = start(self, folder, PYTHON, "-B", EXAMPLE, "--url", url, "--duration", "6", "--rate", "2",
                        "--bend", str(BEND_RAD))
        end = time.monotonic() + PATIENCE_S
        while example.poll() is None and time.monotonic() < end:
            node.handle_timeout(100)
        self.assertEqual(example.poll(), 0, (folder / "python.txt").read_text(encoding="utf-8"))
        bent = [u for u in bends if abs(math.hypot(*u) - BEND_RAD) < 0.1 * BEND_RAD]
        self.assertEqual({(x > 0, y > 0) for x, y in bent}, {(a, b) for a in (False, True) for b in (False, True)})
        self.assertLess(max(math.hypot(*u) for u in bends), 1.1 * BEND_RAD)

    def test_the_derivatives_it_sends_are_those_of_what_it_sends(self):
        spec = importlib.util.spec_from_file_location("follow", EXAMPLE)
        follow = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(follow)
        h = 1e-4
        for t in (0.3, 1.1, 4.9, 8.3, 9.6):
            before, here, after = (follow.circle(t + d, 10.0, 0.4, 1.7) for d in (-h, 0.0, h))
            for axis in (0, 1):
                for derivative in (0, 1):
                    slope = (after[derivative][axis] - before[derivative][axis]) / (2 * h)
                    self.assertAlmostEqual(here[derivative + 1][axis], slope, delta=1e-6)


if __name__ == "__main__":
    unittest.main()
