"""What every real interface costs: OptiTrack's frames from a foreign client in, Modbus TCP out, against LCM alone. Argument: folder of the programs.

Both in turn, ROUNDS times, the programs at SCHED_FIFO where that is allowed; the median of the ratios counts. Runs in the Python of
tools/python_environment; skipped where that was not made.
"""
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import unittest

from running_arm import PYTHON, ROOT, own_url, skip_without_multicast, skip_without_our_python, start, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))
ROUNDS = int(os.environ.get("ROUNDS", "5"))
DURATION_S = 10
MOST = 1.2

skip_without_multicast()
skip_without_our_python()
FIFO = ("chrt", "-f", "20") if subprocess.run(["chrt", "-f", "20", "true"], capture_output=True, check=False).returncode == 0 else ()


class EveryInterface(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        cls.url = own_url()

    def config(self, base, more=""):
        return write_config(self.folder, f"{base}.yaml", self.url, more)

    def track(self, *programs):
        """Error of u in rad and of the tip in m from 1 s on, of a run of the programs."""
        for name, *arguments in programs:
            start(self, self.folder, *FIFO, name, *arguments)
        out = self.folder / "out"
        watch = subprocess.run([PROGRAMS / "softarm", "watch", programs[0][-1], "--duration", str(DURATION_S), "--out", out],
                               capture_output=True, text=True, timeout=300, check=False)
        self.doCleanups()  # ends the programs
        self.assertEqual(watch.returncode, 0, watch.stderr)
        tracking = json.loads((out / "summary.json").read_text(encoding="utf-8"))["tracking"]
        return tracking["u_rms_rad"], tracking["tip_rms_m"]

    def test_tracking_is_no_worse_than_1_2_times(self):
        port = str(20000 + os.getpid() % 12000)
        valves = f"valves: {{port: {port}}}\n"
        ours, every = self.config("paper_arm"), self.config("paper_arm_every_interface", valves)
        plain = ((PROGRAMS / "softarmd", ours), (PROGRAMS / "softarm-plant", ours))
        foreign = ((PROGRAMS / "softarmd", every),
                   (PROGRAMS / "softarm-plant", "--modbus", port, self.config("paper_arm_modbus", valves)),
                   (PYTHON, "-B", ROOT / "examples/republish.py", "--url", self.url),
                   (PROGRAMS / "softarm-valves", every))
        ratios = []
        for k in range(ROUNDS):
            one, other = self.track(*plain), self.track(*foreign)
            ratios.append([b / a for a, b in zip(one, other)])
            print(f"{k + 1}: u {1e3 * one[0]:.2f} -> {1e3 * other[0]:.2f} mrad, tip {1e3 * one[1]:.2f} -> {1e3 * other[1]:.2f} mm",
                  flush=True)
        u, tip = (statistics.median(column) for column in zip(*ratios))
        print(f"median of {ROUNDS} ratios: u {u:.3f}, tip {tip:.3f}", flush=True)
        self.assertLessEqual(u, MOST)


if __name__ == "__main__":
    unittest.main()
