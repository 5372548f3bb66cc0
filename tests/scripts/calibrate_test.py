"""softarm calibrate finds the plates of a simulated arm that carries them askew; the arm then tracks. Argument: folder of the programs."""
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from running_arm import PATIENCE_S, own_url, skip_without_multicast, start, tracks_within, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))
# Position in m, rotation vector in rad; the base's plate is known.
PLATES = ((0.01, -0.004, 0.003, 0.05, -0.02, 0.1), (-0.006, 0.012, 0.0, 0.0, 0.0, 1.5), (0.0, 0.008, -0.005, -0.3, 0.2, -0.6))
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

    def test_plates_that_are_askew_are_found_and_the_arm_tracks(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        folder = pathlib.Path(temporary.name)
        believed = write_config(folder, "paper_arm.yaml", own_url())
        truth, calibrated = folder / "truth.yaml", folder / "calibrated.yaml"
        plates = "".join(f"      - {{position_m: {list(p[:3])}, rotation_rad: {list(p[3:])}}}\n" for p in PLATES)
        truth.write_text(f"include: {believed}\nname: truth\ndaemon:\n  bodies:\n    segment_plates:\n{plates}", encoding="utf-8")
        start(self, folder, PROGRAMS / "softarm-plant", truth)

        result = self.softarm("calibrate", believed, "--duration", "3", "--output", calibrated)
        self.assertEqual(result.returncode, 0, result.stderr)
        frames = int(re.search(r"^segment 1 +(\d+)", result.stdout, flags=re.MULTILINE).group(1))
        rows = found_in(calibrated)
        self.assertEqual(len(rows), 3)
        for segment, (found, plate) in enumerate(zip(rows, PLATES), 1):
            # Six standard deviations of the mean of the body's own noise and of the base's, which turns the arm about it.
            mean_rad = 6 * NOISE_RAD / math.sqrt(frames)
            mean_m = 6 * math.hypot(NOISE_M, NOISE_RAD * 0.11 * segment) / math.sqrt(frames)
            self.assertLess(math.dist(found[:3], plate[:3]), math.sqrt(2) * mean_m, result.stdout)
            self.assertLess(math.dist(found[3:], plate[3:]), 2 * mean_rad, result.stdout)

        start(self, folder, PROGRAMS / "softarmd", calibrated)
        tracks_within(self, PROGRAMS, calibrated, 0.01)

        refused = self.softarm("calibrate", believed, "--duration", "1")
        self.assertEqual(refused.returncode, 1, refused.stdout)
        self.assertIn("softarm disarm", refused.stderr)


if __name__ == "__main__":
    unittest.main()
