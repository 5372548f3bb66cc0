#!/usr/bin/python3
"""examples/identify.cpp finds the stiffness of a simulated arm in a log of lcm-logger. usage: identify_example_test.py BIN"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import running_arm

PROGRAMS = pathlib.Path(sys.argv.pop())
STIFFNESS_NM_PER_RAD = 0.626  # of the plant in config/paper_arm.yaml


class IdentifyExample(unittest.TestCase):
    def test_stiffness_of_a_recorded_motion(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="softarm_identify_"))
        self.addCleanup(shutil.rmtree, folder)
        url = running_arm.own_url()
        config = running_arm.write_config(folder, "paper_arm.yaml", url)
        log = folder / "run.lcm"
        logger = running_arm.start(self, folder, "lcm-logger", "-q", f"--lcm-url={url}", log)
        running_arm.start(self, folder, PROGRAMS / "softarm-plant", config)
        running_arm.start(self, folder, PROGRAMS / "softarmd", config)
        time.sleep(8)
        logger.terminate()
        logger.wait()
        run = subprocess.run([PROGRAMS / "example_identify", config, log], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        found = re.search(r"^stiffness k: ([\d.]+) \+- ([\d.e-]+) N m/rad$", run.stdout, re.MULTILINE)
        self.assertTrue(found, run.stdout)
        self.assertAlmostEqual(float(found[1]), STIFFNESS_NM_PER_RAD, delta=0.02 * STIFFNESS_NM_PER_RAD)

    def test_usage(self):
        run = subprocess.run([PROGRAMS / "example_identify"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertIn("usage", run.stderr)


running_arm.skip_without_multicast()
unittest.main()
