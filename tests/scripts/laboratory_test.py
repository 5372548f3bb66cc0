"""Every command of docs/tutorial/laboratory.md, as printed, in one shell, against the simulated arm. Argument: folder of the programs."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = pathlib.Path(sys.argv.pop(1))
PATIENCE_S = 600
PAGE = ROOT / "docs/tutorial/laboratory.md"

if subprocess.run([ROOT / "tools/with_loopback_network", "true"], capture_output=True, check=False).returncode != 0:
    print("skipped: no separate network can be made here, and there is no multicast route")
    sys.exit(77)


class Laboratory(unittest.TestCase):
    def test_the_page_runs_as_printed(self):
        blocks = re.findall(r"^```sh\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        self.assertGreater(len(blocks), 8)
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for part in ("config", "tools"):
                (folder / part).symlink_to(ROOT / part)
            (folder / "build/release").mkdir(parents=True)
            (folder / "build/release/bin").symlink_to(PROGRAMS)
            script = "set -euo pipefail\n" + "\n".join(blocks)
            output = folder / "output.txt"
            with open(output, "w", encoding="utf-8") as file:
                shell = subprocess.Popen([ROOT / "tools/with_loopback_network", "bash", "-c", script], cwd=folder, stdout=file,
                                         stderr=file, start_new_session=True)
                try:
                    code = shell.wait(timeout=PATIENCE_S)
                except subprocess.TimeoutExpired:
                    code = f"none within {PATIENCE_S} s: an arm that a fault has stopped is watched forever"
                finally:
                    try:
                        os.killpg(shell.pid, signal.SIGKILL)  # what the page leaves running, or an interrupted test
                    except ProcessLookupError:
                        pass
            printed = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.txt"))}
            self.assertEqual(code, 0, "\n".join(f"-- {name}\n{text}" for name, text in printed.items()))
            self.assertIn("VENTED", printed["valves.txt"])
            self.assertIn("IDENTICAL", printed["output.txt"])
            self.assertTrue((folder / "out/tracked/log.csv").exists())
            print(printed["output.txt"])


if __name__ == "__main__":
    unittest.main()
