"""softarm calibrate finds the tilted marker frames of a simulated arm; the arm then tracks. Argument: folder of the programs."""
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from running_arm import PATIENCE_S, own_url, skip_without_multicast, start, tracks_within, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))
# Position in m, rotation vector in rad; the base's marker frame is known.
MARKER_FRAMES = ((0.01, -0.004, 0.003, 0.05, -0.02, 0.1), (-0.006, 0.012, 0.0, 0.0, 0.0, 1.5), (0.0, 0.008, -0.005, -0.3, 0.2, -0.6))
NOISE_M, NOISE_RAD = 0.2e-3, 0.2 * math.pi / 180  # of config/paper_arm.yaml, an axis

skip_without_multicast()


def found_in(calibrated):
    rows = []
    for line in calibrated.read_text(encoding="utf-8").splitlines():
        if line.strip().startswith("- {"):
            rows.append([float(number) for number in re.findall(r"-?\d+\.\d+", line)])
    return rows


class Calibrate(unittest.TestCase):
    def softarm(self, *command):
        return subprocess.run([PROGRAMS / "softarm", *command], capture_output=True, text=True, timeout=PATIENCE_S, check=False)

    def test_tilted_marker_frames_are_found_and_the_arm_tracks(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        folder = pathlib.Path(temporary.name)
        configured = write_config(folder, "paper_arm.yaml", own_url())
        truth, calibrated = folder / "truth.yaml", folder / "calibrated.yaml"
        yaml = "".join(f"      - {{position_m: {list(p[:3])}, rotation_rad: {list(p[3:])}}}\n" for p in MARKER_FRAMES)
        truth.write_text(f"include: {configured}\nname: truth\ndaemon:\n  bodies:\n    segment_plates:\n{yaml}", encoding="utf-8")
        start(self, folder, PROGRAMS / "softarm-plant", truth)

        result = self.softarm("calibrate", configured, "--duration", "3", "--output", calibrated)
        self.assertEqual(result.returncode, 0, result.stderr)
        frames = int(re.search(r"^segment 1 +(\d+)", result.stdout, flags=re.MULTILINE).group(1))
        rows = found_in(calibrated)
        self.assertEqual(len(rows), 3)
        for segment, (found, expected) in enumerate(zip(rows, MARKER_FRAMES), 1):
            # Six standard deviations of the mean of the body's own noise and of the base's, which turns the arm about it.
            mean_rad = 6 * NOISE_RAD / math.sqrt(frames)
            mean_m = 6 * math.hypot(NOISE_M, NOISE_RAD * 0.11 * segment) / math.sqrt(frames)
            self.assertLess(math.dist(found[:3], expected[:3]), math.sqrt(2) * mean_m, result.stdout)
            self.assertLess(math.dist(found[3:], expected[3:]), 2 * mean_rad, result.stdout)

        start(self, folder, PROGRAMS / "softarmd", calibrated)
        tracks_within(self, PROGRAMS, calibrated, 0.01)

        refused = self.softarm("calibrate", configured, "--duration", "1")
        self.assertEqual(refused.returncode, 1, refused.stdout)
        self.assertIn("softarm disarm", refused.stderr)


if __name__ == "__main__":
    unittest.main()
