"""Runs a program of examples/ as its first comment states; it must end with 0 and print what it should.

usage: example_test.py [--arm EXPERIMENT] --prints REGEX FOLDER_OF_THE_PROGRAMS EXAMPLE [ARGUMENTS...]
With --arm it runs beside softarm-plant and softarmd on config/EXPERIMENT, and gets its file as first argument. "@" in an
argument is a folder that goes away.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from running_arm import own_url, skip_without_multicast, start, write_config

parser = argparse.ArgumentParser()
parser.add_argument("--arm")
parser.add_argument("--prints", required=True)
parser.add_argument("programs", type=pathlib.Path)
parser.add_argument("example", type=pathlib.Path)
parser.add_argument("arguments", nargs=argparse.REMAINDER)
OPTIONS = parser.parse_args()
if OPTIONS.arm:
    skip_without_multicast()


class Example(unittest.TestCase):
    def test_does_what_it_says(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        folder = pathlib.Path(temporary.name)
        arguments = [argument.replace("@", str(folder)) for argument in OPTIONS.arguments]
        if OPTIONS.arm:
            config = write_config(folder, OPTIONS.arm, own_url())
            arguments.insert(0, config)
            start(self, folder, OPTIONS.programs / "softarm-plant", config)
            start(self, folder, OPTIONS.programs / "softarmd", config)
        done = subprocess.run([OPTIONS.example, *arguments], capture_output=True, text=True, timeout=200, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertTrue(re.search(OPTIONS.prints, done.stdout, flags=re.DOTALL), done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
