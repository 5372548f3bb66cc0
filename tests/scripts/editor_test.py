"""What an editor shows while an experiment is written: a YAML language server reads config/experiment.schema.json and is asked
what an editor asks it. It is found by the first line of the file, as in config/."""
import json
import pathlib
import shutil
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SERVER = ROOT / "build/yaml_language_server/node_modules/yaml-language-server/bin/yaml-language-server"

FIRST_LINE = "# yaml-language-server: $schema=experiment.schema.json\n"
GOOD = """name: good
arm: {segments: 2, length_m: 0.11, mass_kg: 0.15, stiffness_nm_per_rad: 0.6, damping_nms_per_rad: 0.03}
actuation: {chambers: {angle_rad: [0, 2*pi/3, 4*pi/3], gain_nm_per_bar: 0.8}}
control: {kp_nm_per_rad: 1}
reference:
  - {kind: set_point, theta_rad: 0.4, phi_rad: pi/2}
daemon:
  safety:
    frame_period_s: 0.005
"""


class LanguageServer:
    """One that runs, spoken to as the language server protocol prescribes: a header with the length, and JSON."""

    def __init__(self, command, folder):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.folder = folder
        self.requests = 0
        self.documents = 0
        self.diagnostics = {}  # those of every document, when they have come
        markdown = {"contentFormat": ["plaintext"]}
        self.request("initialize", {"processId": None, "rootUri": folder.as_uri(), "workspaceFolders": None,
                                    "capabilities": {"textDocument": {"hover": markdown, "publishDiagnostics": {}}}})
        self.send("initialized", {})
        settings = {"validate": True, "hover": True, "completion": True, "schemaStore": {"enable": False}}  # no network
        self.send("workspace/didChangeConfiguration", {"settings": {"yaml": settings}})

    def close(self):
        self.request("shutdown", None)
        self.send("exit", None)
        self.process.communicate(timeout=60)

    def write(self, message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def read(self):
        length = 0
        for line in iter(self.process.stdout.readline, b"\r\n"):
            if not line:
                raise EOFError("the language server has ended")
            name, value = line.split(b":")
            length = int(value) if name == b"Content-Length" else length
        message = json.loads(self.process.stdout.read(length))
        if message.get("method") == "textDocument/publishDiagnostics":
            self.diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]
        elif "method" in message and "id" in message:  # it asks us
            self.write({"id": message["id"], "result": None})
        return message

    def send(self, method, parameters):
        self.write({"method": method, "params": parameters})

    def request(self, method, parameters):
        self.requests += 1
        self.write({"id": self.requests, "method": method, "params": parameters})
        while True:
            message = self.read()
            if message.get("id") == self.requests and "method" not in message:
                return message["result"]

    def open(self, text):
        """A new document beside those in config/, which is not written there."""
        self.documents += 1
        uri = (self.folder / f"document_{self.documents}.yaml").as_uri()
        self.send("textDocument/didOpen", {"textDocument": {"uri": uri, "languageId": "yaml", "version": 1, "text": text}})
        return uri

    def complaints(self, text):
        """Line (from 0) and text of what it finds wrong."""
        uri = self.open(text)
        while uri not in self.diagnostics:
            self.read()
        return [(found["range"]["start"]["line"], found["message"]) for found in self.diagnostics[uri]]

    def ask(self, method, text):
        """What it answers about the place of the | in the text."""
        before, after = text.split("|")
        place = {"line": before.count("\n"), "character": len(before) - before.rfind("\n") - 1}
        return self.request(f"textDocument/{method}", {"textDocument": {"uri": self.open(before + after)}, "position": place})

    def completions(self, text):
        return {item["label"]: item for item in self.ask("completion", text)["items"]}

    def hover(self, text):
        return self.ask("hover", text)["contents"]["value"].replace("\\", "")  # of Markdown


class Editor(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = LanguageServer(["node", SERVER, "--stdio"], ROOT / "config")
        cls.addClassCleanup(cls.server.close)

    def assert_complaint(self, text, line_of, message):
        complaints = self.server.complaints(FIRST_LINE + text)
        line = (FIRST_LINE + text)[:(FIRST_LINE + text).index(line_of)].count("\n")
        self.assertTrue(any(at == line and message in what for at, what in complaints), complaints)

    def test_nothing_is_wrong_with_what_we_ship(self):
        self.assertEqual(self.server.complaints(FIRST_LINE + GOOD), [])
        for path in sorted((ROOT / "config").glob("*.yaml")):
            with self.subTest(path=path):
                text = path.read_text(encoding="utf-8")
                self.assertTrue(text.startswith(FIRST_LINE))
                self.assertEqual(self.server.complaints(text), [])

    def test_a_misspelt_key_is_underlined(self):
        self.assert_complaint(GOOD.replace("mass_kg", "mas_kg"), "mas_kg", "mas_kg is not allowed")
        self.assert_complaint(GOOD.replace("mass_kg", "mas_kg"), "arm:", 'Missing property "mass_kg"')
        self.assert_complaint(GOOD.replace("frame_period_s", "frame_periods"), "frame_periods", "frame_periods is not allowed")
        self.assert_complaint(GOOD.replace("theta_rad", "theta_deg"), "theta_deg", "theta_deg is not allowed")

    def test_a_wrong_value_is_underlined(self):
        self.assert_complaint(GOOD.replace("0.005", "fast"), "fast", "Incorrect type")
        self.assert_complaint(GOOD.replace("0.005", "11"), "11\n", "maximum of 10")
        self.assert_complaint(GOOD.replace("0.005", "0"), "frame_period_s", "exclusive minimum of 0")
        self.assert_complaint(GOOD + "    arming: by hand\n", "by hand", '"automatic", "explicit"')
        self.assert_complaint(GOOD.replace("set_point", "setpoint"), "setpoint", '"set_point", "paper", "way_points", "live"')

    def test_keys_are_completed_where_they_belong(self):
        keys = self.server.completions(FIRST_LINE + GOOD + "    |\n")
        self.assertTrue({"arming", "hold_after_s", "vent_after_s", "valve_readback"} <= set(keys), sorted(keys))
        self.assertNotIn("frame_period_s", keys)  # which is there
        self.assertNotIn("kp_nm_per_rad", keys)  # which belongs elsewhere
        self.assertIn("operator's arm", json.dumps(keys["arming"]["documentation"]))
        self.assertTrue({"theta_rad", "rise_s", "phase_step_rad"} <=
                        set(self.server.completions(FIRST_LINE + "reference:\n  - kind: paper\n    |\n")))
        self.assertTrue({"arm", "actuation", "control", "plant", "include"} <= set(self.server.completions(FIRST_LINE + "name: a\n|\n")))

    def test_values_are_completed(self):
        self.assertEqual(set(self.server.completions(FIRST_LINE + GOOD + "    arming: |\n")), {"automatic", "explicit"})
        self.assertTrue({"true", "false"} <= set(self.server.completions(FIRST_LINE + GOOD + "    valve_readback: |\n")))
        self.assertTrue({"set_point", "paper", "way_points", "live", "tip_lemniscate"} <=
                        set(self.server.completions(FIRST_LINE + "reference:\n  - kind: |\n")))

    def test_a_key_is_explained_with_its_unit(self):
        self.assertIn("nominal, of the motion capture (a number in (0, 10] s)",
                      self.server.hover(FIRST_LINE + GOOD.replace("frame_period_s", "frame|_period_s")))
        self.assertIn("N m/rad", self.server.hover(FIRST_LINE + GOOD.replace("stiffness", "stiff|ness")))


if __name__ == "__main__":
    if not SERVER.exists() or shutil.which("node") is None:
        print("skipped: tools/yaml_language_server was not run (it fetches a YAML language server)")
        sys.exit(77)
    unittest.main(verbosity=2)
