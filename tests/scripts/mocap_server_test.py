"""The daemon takes frames from a motion-capture server, and other people's clients take those of the simulated arm. Argument: folder of
the programs.

The clients are the packages natnet and qtm-rt of PyPI, in the Python of tools/python_environment; their tests are skipped where that was
not made."""
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

from running_arm import PYTHON, main_at_once, own_url, skip_without_multicast, start, tracks_within, wait_for, write_config

PROGRAMS = pathlib.Path(sys.argv.pop(1))
# As with frames over LCM (mocap_test.py); OptiTrack and Qualisys send floats.
BOUND_RAD = 0.01
FIRST_PORT = 20000 + 40 * (os.getpid() % 250)

skip_without_multicast()

NATNET_CLIENT = """
import sys, time
from natnet import NatNetClient
port, multicast, most = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
frames, models = [], []
client = NatNetClient("127.0.0.1", "127.0.0.1", multicast or "239.255.42.99", port, port + 1, bool(multicast))
client.on_data_frame_received_event.handlers.append(frames.append)
client.on_data_description_received_event.handlers.append(models.append)
client.connect(timeout=60)
client.request_modeldef()
while len(frames) < most or not models:
    client.update_sync()
    time.sleep(0.002)
bodies = {model.id_num: model.name for model in models[0].rigid_bodies}
frame = frames[-1]
print(client.protocol_version, [bodies[each.id_num] for each in frame.rigid_bodies], all(each.tracking_valid for each in frame.rigid_bodies))
print(frame.rigid_bodies[-1].pos[1], frames[-1].prefix.frame_number - frames[0].prefix.frame_number,
      frames[-1].suffix.timestamp - frames[0].suffix.timestamp)
client.shutdown()
"""
QTM_CLIENT = """
import asyncio, sys
import xml.etree.ElementTree as tree
import qtm_rt
async def main():
    connection = None
    while connection is None:
        connection = await qtm_rt.connect("127.0.0.1", int(sys.argv[1]), version="1.25", timeout=60)
        await asyncio.sleep(0.1)
    names = [each.text for each in tree.fromstring(await connection.get_parameters(["6d"])).iter("Name")]
    packets = asyncio.Queue()
    await connection.stream_frames(components=["6dres"], on_packet=packets.put_nowait)
    seen = [await packets.get() for _ in range(int(sys.argv[2]))]
    position, rotation, residual = seen[-1].get_6d_residual()[1][-1]
    print("1.25", names, residual.residual == 0)
    print(position.z / 1e3, seen[-1].framenumber - seen[0].framenumber, 1e-6 * (seen[-1].timestamp - seen[0].timestamp))
asyncio.run(main())
"""


class MocapServer(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.url = own_url()

    def config(self, source, port, more="", version=""):
        settings = f"port: {port}{', ' + more if more else ''}{', version: ' + version if version else ''}"
        return write_config(self.folder, f"paper_arm_{source}.yaml", self.url, daemon=f"  mocap: {{{settings}}}\n")

    def closes(self, config):
        """The daemon comes first, so it connects to a server that begins later."""
        start(self, self.folder, PROGRAMS / "softarmd", config)
        wait_for(lambda: "no answer" in (self.folder / "softarmd.txt").read_text(), "no line about the server")
        start(self, self.folder, PROGRAMS / "softarm-plant", config)
        tracks_within(self, PROGRAMS, config, BOUND_RAD)
        self.assertIn("frames arrive", (self.folder / "softarmd.txt").read_text())

    def understood(self, config, client, *arguments):
        if not PYTHON.exists() or subprocess.run([PYTHON, "-c", "import natnet, qtm_rt"], capture_output=True, check=False).returncode != 0:
            self.skipTest("tools/python_environment was not run")
        start(self, self.folder, PROGRAMS / "softarm-plant", config)
        reply = subprocess.run([PYTHON, "-c", client, *map(str, arguments), "60"], capture_output=True, text=True, timeout=100, check=False)
        self.assertEqual(reply.returncode, 0, reply.stderr)
        first, second = reply.stdout.splitlines()[-2:]
        self.assertIn("['base', 'segment_1', 'segment_2', 'segment_3'] True", first)
        tip, frames, time_s = map(float, second.split())
        self.assertAlmostEqual(tip, -0.33, delta=0.02)  # the arm hangs
        self.assertGreaterEqual(frames, 59)
        self.assertAlmostEqual(time_s / frames, 0.005, delta=1e-5)  # the stamps are those of exposure: 200 frames a second
        return first

    def test_the_loop_closes_through_natnet_unicast(self):
        self.closes(self.config("natnet", FIRST_PORT))

    def test_the_loop_closes_through_natnet_3_multicast(self):
        port = FIRST_PORT + 2
        self.closes(self.config("natnet", port, f"multicast: 239.255.42.{1 + os.getpid() % 250}, data_port: {port + 1}, local_address: 127.0.0.1",
                                "3.1"))

    def test_the_loop_closes_through_qtm(self):
        self.closes(self.config("qtm", FIRST_PORT + 4))

    def test_natnet_of_pypi_understands_the_simulated_server(self):
        for k, version in enumerate(("3.0", "4.0", "4.1", "4.2")):
            with self.subTest(version):
                port = FIRST_PORT + 6 + 2 * k
                self.assertIn(version, self.understood(self.config("natnet", port, version=version), NATNET_CLIENT, port, ""))
                self.doCleanups()
                self.setUp()

    def test_qtm_rt_of_pypi_understands_the_simulated_server(self):
        port = FIRST_PORT + 16
        self.understood(self.config("qtm", port), QTM_CLIENT, port)

    def test_a_name_that_the_server_does_not_know_is_reported(self):
        config = self.config("natnet", FIRST_PORT + 18)
        start(self, self.folder, PROGRAMS / "softarm-plant", config)
        other = self.folder / "other.yaml"
        other.write_text(f"include: {config}\ndaemon:\n  bodies:\n    base_plate: {{name: pedestal}}\n", encoding="utf-8")
        start(self, self.folder, PROGRAMS / "softarmd", other)
        wait_for(lambda: "the server knows no body pedestal" in (self.folder / "softarmd.txt").read_text(), "no line about the name")

    def test_hostile_packets_are_counted_and_hurt_nobody(self):
        port = FIRST_PORT + 20
        config = self.config("natnet", port)
        server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(server.close)
        server.bind(("127.0.0.1", port))
        server.settimeout(60)
        daemon = start(self, self.folder, PROGRAMS / "softarmd", config)
        _, client = server.recvfrom(65536)
        info = b"hostile".ljust(256, b"\0") + bytes((1, 0, 0, 0, 4, 1, 0, 0)) + struct.pack("<Q", 10 ** 7)
        server.sendto(struct.pack("<HH", 1, len(info)) + info, client)
        models = b"".join(struct.pack("<ii", 1, len(name) + 1 + 24) + name + b"\0" + struct.pack("<ii3fi", k, -1, 0, 0, 0, 0)
                          for k, name in enumerate((b"base", b"segment_1", b"segment_2", b"segment_3")))
        models = struct.pack("<i", 4) + models
        server.sendto(struct.pack("<HH", 5, len(models)) + models, client)
        for count in (-1, 2 ** 31 - 1, 2 ** 28, 1000):
            for size in (-1, 2 ** 31 - 1, 8):
                frame = struct.pack("<5i", 1, count, size, count, size) + bytes(40)
                server.sendto(struct.pack("<HH", 7, len(frame)) + frame, client)
        wait_for(lambda: "malformed messages refused" in (self.folder / "softarmd.txt").read_text(), "nothing was refused")
        self.assertIsNone(daemon.poll())
        self.assertNotIn("frames arrive", (self.folder / "softarmd.txt").read_text())


if __name__ == "__main__":
    main_at_once()
