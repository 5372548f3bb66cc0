"""softarm identify --live against the simulated arm: it plays only within its limits, and vents. Argument: folder of the programs."""
import pathlib
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from running_arm import PATIENCE_S, main_at_once, own_url, skip_without_multicast, start, wait_for, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))
SLEW_BAR_PER_S = 4
BUSY = "no frame with every segment for"  # on a machine too busy for the simulated arm

skip_without_multicast()
if shutil.which("lcm-logger") is None:
    print("skipped: lcm-logger is not installed (tools/install_packages)")
    sys.exit(77)


def commands(log):
    """Time in s and pressures in bar of every command in a log of lcm-logger."""
    data, at, found = log.read_bytes(), 0, []
    while at + 28 <= len(data):
        sync, _, _, length, size = struct.unpack_from(">IqqII", data, at)
        assert sync == 0xEDA1DA01
        channel = data[at + 28:at + 28 + length]
        at += 28 + length
        if channel == b"SOFTARM_PRESSURE_COMMAND":
            _, _, time_us, _, shadow, count = struct.unpack_from(">qqqibh", data, at)
            assert shadow == 0
            found.append((1e-6 * time_us, struct.unpack_from(f">{count}f", data, at + 31)))
        at += size
    return found


def mark(log, url, word):
    """Sends a message of one word until the logger has written it: it receives, and has written what came before."""
    group, port = re.match(r"udpm://([\d.]+):(\d+)", url).groups()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)

        def written():
            sender.sendto(struct.pack(">II", 0x4c433032, 0) + b"MARK\0" + word, (group, int(port)))  # LCM's short message
            return log.exists() and b"MARK" + word in log.read_bytes()

        wait_for(written, f"the logger hears {word}")


class IdentifyLive(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def play(self, limits, meanwhile=None, arm=True):
        """What `identify` prints, its exit code, and what it commanded. MEANWHILE gets it and the arm during the first step."""
        url = own_url()
        config = write_config(self.folder, "one_segment.yaml", url, f"actuation: {{slew_bar_per_s: {SLEW_BAR_PER_S}}}\n"
                              f"identification: {{steps_bar: [0.4], hold_s: 20, {limits}}}\n")
        log, written = self.folder / "commands.log", self.folder / "identified.yaml"
        log.unlink(missing_ok=True)
        plant = start(self, self.folder, PROGRAMS / "softarm-plant", config) if arm else None
        logger = subprocess.Popen(["lcm-logger", "--quiet", "--lcm-url", url, "--channel", "SOFTARM_PRESSURE_COMMAND|MARK", log],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        mark(log, url, b"before")
        output = self.folder / "printed.txt"
        with open(output, "w", encoding="utf-8") as file:
            identify = subprocess.Popen([PROGRAMS / "softarm", "identify", config, "--live", "--output", written], stdout=file,
                                        stderr=file)
            try:
                if meanwhile:
                    wait_for(lambda: "step 1 of" in output.read_text(encoding="utf-8"), "the first step")
                    time.sleep(0.3)  # for three times as long as the step rises
                    meanwhile(identify, plant)
                code = identify.wait(timeout=PATIENCE_S)
            finally:
                identify.kill()
                identify.wait()
                mark(log, url, b"after")
                logger.terminate()
                logger.wait()
                if plant:
                    plant.kill()
                    plant.wait()
        self.assertFalse(written.exists())
        return code, output.read_text(encoding="utf-8"), commands(log)

    def expect_vented(self, why, limits, meanwhile=None):
        for _ in range(5):
            code, printed, sent = self.play(limits, meanwhile)
            if BUSY not in printed:
                break
        self.assertEqual(code, 1, printed)
        self.assertRegex(printed, "vented, nothing identified: " + why)
        pushed = [k for k, (_, bar) in enumerate(sent) if any(bar)]
        self.assertTrue(pushed, printed)
        self.assertLess(max(max(bar) for _, bar in sent), 0.4 + 1e-6)
        for (before_s, before), (now_s, bar) in zip(sent, sent[1:]):
            self.assertLess(max(b - a for a, b in zip(before, bar)), SLEW_BAR_PER_S * (now_s - before_s) + 0.005)
        after = [time_s for time_s, _ in sent[pushed[-1] + 1:]]
        self.assertGreater(after[-1] - after[0], 0.9)  # zero for a second, as documented

    def test_a_bend_beyond_the_limit_vents(self):
        self.expect_vented(r"a segment bends by 0\.\d+ rad, beyond identification\.max_theta_rad of 0\.05 rad",
                           "max_theta_rad: 0.05")

    def test_a_speed_beyond_the_limit_vents(self):
        self.expect_vented(r"a segment moves at [\d.]+ rad/s, beyond identification\.max_speed_radps of 0\.2 rad/s",
                           "max_speed_radps: 0.2")

    def test_an_interrupt_vents(self):
        self.expect_vented("stopped", "max_theta_rad: 3", lambda identify, _: identify.send_signal(signal.SIGINT))

    def test_an_arm_that_is_not_seen_any_more_is_vented(self):
        code, printed, sent = self.play("max_theta_rad: 3", lambda _, plant: plant.send_signal(signal.SIGSTOP))
        self.assertEqual(code, 1, printed)
        self.assertIn("vented, nothing identified: no frame with every segment for 200 ms", printed)
        self.assertFalse(any(sent[-1][1]))
        self.assertTrue(any(any(bar) for _, bar in sent))

    def test_without_frames_nothing_is_inflated(self):
        code, printed, sent = self.play("max_theta_rad: 3", arm=False)
        self.assertEqual(code, 1, printed)
        self.assertIn("no frame with every segment on", printed)
        self.assertIn("is motion capture running", printed)
        self.assertTrue(sent)
        self.assertFalse(any(any(bar) for _, bar in sent))


if __name__ == "__main__":
    main_at_once()
