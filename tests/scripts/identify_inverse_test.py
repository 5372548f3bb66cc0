#!/usr/bin/python3
"""What softarm identify finds of config/real_arm.yaml and writes: an experiment whose inverse of the actuators tracks
better than the same columns without it. usage: identify_inverse_test.py SOFTARM"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop()
CONFIG = pathlib.Path(__file__).resolve().parents[2] / "config" / "real_arm.yaml"


class IdentifyInverse(unittest.TestCase):
    def softarm(self, *arguments):
        run = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        return run.stdout

    def error_mrad(self, config):
        out = self.softarm("run", config, "--duration", "40", "--seed", "1", "--no-plots", "--out", self.folder / "run")
        return float(re.search(r"^ +all +([\d.]+)", out, re.MULTILINE)[1])

    def test_what_is_written_inverts_what_was_identified(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="softarm_inverse_"))
        self.addCleanup(shutil.rmtree, self.folder)
        found = self.folder / "found.yaml"
        self.softarm("identify", CONFIG, "--directions", "--venting", "--no-stiffness", "--no-inertia", "--no-delay",
                     "--hold", "5", "--output", found)
        text = found.read_text(encoding="utf-8")
        fill_s, vent_s = (float(re.search(rf"  inverse:(?:\n    .*)*?\n    {key}_lag_s: \[([\d.]+)", text)[1])
                          for key in ("fill", "vent"))
        self.assertAlmostEqual(fill_s, 0.6, delta=0.2)
        self.assertAlmostEqual(vent_s, 1.5, delta=0.4)
        # The same columns with the one lag that a user would write.
        without = self.folder / "without.yaml"
        shorter = re.sub(r"\n  inverse:(\n    .*)+", "", text)
        without.write_text(re.sub(r"valve_lag_s: [\d.]+", "valve_lag_s: 0.8", shorter), encoding="utf-8")
        self.assertLess(self.error_mrad(found), 0.8 * self.error_mrad(without))


if __name__ == "__main__":
    unittest.main()
