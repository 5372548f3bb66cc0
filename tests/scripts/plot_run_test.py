"""tools/plot_run.py on small logs whose numbers are known."""
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import matplotlib  # noqa: F401
except ImportError:
    print("skipped: python3-matplotlib is not installed")
    sys.exit(77)

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"
sys.path.insert(0, str(TOOLS))
import numpy as np  # noqa: E402
from plotting import player, report  # noqa: E402
from plotting.run_log import RunLog, ShapeLog  # noqa: E402

PERIOD_S = 0.02
OFFSET = (0.003, 0.004)  # reference minus truth, rad


def write_log(directory, segments, truth=True, reference=True, rows=200):
    """An arm at theta 0.5, turning; ACTIVE from 0.5 s on; where it is tracked it is off by OFFSET."""
    lines = ["# softarm 0 commit none configuration 0 seed 1 name small_test"]
    names = ["t_s", "mode", "reason", "saturated", "frame_age_s"]
    for i in range(1, segments + 1):
        for kind in ("u{}_{}_rad", "v{}_{}_radps", "ref{}_{}_rad", "true{}_{}_rad", "tau{}_{}_nm"):
            names += [kind.format(i, axis) for axis in "xy"]
        names += [f"twist{i}_rad", f"length{i}_m"]
    names += [f"{kind}{i}_1_bar" for i in range(1, segments + 1) for kind in ("p", "pm")]
    names += [f"{kind}_{axis}_m" for kind in ("tip", "tipref") for axis in "xyz"]
    lines.append(",".join(names))
    for k in range(rows):
        t = k * PERIOD_S
        active = t >= 0.5
        cells = [f"{t:.3f}", "ACTIVE" if active else "WAIT_FRAMES", "none", "0", "0.005" if k else ""]
        for i in range(segments):
            wanted = (0.5 * math.cos(2 * t + i), 0.5 * math.sin(2 * t + i))
            is_there = [w - o for w, o in zip(wanted, OFFSET)]
            cells += [f"{v:.9f}" for v in is_there] + ["0.1", "-0.1"]
            cells += [f"{v:.9f}" for v in wanted] if reference and active else ["", ""]
            cells += [f"{v:.9f}" for v in is_there] if truth else ["", ""]
            cells += ["0.2", "0.3", "0.001", "0.0002"]
        cells += ["0.4", "0.35" if truth else ""] * segments
        cells += (["0.1", "0.2", "-0.3"] if truth else [""] * 3) + (["0.1", "0.2", "-0.3"] if reference else [""] * 3)
        lines.append(",".join(cells))
    (directory / "log.csv").write_text("\n".join(lines) + "\n" + lines[-1][:20], encoding="utf-8")  # cut off within a row


def run(directory, *arguments):
    return subprocess.run(["/usr/bin/python3", "-B", TOOLS / "plot_run.py", directory, *arguments], check=False,
                          capture_output=True, text=True)


class PlotRun(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.directory = pathlib.Path(temporary.name)

    def test_tracking_errors_are_those_put_in(self):
        write_log(self.directory, 2)
        log = RunLog(self.directory)
        self.assertEqual(log.segments, 2)
        u_rms, u_max, theta_rms, phi_rms = log.tracking(1.0)[0]
        self.assertAlmostEqual(u_rms, math.sqrt((OFFSET[0] ** 2 + OFFSET[1] ** 2) / 2), delta=1e-8)
        self.assertAlmostEqual(u_max, OFFSET[1], delta=1e-8)
        # |offset|^2 = (theta error)^2 + (theta phi error)^2 to first order.
        self.assertAlmostEqual(math.hypot(theta_rms, 0.5 * phi_rms), math.hypot(*OFFSET), delta=3e-5)

    def test_tracking_counts_from_one_second_after_active(self):
        write_log(self.directory, 1)
        rows = RunLog(self.directory).tracking_rows(1.0)
        self.assertEqual(int(rows.argmax()), round(1.5 / PERIOD_S))

    def test_everything_is_drawn_and_reported(self):
        write_log(self.directory, 3)
        result = run(self.directory)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr, "")
        self.assertIn("segment 3", result.stdout)
        pictures = {path.stem for path in self.directory.glob("*.png")}
        self.assertEqual(pictures, {"figure9", "u", "velocities", "pressures", "tip_path", "residuals"})
        page = (self.directory / "report.html").read_text(encoding="utf-8")
        self.assertEqual(page.count("data:image/png;base64,"), len(pictures))
        self.assertIn("small_test", page)

    def test_the_report_says_why_the_arm_was_not_active(self):
        write_log(self.directory, 1)
        self.assertEqual(report.why_not_active(RunLog(self.directory)), [], "waiting at the start is as it should be")
        log = self.directory / "log.csv"
        text = log.read_text(encoding="utf-8")
        log.write_text(text.replace("ACTIVE,none", "VENT,frames_missing"), encoding="utf-8")
        never = report.why_not_active(RunLog(self.directory))
        self.assertEqual(never[0], "The arm never became ACTIVE.")
        self.assertIn("VENT: frames missing, from 0.50 s", never[2])
        lines = [line.replace("ACTIVE,none", "HOLD,frames_late") if line.startswith(("2.5", "2.6")) else line
                 for line in text.splitlines()]
        log.write_text("\n".join(lines), encoding="utf-8")
        held = report.why_not_active(RunLog(self.directory))
        self.assertRegex(held[0], "not ACTIVE for 0.2. s")
        self.assertEqual(len(held), 2)
        self.assertIn("HOLD: frames late, from 2.50 s", held[1])
        self.assertEqual(run(self.directory, "--quiet").returncode, 0)
        self.assertIn("HOLD: frames late", (self.directory / "report.html").read_text(encoding="utf-8"))

    def test_the_player_s_arm_is_the_arm(self):
        """Arcs against a chain of straight pieces, and what the page gets."""
        u, lengths, pieces = np.array([[[0.6, -0.3], [1e-9, 0.0], [0.2, 1.1]]]), [0.1, 0.12, 0.08], 4000
        frame = np.eye(4)
        for (ux, uy), length in zip(u[0], lengths):
            x, y = -uy / pieces, ux / pieces
            cross = np.array([[0, 0, y], [0, 0, -x], [-y, x, 0]])
            step = np.eye(4)
            step[:3, :3] += cross + 0.5 * cross @ cross
            step[:3, 3] = [0.5 * length / pieces * ux / pieces, 0.5 * length / pieces * uy / pieces, length / pieces]
            frame = frame @ np.linalg.matrix_power(step, pieces)
        np.testing.assert_allclose(player.arcs(u, lengths)[0, -1], frame[:3, 3], atol=1e-7)
        write_log(self.directory, 2)
        self.assertIsNone(player.scene(RunLog(self.directory)), "without lengths there is no arm")
        arm = {"length_m": [0.1, 0.1], "base_rotation": np.eye(3).tolist(), "base_position_m": [0, 0, 1]}
        (self.directory / "summary.json").write_text(json.dumps({"arm": arm}), encoding="utf-8")
        scene = player.scene(RunLog(self.directory))
        self.assertEqual([line["name"] for line in scene["lines"]], ["reference", "true arm", "estimate"])
        self.assertEqual(max(scene["tipError"], key=lambda e: e or 0), 0.0)
        self.assertEqual(run(self.directory, "--quiet").returncode, 0)
        self.assertIn('<canvas id="arm"', (self.directory / "report.html").read_text(encoding="utf-8"))

    def test_links_and_a_path_of_the_tip_give_figures_4_to_7(self):
        write_log(self.directory, 2)
        names = ["t_s"] + [f"bend{j}_{axis}_rad" for j in range(1, 7) for axis in "xy"]
        names += [f"point{j}_{axis}_m" for j in range(7) for axis in "xyz"]
        rows = [[0.02 * k] + [0.1, 0.01 * k] * 6 + [0.001 * k, 0.0, 0.0] * 7 for k in range(200)]
        text = "# origin\n" + ",".join(names) + "\n" + "\n".join(",".join(map(str, row)) for row in rows)
        (self.directory / "shape.csv").write_text(text + "\n0.5,0.1", encoding="utf-8")  # cut off within a row
        summary = {"tracking": {"tip_rms_m": 0.001, "tip_max_m": 0.002, "tip_near_after_s": 1.5}}
        (self.directory / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
        shape = ShapeLog.of(RunLog(self.directory))
        self.assertEqual((shape.parts, shape.points.shape), (6, (200, 7, 3)))
        self.assertAlmostEqual(shape.bends[100, 5, 1], 1.0)
        result = run(self.directory)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn("tip within 10 mm after [s]", result.stdout)
        pictures = {path.stem for path in self.directory.glob("*.png")}
        self.assertTrue({"figure4", "figure5", "figure6", "figure7"} <= pictures)
        self.assertNotIn("figure9", pictures)

    def test_a_recording_has_neither_truth_nor_tip(self):
        write_log(self.directory, 1, truth=False, reference=False)
        result = run(self.directory, "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertFalse((self.directory / "tip_path.png").exists())
        self.assertTrue((self.directory / "u.png").exists())
        self.assertIsNone(RunLog(self.directory).tracking(1.0))

    def test_many_segments(self):
        write_log(self.directory, 10, rows=60)
        self.assertEqual(run(self.directory, "--quiet").returncode, 0)

    def test_no_log_is_an_error_that_names_it(self):
        result = run(self.directory)
        self.assertEqual(result.returncode, 1)
        self.assertIn("log.csv", result.stderr)

    def test_a_log_without_rows_is_an_error(self):
        (self.directory / "log.csv").write_text("# nothing\nt_s,mode\n", encoding="utf-8")
        self.assertEqual(run(self.directory).returncode, 1)


if __name__ == "__main__":
    unittest.main()
