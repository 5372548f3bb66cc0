"""tools/spy on a virtual display: what lcm-spy shows of the daemon's messages. Argument: folder of the programs."""
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from running_arm import ROOT, own_url, skip_without_multicast, start, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))
SEED = 4711
JARS = [pathlib.Path("/usr/share/java") / name for name in ("lcm.jar", "jchart2d.jar", "xmlgraphics-commons.jar")]
TYPES = {"SOFTARM_MOCAP": "mocap_frame_t", "SOFTARM_PLANT": "plant_state_t", "SOFTARM_PRESSURE": "pressure_measurement_t",
         "SOFTARM_PRESSURE_COMMAND": "pressure_command_t", "SOFTARM_STATUS": "controller_status_t",
         "SOFTARM_TICK": "tick_record_t", "SOFTARM_TIMING": "timing_t"}

missing = [name for name in ("lcm-gen", "java", "javac", "Xvfb") if not shutil.which(name)]
missing += [str(jar) for jar in JARS if not jar.exists()]
if missing:
    print(f"skipped: {', '.join(missing)} not here (tools/install_packages --spy)")
    sys.exit(77)
skip_without_multicast()


def declared_fields(name):
    text = (ROOT / "lcmtypes" / f"{name}.lcm").read_text(encoding="utf-8")
    return re.findall(r"^\s+\w+ (\w+)[\[;]", text, flags=re.MULTILINE)


class Spy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        for part in ("tools", "lcmtypes"):
            shutil.copytree(ROOT / part, cls.folder / part)
        cls.url = own_url()

    def spy(self, *arguments):
        return subprocess.run([self.folder / "tools/spy", *arguments], check=False, capture_output=True, text=True)

    def test_every_field_of_the_status_is_shown_decoded(self):
        config = write_config(self.folder, "paper_arm.yaml", self.url, f"seed: {SEED}\n")
        start(self, self.folder, PROGRAMS / "softarm-plant", config)
        start(self, self.folder, PROGRAMS / "softarmd", config)
        picture = self.folder / "spy.png"
        result = self.spy("--url", self.url, "--screenshot", picture)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")

        listed, painted = result.stdout.split("\n\n", 1)
        channels = dict(line.split("\t") for line in listed.splitlines())
        self.assertGreaterEqual(channels.keys(), {"SOFTARM_MOCAP", "SOFTARM_STATUS", "SOFTARM_PRESSURE_COMMAND"})
        self.assertEqual(channels, {channel: TYPES[channel] for channel in channels})

        values = {}
        for line in painted.splitlines():
            cells = line.split("\t")  # type, field, value; or + or -, type, field that has fields
            if len(cells) == 3:
                values[cells[2] if cells[0] in "+-" else cells[1]] = cells[2]
        self.assertEqual([name for name in declared_fields("controller_status_t")
                          if not any(re.fullmatch(rf"{name}(\[\d+\])*", field) for field in values)], [])
        version = subprocess.run([PROGRAMS / "softarmd", "--version"], check=True, capture_output=True, text=True).stdout
        self.assertEqual((int(values["seed"]), int(values["num_segments"]), int(values["num_chambers"])), (SEED, 3, 12))
        self.assertIn(values["version"].split()[0], version)
        self.assertGreater(int(values["tick"]), 0)
        # Numbers that say the same in two ways can only agree if both were decoded.
        bends = [[float(values[f"u_rad[{i}][{axis}]"]) for axis in (0, 1)] for i in range(3)]
        for i, (x, y) in enumerate(bends):
            self.assertAlmostEqual(float(values[f"theta_rad[{i}]"]), math.hypot(x, y), delta=1e-5)
        self.assertGreater(max(abs(part) for bend in bends for part in bend), 0.0)
        self.assertTrue(all(0.0 <= float(values[f"pressure_bar[{i}]"]) <= 2.0 for i in range(12)))

    def test_the_types_are_made_on_first_use_and_when_a_definition_is_newer(self):
        def made():
            result = self.spy("--jar")
            self.assertEqual(result.returncode, 0, result.stderr)
            jar = pathlib.Path(result.stdout.strip())
            self.assertTrue(jar.exists())
            return jar, jar.stat().st_mtime_ns

        jar, first = made()
        self.assertEqual(made(), (jar, first))
        definition = self.folder / "lcmtypes/timing_t.lcm"
        definition.write_text(definition.read_text(encoding="utf-8") + "\n", encoding="utf-8")
        os.utime(definition, ns=(first + 10**9, first + 10**9))
        self.assertNotEqual(made(), (jar, first))

    def test_wrong_command_lines_are_refused(self):
        self.assertEqual(self.spy("--no-such-option").returncode, 64)
        self.assertEqual(self.spy("--screenshot").returncode, 64)


if __name__ == "__main__":
    unittest.main()
