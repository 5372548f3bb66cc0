"""tools/identify_recording and tools/plot_identification.py on an arm whose table is made here. Argument: the program softarm."""
import csv
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

try:
    import matplotlib  # noqa: F401
    import numpy as np
except ImportError:
    print("skipped: python3-matplotlib is not installed")
    sys.exit(77)

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"
PROGRAM = sys.argv.pop(1)
PSI_BAR = 0.0689476
LENGTH_M, BETA_OVER_K_S, LAG_S = 0.33, 0.8, 0.7
# What a bar of each column turns the tip by, about the x and z axes of the laboratory, rad: neither square nor equal.
TURN = np.array([[0.10, 0.20], [-0.22, 0.08], [-0.09, -0.25], [0.17, -0.11]])
NOISE_RAD = 2e-4


def filtered(x, time_s, lag_s):
    out = np.zeros_like(x)
    for k in range(1, len(x)):
        out[k] = x[k] + (out[k - 1] - x[k]) * np.exp(-(time_s[k] - time_s[k - 1]) / lag_s)
    return out


def product(q, v):
    """v turned by the quaternion q = x, y, z, w."""
    t = 2 * np.cross(q[:3], v)
    return v + q[3] * t + np.cross(q[:3], t)


def turned(vector):
    angle = np.linalg.norm(vector)
    return np.append(vector * (0.5 * np.sinc(angle / (2 * np.pi))), np.cos(0.5 * angle))


def write_table(path, seconds=46.0):
    """In the layout of the recordings: a hanging arm with y up, rows at 50 a second of which some repeat the pose before."""
    random = np.random.default_rng(4)
    fine_s = np.arange(0, seconds, 0.005)
    phase = 2 * np.pi * 0.1 * fine_s[:, None] + np.arange(4) * np.pi / 2
    asked_psi = np.where(fine_s[:, None] < 0.6 + 0.9 * np.arange(4), 0.0, 6 + 3 * np.cos(phase) + np.cos(2.3 * phase))
    there_psi = filtered(asked_psi, fine_s, LAG_S)
    turn_rad = filtered(PSI_BAR * there_psi @ TURN, fine_s, BETA_OVER_K_S)
    names = ["time"] + [f"pd_{c}" for c in (5, 1, 2, 9)] + [f"pm_{b}_{s}" for b in (5, 1, 2, 9) for s in range(1, 5)]
    names += [f"mocap_{b}_{n}" for b in (1, 2, 3) for n in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(names)
        tip = []
        for n, k in enumerate(range(0, len(fine_s), 4)):
            if n % 5 != 3:  # else the pose before once more
                axis = np.array([turn_rad[k, 0], 0, turn_rad[k, 1]]) + NOISE_RAD * random.normal(size=3)
                along = np.mean([product(turned(s * axis), np.array([0.0, -1.0, 0.0])) for s in (np.arange(20) + 0.5) / 20], axis=0)
                tip = [*(np.array([0.2, 1.1, 0.4]) + LENGTH_M * along), *turned(axis)]
            sensors = np.full(16, 0.3)
            sensors[[0, 9, 14, 15]] = there_psi[k]
            row = [fine_s[k], *asked_psi[k], *sensors, 0.2, 1.2, 0.4, 0, 0, 0, 1, 0.2, 1.1, 0.4, 0, 0, 0, 1, *tip]
            table.writerow([f"{value:.7f}" for value in row])


def plot(directory):
    return subprocess.run(["/usr/bin/python3", "-B", TOOLS / "plot_identification.py", directory], check=False, capture_output=True,
                          text=True)


class Recording(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def identify(self, table, *options):
        return subprocess.run([TOOLS / "identify_recording", table, "--out", self.folder / "out", *options], check=False,
                              capture_output=True, text=True, env=dict(os.environ, SOFTARM=PROGRAM))

    def test_a_table_of_that_layout_is_read_compared_and_drawn(self):
        table = self.folder / "five_one_two_nine.csv"
        write_table(table)
        done = self.identify(table)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        rows = {}
        for source in ("measured", "commanded"):
            text = (self.folder / "out" / source / "table.txt").read_text(encoding="utf-8")
            rows[source] = {name: [float(x) for x in errors]
                            for name, *errors in re.findall(r"^(\S.*?) +\d+ +([\d.]+) +([\d.]+) +([\d.]+)(?:  NOT CONVERGED)?$", text, re.MULTILINE)}
            self.assertEqual(len(rows[source]), 9, text)
            self.assertGreater((self.folder / "out" / source / "identification.png").stat().st_size, 10000)
        # From measured pressures the model is the arm: what is left is the noise, in the halves that were not fitted, too.
        noise_mrad = 1e3 * NOISE_RAD
        for error in rows["measured"]["(16): gains, beta"]:
            self.assertLess(error, 1.5 * noise_mrad)
        self.assertGreater(rows["measured"]["gains; no damping"][0], 10 * noise_mrad)
        beta = re.search(r"^damping beta +([\d.]+)", (self.folder / "out/measured/table.txt").read_text(encoding="utf-8"), re.MULTILINE)
        gravity = 0.3 * 9.81 * LENGTH_M / 12  # N m/rad, of the configured mass, beside k = 1
        self.assertAlmostEqual(float(beta.group(1)), BETA_OVER_K_S * (1 + gravity), delta=0.03)
        # From commanded ones the lag is missing, and is found.
        self.assertGreater(rows["commanded"]["(16): gains, beta"][0], 3 * noise_mrad)
        for error in rows["commanded"]["(16) + lag"]:
            self.assertLess(error, 2 * noise_mrad)
        self.assertNotIn("NOT CONVERGED", (self.folder / "out/measured/table.txt").read_text(encoding="utf-8"))

    def test_another_layout_wants_a_map(self):
        table = self.folder / "other.csv"
        table.write_text("t,p\n0,0\n", encoding="utf-8")
        done = self.identify(table)
        self.assertEqual(done.returncode, 64)
        self.assertIn("--map", done.stderr)


class Plot(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def write(self, segments, rows):
        names = [f"{kind}_u{i + 1}_{axis}_rad" for kind in ("measured", "simulated") for i in range(segments) for axis in "xy"]
        lines = [",".join(["time_s"] + names)]
        for k in range(rows):
            seen = [0.1 * np.sin(0.1 * k + c) for c in range(2 * segments)]
            lines.append(",".join(f"{x:.9f}" for x in [0.02 * k, *seen, *(x - 0.003 * (-1) ** k for x in seen)]))
        (self.folder / "identification.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

    def test_the_residual_is_the_one_put_in(self):
        for segments in (1, 3):
            self.write(segments, 300)
            done = plot(self.folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(done.stdout, f"{self.folder}/identification.png: residual 3 mrad rms a component\n")
            self.assertGreater((self.folder / "identification.png").stat().st_size, 10000)

    def test_no_file_and_a_wrong_one_are_errors_that_name_it(self):
        for text in (None, "time_s,u\n0,1\n", "time_s,a,b,c,d\n0,1,2,3,4\n"):
            if text:
                (self.folder / "identification.csv").write_text(text, encoding="utf-8")
            done = plot(self.folder)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn("identification.csv", done.stderr)
            self.assertNotIn("Traceback", done.stderr)


if __name__ == "__main__":
    unittest.main()
