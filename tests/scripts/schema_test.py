"""config/experiment.schema.json against the program: what `softarm check` accepts is valid; broken files are refused by both."""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

try:
    import jsonschema
    import yaml
except ImportError as missing:
    print(f"skipped: {missing} (tools/install_packages)")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCHEMA = ROOT / "config/experiment.schema.json"
SOFTARM = None  # the program, from the command line
FIRST_LINE = "# yaml-language-server: $schema="


class Yaml12(yaml.SafeLoader):
    """YAML 1.2, as the program and editors read it: `yes` is a word, 1e-3 a number."""


Yaml12.yaml_implicit_resolvers = {}
for tag, pattern, first in (("null", r"~|null|", "~n"), ("bool", r"true|false", "tf"), ("int", r"[-+]?[0-9]+", "-+0123456789"),
                            ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", "-+.0123456789")):
    Yaml12.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(f"^(?:{pattern})$"), list(first))
Yaml12.add_constructor("tag:yaml.org,2002:int", lambda loader, node: int(loader.construct_scalar(node)))
Yaml12.add_constructor("tag:yaml.org,2002:float", lambda loader, node: float(loader.construct_scalar(node)))

GOOD = """name: good
arm: {segments: 2, length_m: 0.11, mass_kg: 0.15, stiffness_nm_per_rad: 0.6, damping_nms_per_rad: 0.03}
actuation: {chambers: {angle_rad: [0, 2*pi/3, 4*pi/3], gain_nm_per_bar: 0.8}}
control: {kp_nm_per_rad: 1}
reference: [{kind: set_point, theta_rad: 0.4, phi_rad: pi/2}]
"""

# Of GOOD: a part, what stands there instead, and where the schema must find the fault.
BROKEN = [
    ("name: good", "nam: good", []),
    ("name: good\n", "", []),
    ("name: good", "name:", ["name"]),
    ("segments: 2", "segments: two", ["arm", "segments"]),
    ("segments: 2", "segments: 2.5", ["arm", "segments"]),
    ("segments: 2", "segments: 129", ["arm", "segments"]),
    ("segments: 2, ", "", ["arm"]),
    ("length_m", "lenght_m", ["arm"]),
    ("length_m: 0.11", "length_m: 0", ["arm", "length_m"]),
    ("length_m: 0.11", "length_m: []", ["arm", "length_m"]),
    ("length_m: 0.11", "length_m: [0.11, -1]", ["arm", "length_m"]),
    ("length_m: 0.11", "length_m: '0.11'", ["arm", "length_m"]),
    ("mass_kg: 0.15", "mass_kg: 0.15 kg", ["arm", "mass_kg"]),
    ("mass_kg: 0.15", "mass_kg: 101", ["arm", "mass_kg"]),
    ("mass_kg: 0.15", "mass_kg: 0.15, mass_model: Distributed", ["arm", "mass_model"]),
    ("mass_kg: 0.15", "mass_kg: 0.15, gravity_mps2: [0, 0]", ["arm", "gravity_mps2"]),
    ("mass_kg: 0.15", "mass_kg: 0.15, base: {rotation: sideways}", ["arm", "base", "rotation"]),
    ("mass_kg: 0.15", "mass_kg: 0.15, base: {rotation: [[1, 0], [0, 1]]}", ["arm", "base", "rotation"]),
    ("mass_kg: 0.15", "mass_kg: 0.15, base: hanging", ["arm", "base"]),
    ("2*pi/3", "2pi/3", ["actuation", "chambers"]),
    (", gain_nm_per_bar: 0.8", "", ["actuation", "chambers"]),
    ("kp_nm_per_rad: 1", "kp_nm_per_rad: [[1, 1, 1], 1]", ["control", "kp_nm_per_rad"]),
    ("{kp_nm_per_rad: 1}", "{kp_nm_per_rad: 1, terms: {coriolis: yes}}", ["control", "terms", "coriolis"]),
    ("{kp_nm_per_rad: 1}", "{}", ["control"]),
    ("kind: set_point", "kind: setpoint", ["reference", 0]),
    ("kind: set_point, ", "", ["reference", 0]),
    ("theta_rad: 0.4", "theta_rad: 0.4, rise_s: 2", ["reference", 0]),
    ("reference: [", "run: 3\nreference: [", ["run"]),
    ("reference: [", "daemon: {realtime: {cpu: none}}\nreference: [", ["daemon", "realtime", "cpu"]),
    ("reference: [", "daemon: {safety: {hold_after_s: soon}}\nreference: [", ["daemon", "safety", "hold_after_s"]),
    ("reference: [", "daemon: {lcm: {status_channel: ''}}\nreference: [", ["daemon", "lcm", "status_channel"]),
    ("reference: [", "valves: {registers: {control_word: -1}}\nreference: [", ["valves", "registers", "control_word"]),
    ("reference: [", "plant: {loads: [{force: [0, 0, 1]}]}\nreference: [", ["plant", "loads", 0]),
    ("reference: [", "include: [a, b]\nreference: [", ["include"]),
]

# Every form that a value can take, none of which an editor may complain about.
ALLOWED = [
    ("name: good", "name: 7"),
    ("length_m: 0.11", "length_m: [0.11, 1.2e-1]"),
    ("mass_kg: 0.15", "mass_kg: .15, radius_m: 0"),
    ("mass_kg: 0.15", "mass_kg: 1/8"),
    ("length_m: 0.11", "length_m: [1/8, +0.1e0/.9]"),
    ("mass_kg: 0.15", "mass_kg: 0.15, base: {rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}"),
    ("2*pi/3", "+2.0*pi/3"),
    ("2*pi/3, 4*pi/3", "0.7*pi, -0.6*pi"),
    ("chambers: {angle_rad: [0, 2*pi/3, 4*pi/3], gain_nm_per_bar: 0.8}",
     "chambers: [{angle_rad: [0, 2, 4], gain_nm_per_bar: 1}, {angle_rad: [1, 3, 5, 6], gain_nm_per_bar: [1, 2, 3, 4]}]"),
    ("{chambers: {angle_rad: [0, 2*pi/3, 4*pi/3], gain_nm_per_bar: 0.8}}", "{kind: torque, max_torque_nm: 3}"),
    ("kp_nm_per_rad: 1", "kp_nm_per_rad: [1, [1, 0.5]], ki_nm_per_rad_s: 0"),
    ("theta_rad: 0.4, phi_rad: pi/2", "u_rad: [[0.1, 0.2], [0, 0]]"),
    ("theta_rad: 0.4, phi_rad: pi/2", "duration_s: 3, theta_rad: [0.1, -0.2]}, {kind: live, timeout_s: 1"),
    ("kind: set_point, theta_rad: 0.4, phi_rad: pi/2", "kind: paper, theta_rad: 0.4, rise_s: 2"),
    ("kind: set_point, theta_rad: 0.4, phi_rad: pi/2", "kind: way_points, points: [{time_s: 0, theta_rad: 0}, {time_s: 9, u_rad: 0}]"),
    ("kind: set_point, theta_rad: 0.4, phi_rad: pi/2", "kind: tip_point, centre_m: [0, 0, -0.2]"),
    ("reference: [", "daemon: {realtime: {cpu: 3}, bodies: {base_id: fixed}}\nreference: ["),
    ("reference: [", "daemon: {mocap: {source: rigid_transform}, bodies: {segment_plates: [{name: a}, {name: b}]}}\nreference: ["),
    ("reference: [", "plant: {mismatch: {mass_factor: [1, 2]}, loads: [{force_n: [1, 0, 0]}], arm: {mass_kg: 1}}\nreference: ["),
]


def read(text):
    return yaml.load(text, Loader=Yaml12)


def first_line(path):
    return path.read_text(encoding="utf-8").splitlines()[0]


class Schema(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
        jsonschema.Draft7Validator.check_schema(schema)
        self.validator = jsonschema.Draft7Validator(schema)

    def softarm(self, *arguments):
        return subprocess.run([SOFTARM, *arguments], check=False, capture_output=True, text=True)

    def check_text(self, text):
        file = self.folder / "experiment.yaml"
        file.write_text(text, encoding="utf-8")
        return self.softarm("check", "--no-loop", file)

    def faults(self, text):
        return [list(error.absolute_path) for error in self.validator.iter_errors(read(text))]

    def test_it_is_what_the_program_prints(self):
        printed = self.softarm("check", "--schema")
        self.assertEqual(printed.returncode, 0)
        self.assertEqual(printed.stdout, SCHEMA.read_text(encoding="utf-8"), "softarm check --schema > config/experiment.schema.json")

    def test_shipped_experiments_name_it_and_are_valid(self):
        experiments = 0
        for path in sorted((ROOT / "config").rglob("*.yaml")):
            with self.subTest(path=path):
                checked = self.softarm("check", "--no-loop", path)
                if checked.returncode != 0:  # the map of a recording
                    self.assertIn("recordings", path.parts)
                    continue
                experiments += 1
                self.assertEqual(first_line(path), FIRST_LINE + os.path.relpath(SCHEMA, path.parent))
                self.assertEqual(self.faults(path.read_text(encoding="utf-8")), [])
                self.assertEqual(self.faults(checked.stdout), [], "in full")
        self.assertGreater(experiments, 20)

    def test_broken_files_are_refused_where_they_are_broken(self):
        self.assertEqual(self.faults(GOOD), [])
        for good, bad, where in BROKEN:
            with self.subTest(bad=bad):
                self.assertEqual(GOOD.count(good), 1)
                text = GOOD.replace(good, bad)
                self.assertEqual(self.check_text(text).returncode, 78)
                faults = self.faults(text)
                self.assertTrue(any(fault[:len(where)] == where for fault in faults), f"{faults}, not {where}")

    def test_it_allows_what_the_program_allows(self):
        for good, other in ALLOWED:
            with self.subTest(other=other):
                self.assertEqual(GOOD.count(good), 1)
                text = GOOD.replace(good, other)
                checked = self.check_text(text)
                self.assertEqual(checked.returncode, 0, checked.stderr)
                self.assertEqual(self.faults(text), [])

    def test_a_file_that_includes_another_need_not_be_whole(self):
        self.assertEqual(self.faults("include: good.yaml\narm: {mass_kg: 0.2}\nactuation: {chambers: {gain_nm_per_bar: 1}}\n"), [])
        self.assertNotEqual(self.faults("include: good.yaml\narm: {mas_kg: 0.2}\n"), [])
        self.assertNotEqual(self.faults("name: alone\narm: {mass_kg: 0.2}\n"), [])

    def test_keys_are_explained_with_unit_range_and_default(self):
        safety = self.validator.schema["properties"]["daemon"]["properties"]["safety"]["properties"]
        period = safety["frame_period_s"]
        self.assertIn("(a number in (0, 0.2] s)", period["description"])
        self.assertEqual((period["type"], period["exclusiveMinimum"], period["maximum"], period["default"]), (["number", "string"], 0, 0.2, 0.005))
        self.assertEqual(safety["arming"]["enum"], ["automatic", "explicit"])
        self.assertEqual(safety["valve_readback"]["type"], "boolean")
        self.assertEqual(safety["good_frames"]["type"], "integer")


if __name__ == "__main__":
    SOFTARM = sys.argv.pop(1)
    unittest.main(verbosity=2)
