"""softarm commission, unattended, against the simulated arm behind a valve terminal: to the end, then again without moving anything, and
what it refuses. Argument: folder of the programs."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from running_arm import PATIENCE_S, own_url, skip_without_multicast, start, wait_for, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))
STEPS = ["check", "look", "calibrate", "pulses", "identify", "bend", "track"]
# The page by hand tracks within 3.4 mrad over all segments (docs/tutorial/laboratory.md); a machine that is busy adds to that.
BOUND_RAD = 0.006

skip_without_multicast()


class Commission(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.out = self.folder / "day"
        port = str(20000 + os.getpid() % 12000)
        self.config = write_config(
            self.folder, "laboratory.yaml", own_url(),
            f"valves: {{port: {port}, tolerated_failures: 20, failsafe_timeout_s: 0.5}}\n"
            "identification: {steps_bar: [0.1, 0.2, 0.3], hold_s: 0.7, max_theta_rad: 0.8}\n",
            daemon="  realtime: {fifo: false}\n")
        self.port = port

    def commission(self, *arguments, answers="", patience_s=4 * PATIENCE_S):
        return subprocess.run([PROGRAMS / "softarm", "commission", self.config, "--out", self.out, *arguments], input=answers,
                              capture_output=True, text=True, timeout=patience_s, check=False,
                              env={**os.environ, "XDG_STATE_HOME": str(self.folder)})

    def test_from_an_unpacked_arm_to_a_tracked_trajectory(self):
        without_an_arm = self.commission("--yes")
        self.assertEqual(without_an_arm.returncode, 64, without_an_arm.stderr)
        self.assertIn("a real one moves only when somebody who sees it agrees", without_an_arm.stderr)
        self.assertFalse(self.out.exists())
        # An experiment of the same name as one that is found stays what it is.
        self.out.mkdir()
        mine = self.out / "bend.yaml"
        mine.write_text("mine", encoding="utf-8")
        refused = self.commission(answers="n\n")
        self.assertEqual(refused.returncode, 64, refused.stdout)
        self.assertIn(f"{mine} is not from softarm commission: another --out, please", refused.stderr)
        self.assertEqual([path.name for path in self.out.iterdir()], ["bend.yaml"])
        mine.unlink()
        start(self, self.folder, PROGRAMS / "softarm-plant", "--modbus", self.port, self.config)
        # Nobody agrees: nothing is commanded.
        asked = self.commission(answers="y\nn\n")
        self.assertEqual(asked.returncode, 1, asked.stderr)
        self.assertIn("stopped before this step", asked.stdout)
        self.assertEqual([line.split()[0] for line in (self.out / "journal.txt").read_text().splitlines()], ["check"])
        # The valves' driver is missing: the second step says so, and the same command goes on.
        stopped = self.commission("--yes")
        self.assertEqual(stopped.returncode, 1, stopped.stdout)
        self.assertIn("look: put right", stopped.stderr)
        start(self, self.folder, PROGRAMS / "softarm-valves", self.config)
        wait_for(lambda: "VENTED" in (self.folder / "softarm-valves.txt").read_text(), "the valves' driver is not ready")

        whole = self.commission("--yes")
        self.assertEqual(whole.returncode, 0, whole.stdout + whole.stderr)
        journal = (self.out / "journal.txt").read_text().splitlines()
        self.assertEqual([line.split()[0] for line in journal], STEPS)
        print("\n".join(journal))
        self.assertIn("THE ARM MOVES", whole.stderr)
        for name, bound_rad in (("bend", BOUND_RAD), ("track", BOUND_RAD)):
            tracking = json.loads((self.out / name / "summary.json").read_text(encoding="utf-8"))["tracking"]
            print(f"{name}: {1e3 * tracking['u_rms_rad']:.2f} mrad rms of the true u")
            self.assertLess(tracking["u_rms_rad"], bound_rad, name)
            replay = subprocess.run([PROGRAMS / "softarm", "replay", self.out / name / "run.log", self.out / f"{name}.yaml"],
                                    capture_output=True, text=True, timeout=PATIENCE_S, check=False)
            self.assertEqual(replay.returncode, 0, replay.stdout + replay.stderr)
        for name in ("calibrated", "identified", "bend", "track"):
            check = subprocess.run([PROGRAMS / "softarm", "check", "--no-loop", self.out / f"{name}.yaml"], capture_output=True,
                                   text=True, timeout=PATIENCE_S, check=False)
            self.assertEqual(check.returncode, 0, check.stderr)

        again = self.commission("--yes")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(again.stdout.count("done before: "), len(STEPS))
        # Another configuration begins again.
        self.config.write_text(self.config.read_text() + "control: {kp_nm_per_rad: 0.6}\n", encoding="utf-8")
        changed = self.commission(answers="n\n")
        self.assertNotIn("done before", changed.stdout)


if __name__ == "__main__":
    unittest.main()
