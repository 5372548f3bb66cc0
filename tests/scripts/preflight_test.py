"""softarm check --live and softarm jog against running arms, each wrong by one thing. Argument: folder of the programs.

All arms run at once, and each check on a separate port: together they take as long as the longest, and keys are held meanwhile.
"""
import json
import os
import pathlib
import pty
import re
import signal
import subprocess
import sys
import tempfile
import termios
import threading
import time
import unittest

from running_arm import PATIENCE_S, own_url, skip_without_multicast, start, wait_for, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))

skip_without_multicast()

# A short arm, frames that a stalled plant does not lose, and thresholds that a busy machine does not reach by itself.
CAMERA = "plant: {mocap: {rate_hz: 50}}\n"
ARM = "arm: {segments: 2}\n" + CAMERA
SAFETY = "hold_after_s: 1, vent_after_s: 2, frame_period_s: 0.02, frame_latency_s: 0.005"
SOON = ["--seconds", "2", "--pulse", "--hold", "0.45"]


class Arm:
    """A simulated arm with its own LCM port and folder."""

    def __init__(self, test, base="paper_arm.yaml", more=ARM):
        self.test, self.base, self.more = test, base, more
        self.url = own_url()
        temporary = tempfile.TemporaryDirectory()
        test.addClassCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def config(self, name, more=None, daemon=""):
        """An experiment on this arm's port; `more` stands in place of the arm's own keys."""
        return write_config(self.folder, self.base, self.url, self.more if more is None else more, name,
                            SAFETY, daemon)

    def start(self, said, program, *arguments):
        """Returns once the program has said `said`."""
        process = start(self.test, self.folder, PROGRAMS / program, *arguments)
        output = self.folder / f"{program}.txt"
        wait_for(lambda: said in output.read_text(encoding="utf-8"), f"{program}: {said}")
        return process

    def plant(self, *arguments, daemon=""):
        return self.start("motion capture at", "softarm-plant", *arguments, self.config("plant", daemon=daemon))

    def faulty_plant(self, fault, *arguments):
        """With softarm-dev fault between its sensors and us."""
        self.plant("--sensor-suffix", "_CLEAN")
        self.start("", "softarm-dev", "fault", self.config("relay"), fault, "--after", "0", "--for", "100", *arguments)

    def check(self, config, *arguments):
        """Exit code and report."""
        done = subprocess.run([PROGRAMS / "softarm", "check", config, "--live", *arguments], capture_output=True,
                              text=True, timeout=PATIENCE_S, check=False)
        return done.returncode, done.stdout, done.stderr


SCENES = {}


def scene(body):
    SCENES[body.__name__] = body
    return body


@scene
def right(test):
    arm = Arm(test)
    arm.plant()
    return arm.check(arm.config("right"), *SOON)


@scene
def swapped_chambers(test):
    arm = Arm(test)
    arm.plant()
    return arm.check(arm.config("lab", more=ARM + "actuation: {chambers: {angle_rad: [pi/2, 0, pi, 3*pi/2]}}\n"), *SOON)


@scene
def wrong_settings(test):
    """One arm, checked against configurations with one wrong setting each."""
    arm = Arm(test, more="arm: {segments: 3}\n" + CAMERA)
    arm.plant()
    wrong = {
        "length": arm.config("length", more="arm: {segments: 3, length_m: [0.11, 0.13, 0.11]}\n"),
        "order": arm.config("order", daemon="  bodies: {base_id: 0, segment_ids: [1, 3, 2]}\n"),
        "unseen": arm.config("unseen", daemon="  bodies: {base_id: 0, segment_ids: [1, 2, 7]}\n"),
        "rate": arm.config("rate"),
        "latency": arm.config("latency"),
        "silent": arm.config("silent"),
        "up": arm.config("up", more="arm: {segments: 3, base: {position_m: [0, 0, 0], rotation: standing}}\n"),
    }
    for name, old, new in (("rate", "frame_period_s: 0.02", "frame_period_s: 0.01"),
                           ("latency", "frame_latency_s: 0.005", "frame_latency_s: 0.03"),
                           ("silent", "lcm: {", "lcm: {mocap_channel: ELSEWHERE, ")):
        wrong[name].write_text(wrong[name].read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    running = {name: subprocess.Popen([PROGRAMS / "softarm", "check", config, "--live", "--seconds", "2", "--json"],
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
               for name, config in wrong.items()}
    return {name: (*process.communicate(timeout=PATIENCE_S), process.returncode) for name, process in running.items()}


@scene
def jitter(test):
    arm = Arm(test)
    arm.plant("--sensor-suffix", "_CLEAN")
    config = arm.config("lab")
    config.write_text(config.read_text(encoding="utf-8").replace("hold_after_s: 1", "hold_after_s: 0.1"), encoding="utf-8")
    arm.start("", "softarm-dev", "fault", arm.config("relay"), "delay", "--amount", "0.5", "--after", "2", "--for", "0.5")
    return arm.check(config, "--seconds", "5")


@scene
def units(test):
    arm = Arm(test)
    arm.plant(daemon="  mocap: {unit: mm}\n")
    return arm.check(arm.config("lab"), *SOON)


@scene
def quaternions(test):
    arm = Arm(test)
    arm.plant(daemon="  mocap: {quaternion: xyzw}\n")
    return arm.check(arm.config("lab"), "--seconds", "2")


@scene
def optitrack(test):
    """OptiTrack's frames with y up, which the configuration does not say."""
    arm = Arm(test)
    arm.plant(daemon="  mocap: {source: optitrack, axes: y_up}\n")
    return arm.check(arm.config("lab", daemon="  mocap: {source: optitrack}\n"), "--seconds", "2")


@scene
def vicon(test):
    """A channel a body, and nothing wrong."""
    arm = Arm(test, base="paper_arm_vicon.yaml", more=CAMERA)
    arm.plant()
    return arm.check(arm.config("lab"), "--seconds", "2")


@scene
def mirror(test):
    arm = Arm(test)
    arm.faulty_plant("mirror")
    return arm.check(arm.config("lab"), *SOON)


@scene
def leak(test):
    arm = Arm(test)
    arm.faulty_plant("leak", "--body", "5")
    return arm.check(arm.config("lab"), *SOON)


@scene
def tubes(test):
    """Through softarm-valves and Modbus TCP, with the tubes of the two segments exchanged."""
    port = 30000 + os.getpid() % 20000
    valves = f"valves: {{port: {port}, rate_hz: 50, tolerated_failures: 20, failsafe_timeout_s: 1"
    arm = Arm(test, base="laboratory.yaml", more=ARM + valves + "}\n")
    bodies = "  bodies: {base_id: 0, segment_ids: [1, 2]}\n"
    plant = arm.config("plant", daemon=bodies)
    arm.start("valve terminal at", "softarm-plant", "--modbus", str(port), plant)
    lab = arm.config("lab", more=ARM + valves + ", order: [4, 5, 6, 7, 0, 1, 2, 3]}\n", daemon=bodies)
    arm.start("VENTED", "softarm-valves", lab)
    return arm.check(lab, *SOON)


class Preflight(unittest.TestCase):
    @classmethod
    def play(cls):
        """Every scene in a thread, from now on."""
        cls.outcomes = {}

        def play(name, body):
            try:
                cls.outcomes[name] = body(cls)
            except Exception as error:  # pylint: disable=broad-except
                cls.outcomes[name] = error

        cls.threads = [threading.Thread(target=play, args=each) for each in SCENES.items()]
        for thread in cls.threads:
            thread.start()

    @classmethod
    def setUpClass(cls):
        for thread in cls.threads:
            thread.join()

    def expect(self, name, check, text, others_pass=True):
        outcome = self.outcomes[name]
        self.assertIsInstance(outcome, tuple, outcome)
        code, report, errors = outcome
        self.assertEqual(code, 1, report + errors)
        self.assertRegex(report, rf"(?m)^FAIL +{check} .*{text}.*\. Fix: .+", errors)
        if others_pass:
            self.assertEqual(len(re.findall("^FAIL", report, flags=re.MULTILINE)), 1, report)

    def test_a_right_arm_passes_everything(self):
        code, report, errors = self.outcomes["right"]
        self.assertEqual(code, 0, report + errors)
        self.assertIn("15 passed, 0 failed, 0 not checked", report)
        self.assertIn("THE ARM MOVES", errors)

    def test_wrong_settings(self):
        outcome = self.outcomes["wrong_settings"]
        self.assertIsInstance(outcome, dict, outcome)
        for name, check, text in (("length", "lengths", r"segment 2 is 0\.1[01]\d* m long, 0\.1300 m configured"),
                                  ("order", "order", "end of segment 2 and end of segment 3 are exchanged"),
                                  ("unseen", "bodies", r"end of segment 3 \(id 7\) never seen"),
                                  ("rate", "rate", r"50\.0 Hz, 100\.0 Hz configured"),
                                  ("latency", "latency", r"by our monotonic clock, 30\.0 ms declared"),
                                  ("silent", "bodies", "no frame on ELSEWHERE"),
                                  ("up", "world axes", r"along -z .* should be \+z")):
            with self.subTest(name):
                report, errors, code = outcome[name]
                self.assertEqual(code, 1, report + errors)
                texts = [each["text"] for each in json.loads(report)["findings"]
                         if each["check"] == check and each["verdict"] == "FAIL"]
                self.assertRegex("\n".join(texts), text, report + errors)
                self.assertEqual(json.loads(report)["failed"], 1)

    def test_jitter(self):
        self.expect("jitter", "jitter", r"HOLD after 100\.0 ms, which would have occurred")

    def test_units(self):
        self.expect("units", "units", "positions come in millimetres")
        self.assertIn("no chamber was filled", self.outcomes["units"][2])

    def test_order_of_the_quaternion(self):
        self.expect("quaternions", "quaternions", "w, x, y, z and x, y, z, w are interchanged")

    def test_other_sources(self):
        self.expect("optitrack", "world axes", "should be -z", others_pass=False)
        self.assertIsInstance(self.outcomes["vicon"], tuple, self.outcomes["vicon"])
        _, report, errors = self.outcomes["vicon"]
        # Not the whole report: on a busy machine a body's packet may come too late for its frame.
        for check in ("units", "order", "world axes", "lengths", "rest pose"):
            self.assertRegex(report, rf"(?m)^pass +{check} ", errors)

    def test_handedness(self):
        self.expect("mirror", "handedness", "positions with y reversed")

    def test_valve_map(self):
        self.expect("swapped_chambers", "valve map", "chamber 1 of segment 1 acts as chamber 2 of segment 1")
        self.expect("tubes", "valve map", "chamber 1 of segment 1 acts as chamber 1 of segment 2")
        self.assertIn("valves.order: [0, 1, 2, 3, 4, 5, 6, 7]", self.outcomes["tubes"][1])

    def test_leak(self):
        self.expect("leak", "leaks", r"chamber 2 of segment 2 reaches 0\.\d+ bar of 0\.\d+ bar")


class Jog(unittest.TestCase):
    """A key is held on a terminal of the test's own."""

    def setUp(self):
        self.arm = Arm(type(self))
        self.plant_text = self.arm.folder / "softarm-plant.txt"
        self.arm.plant()
        self.config = self.arm.config("lab")
        self.terminal, self.other_end = pty.openpty()
        self.addCleanup(os.close, self.terminal)
        self.addCleanup(os.close, self.other_end)
        os.set_blocking(self.terminal, False)
        self.shown = ""

    def start(self, *arguments):
        jog = subprocess.Popen([PROGRAMS / "softarm", "jog", self.config, *arguments], stdin=self.other_end,
                               stdout=self.other_end, stderr=self.other_end, start_new_session=True)
        self.addCleanup(jog.wait)
        self.addCleanup(jog.kill)
        return jog

    def look(self):
        try:
            self.shown = (self.shown + os.read(self.terminal, 65536).decode())[-4000:]
        except BlockingIOError:
            pass
        return self.shown.rsplit("\r\x1b[K", 1)[-1]

    def hold_until(self, pattern):
        def reached():
            os.write(self.terminal, b" ")
            time.sleep(0.03)
            return re.search(pattern, self.look())
        wait_for(reached, f"{pattern}; shown: {self.shown}")
        return re.search(pattern, self.look())

    def release_until(self, pattern):
        wait_for(lambda: re.search(pattern, self.look()), f"{pattern}; shown: {self.shown}")

    def test_a_held_key_bends_the_segment_and_a_released_one_vents(self):
        before = termios.tcgetattr(self.other_end)
        jog = self.start("2", "1", "0.1")
        self.hold_until(r"HELD +set 0\.100 bar  measured 0\.(100|099) bar .* u2 \(-0\.(0[5-9]|1\d)\d, [-+]0\.0[01]\d\) rad")
        self.assertNotEqual(termios.tcgetattr(self.other_end), before)
        self.release_until(r"released +set 0\.000 bar  measured 0\.000 bar .* u2 \([-+]0\.00\d, ")
        self.hold_until(r"HELD +set 0\.100 bar")
        jog.send_signal(signal.SIGTERM)
        self.assertEqual(jog.wait(timeout=PATIENCE_S), 0, self.shown)
        self.assertEqual(termios.tcgetattr(self.other_end), before)

        jog = self.start("1", "2", "0.1")
        self.hold_until(r"HELD +set 0\.100 bar  measured 0\.(100|099) bar")
        vented = self.plant_text.read_text(encoding="utf-8").count("vented")
        jog.kill()
        wait_for(lambda: self.plant_text.read_text(encoding="utf-8").count("vented") > vented, "the plant vents")

    def test_what_it_refuses(self):
        jog = self.start("1", "1", "3")
        self.assertEqual(jog.wait(timeout=PATIENCE_S), 64)
        self.release_until(r"at most actuation\.max_pressure_bar of 2 bar, got 3 bar")
        jog = self.start("3", "1", "0.1")
        self.assertEqual(jog.wait(timeout=PATIENCE_S), 64)
        no_terminal = subprocess.run([PROGRAMS / "softarm", "jog", self.config, "1", "1", "0.1"], stdin=subprocess.DEVNULL,
                                     capture_output=True, text=True, check=False)
        self.assertEqual(no_terminal.returncode, 1)
        self.assertIn("standard input is not a terminal", no_terminal.stderr)
        self.arm.start("softarmd", "softarmd", self.config)
        jog = self.start("1", "1", "0.1")
        self.assertEqual(jog.wait(timeout=PATIENCE_S), 75)
        code, report, errors = self.arm.check(self.config, "--pulse")
        self.assertEqual((code, report), (75, ""), errors)


if __name__ == "__main__":
    Preflight.play()  # while keys are held; those tests come first
    unittest.main()
