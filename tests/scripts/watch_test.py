"""What softarm watch shows on a terminal. Argument: folder of the programs."""
import os
import pathlib
import pty
import re
import subprocess
import sys
import tempfile
import unittest

from running_arm import ROOT, own_url, skip_without_multicast, start, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))

skip_without_multicast()


class Watch(unittest.TestCase):
    def test_mode_rates_errors_pressures_and_counters_are_live(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        folder = pathlib.Path(temporary.name)
        config = write_config(folder, "paper_arm.yaml", own_url())
        start(self, folder, PROGRAMS / "softarm-plant", config)
        start(self, folder, PROGRAMS / "softarmd", config)
        terminal, other_end = pty.openpty()
        self.addCleanup(os.close, terminal)
        watch = subprocess.Popen([PROGRAMS / "softarm", "watch", config, "--duration", "3"], stderr=other_end,
                                 stdout=subprocess.DEVNULL)
        os.close(other_end)
        shown = b""
        try:
            while part := os.read(terminal, 4096):
                shown += part
        except OSError:  # how a terminal reports that its other end is closed
            pass
        self.assertEqual(watch.wait(), 0, shown)
        drawings = re.split(r"\x1b\[\d+A\x1b\[J", shown.decode().replace("\r", ""))
        self.assertGreater(len(drawings), 3)
        times, frames, rates = [], [], []
        for text in drawings:
            self.assertRegex(text, r"s   (WAIT_FRAMES|ACTIVE|HOLD|VENT) \(\w+\)")
            times.append(float(re.match(r"\d+\.\d+", text).group()))
            frames.append(int(re.search(r"frames (\d+) accepted, \d+ rejected, \d+ repeated, \d+ missing", text).group(1)))
            rates.append(float(re.search(r"frames (\d+\.\d) Hz", text).group(1)))
            rows = re.findall(r"^ +([123])   +[\d.]+   +[-+][\d.]+   +([\d.]+|-)((?:  +\d\.\d{3}){4})$", text, flags=re.MULTILINE)
            self.assertEqual([row[0] for row in rows], ["1", "2", "3"], text)
        self.assertEqual((times, frames), (sorted(times), sorted(frames)))
        self.assertGreater(frames[-1], frames[0])
        self.assertGreater(max(rates), 0.0)
        active = [text for text in drawings if " ACTIVE " in text]
        self.assertTrue(active)
        self.assertRegex(active[-1], r"[1-9]\d*\.\d\d |0\.\d\d ")  # an error of u where there is a reference


if __name__ == "__main__":
    unittest.main()
