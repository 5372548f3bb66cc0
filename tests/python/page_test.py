"""The pages a browser shows, in a headless Chromium: report.html without any server, `softarm view` of a recorded and of a live arm.

usage: page_test.py BIN_DIR
"""

import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/scripts"), str(ROOT / "build/release/python")]
from running_arm import SAFETY, go_on_in_our_python, own_url, skip_without_multicast, start, wait_for, write_config  # noqa: E402

go_on_in_our_python()
import browser  # noqa: E402
import numpy as np  # noqa: E402
import PIL.Image  # noqa: E402
import softarm  # noqa: E402
import softarm.view  # noqa: E402

if browser.program() is None:
    print("skipped: there is no Chromium here (tools/install_packages --browser)")
    sys.exit(77)
BIN = pathlib.Path(sys.argv.pop())
SOFTARM = BIN / "softarm"
CONFIG = ROOT / "config/paper_arm.yaml"


def recorded(folder, *more):
    subprocess.run(
        [SOFTARM, "run", CONFIG, "--duration", "3", "--out", folder, *more], check=True, capture_output=True
    )
    return softarm.view.read_log(folder, softarm.load_experiment(CONFIG), CONFIG)


class Pages(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def test_the_report_plays_without_a_server(self):
        pictures = recorded(self.folder)
        arm = softarm.Arm(softarm.load_experiment(CONFIG))
        with browser.Page(f"file://{self.folder}/report.html") as page:
            page.wait("window.softarmPlayer && softarmPlayer.tip")
            first = page.value("softarmPlayer.time")
            page.wait(f"softarmPlayer.time > {first} + 0.05", "motion")
            page.click("pause")
            for share in (0.2, 0.5, 0.9):
                page.value(f"(s => {{ s.value = {share}; s.oninput(); }})(document.getElementById('time'))")
                shown_s, tip = page.value("softarmPlayer.time"), page.value("softarmPlayer.tip")
                picture = min(pictures, key=lambda each: abs(each.t_s - shown_s))
                # Frames lie 1/15 s apart, points are stored to 0.1 mm.
                np.testing.assert_allclose(tip, arm.tip(picture.u), atol=3e-3)
            fetched = page.value("performance.getEntriesByType('resource').map(e => e.name).filter(n => !n.startsWith('data:'))")
            self.assertEqual(fetched, [], "one file has everything")
            self.assertEqual(page.errors, [])
            self.assertNotIn("not ACTIVE", page.value("document.body.innerText"))

    def test_the_tip_is_drawn_where_the_arm_is(self):
        pictures = recorded(self.folder, "--no-plots")
        experiment = softarm.load_experiment(CONFIG)
        arm = softarm.Arm(experiment)
        view = softarm.view.View(experiment, "127.0.0.1", 0)
        self.addCleanup(view.server.stop)
        size = (1100, 900)
        with browser.Page(f"http://127.0.0.1:{view.server.get_port()}/", size) as page:
            wait_for(lambda: view.server.get_clients(), "a client")
            (client,) = view.server.get_clients().values()
            for picture in (pictures[0], pictures[len(pictures) // 2], pictures[-1]):
                view.show(picture)
                text = ", ".join(f"{1e3 * value:.1f}" for value in arm.tip(picture.u))
                page.wait(f"(document.body?.innerText ?? '').includes({text!r})", f"the tip's place {text}")

                def seen(tip=arm.tip(picture.u)):
                    wanted = self.projected(client.camera, tip)  # the camera arrives a little later than the page
                    found = self.orange(page.screenshot(), wanted)
                    return found is not None and np.linalg.norm(found - wanted) < 4.0

                wait_for(seen, f"a tip where the camera would see {text}")
            self.assertEqual(page.errors, [])

    def test_a_recorded_run_plays_and_pauses(self):
        recorded(self.folder, "--no-plots")
        player = subprocess.Popen(
            [SOFTARM, "view", CONFIG, "--log", self.folder, "--port", "0"], stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self.addCleanup(player.stdout.close)
        self.addCleanup(player.wait, 30)
        self.addCleanup(player.terminate)
        url = next(found[1] for line in player.stdout if (found := re.search(r"(http://\S+)", line)))
        text = "[...document.querySelectorAll('p')].map(p => p.textContent).find(t => t.includes('tip ['))"
        label = "[...document.querySelectorAll('label')].find(l => l.textContent === 'pause')"  # viser has others
        pause = f"document.getElementById({label}.htmlFor).click()"
        with browser.Page(url) as page:
            first = page.wait(text)
            page.wait(f"{text} !== {first!r}", "motion")
            page.value(pause)

            def still():
                before = page.value(text)
                time.sleep(0.5)  # fifteen pictures
                return page.value(text) == before

            wait_for(still, "a pause")
            page.value(pause)
            paused = page.value(text)
            page.wait(f"{text} !== {paused!r}", "motion again")
            self.assertEqual(page.errors, [])

    @staticmethod
    def projected(camera, point):
        """Pixel of a point in the world, in a picture of the camera's own size; its z axis looks ahead, y down."""
        w, x, y, z = camera.wxyz
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        ahead = rotation.T @ (point - camera.position)
        focal = 0.5 * camera.image_height / np.tan(0.5 * camera.fov)
        return focal * ahead[:2] / ahead[2] + 0.5 * np.array([camera.image_width, camera.image_height])

    @staticmethod
    def orange(png, near, reach=40):
        """Middle of the pixels of the tip's colour around a place, (x, y); None where there are too few."""
        r, g, b = np.moveaxis(np.asarray(PIL.Image.open(io.BytesIO(png)).convert("RGB")).astype(int), -1, 0)
        rows, columns = np.nonzero((r > 150) & (r > g + 80) & (g > b + 20))
        close = (abs(columns - near[0]) < reach) & (abs(rows - near[1]) < reach)
        return np.array([columns[close].mean(), rows[close].mean()]) if np.count_nonzero(close) > 40 else None

    def test_a_live_arm_and_its_buttons(self):
        skip_without_multicast()
        config = write_config(self.folder, "one_segment.yaml", own_url(), safety=SAFETY + ", arming: explicit")
        start(self, self.folder, BIN / "softarm-plant", config)
        start(self, self.folder, BIN / "softarmd", config)
        page = subprocess.Popen(
            [SOFTARM, "view", config, "--port", "0", "--control"], stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self.addCleanup(page.stdout.close)
        self.addCleanup(page.wait, 30)
        self.addCleanup(page.terminate)
        url = next(found[1] for line in page.stdout if (found := re.search(r"(http://\S+)", line)))
        client = softarm.ArmClient(softarm.load_experiment(config))

        def mode():
            client.wait_for_status(1.0)
            return client.status.mode

        with browser.Page(url) as shown:
            def says(text):
                shown.wait(f"(document.body?.innerText ?? '').includes({text!r})")

            says("WAIT_FRAMES")
            shown.click("arm")
            says("arm this arm?")
            self.assertNotEqual(mode(), "ACTIVE", "armed before the question was answered")
            shown.click("yes")
            says("ACTIVE")
            wait_for(lambda: mode() == "ACTIVE", "ACTIVE")
            shown.click("disarm")
            shown.click("no")
            self.assertEqual(mode(), "ACTIVE")
            shown.click("emergency stop")
            wait_for(lambda: mode() == "FAULT", "FAULT")
            says("FAULT")
            self.assertEqual(shown.errors, [])

    def test_sliders_fill_the_chambers_of_a_simulated_arm_without_a_daemon(self):
        skip_without_multicast()
        config = write_config(self.folder, "one_segment.yaml", own_url())
        plant = start(self, self.folder, BIN / "softarm-plant", config)
        experiment = softarm.load_experiment(config)
        client = softarm.ArmClient(experiment)
        view = softarm.view.View(experiment, "127.0.0.1", 0)
        self.addCleanup(view.server.stop)
        hand = view.add_hand(experiment)
        pictures = softarm.view.live_pictures(client, hand.step)

        def shown_until(reached, what):
            end = time.monotonic() + 60.0
            for picture in pictures:
                if picture is not None:
                    view.show(picture)
                    if reached(picture):
                        return
                self.assertLess(time.monotonic(), end, what)

        with browser.Page(f"http://127.0.0.1:{view.server.get_port()}/") as page:
            shown_until(lambda picture: picture.mode == "NO DAEMON" and hand.folder.visible, "the sliders")
            page.wait("(document.body?.innerText ?? '').includes('NO DAEMON')")
            page.wait("(document.body?.innerText ?? '').includes('fill the chambers')")
            hand.sliders[0].value = 0.2
            shown_until(lambda picture: picture.pressure_bar.max() == 0.0, "vented as long as nobody fills it")
            hand.fill.value = True
            shown_until(lambda picture: abs(picture.pressure_bar[0] - 0.2) < 0.01, "0.2 bar in the first chamber")
            shown_until(lambda picture: picture.u.size == 2 and np.abs(picture.u).max() > 0.05, "a bent arm")
            with self.assertRaises(RuntimeError, msg="the command channel is taken"):
                softarm.ArmClient(experiment).lock_commands()
            hand.fill.value = False
            shown_until(lambda picture: picture.pressure_bar.max() < 0.01, "a vented arm")
            softarm.ArmClient(experiment).lock_commands()
            self.assertIsNone(plant.poll())
            self.assertEqual(page.errors, [])

    def test_the_demonstration_in_the_browser(self):
        demo = subprocess.Popen(
            [ROOT / "tools/demo", "--view", "--duration", "15", "--out", self.folder / "demo"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": ""},
        )
        self.addCleanup(demo.stdout.close)
        self.addCleanup(demo.wait, 60)
        self.addCleanup(demo.terminate)
        said = []
        url = next((found[1] for line in demo.stdout if said.append(line) or (found := re.search(r"the arm is at (http://\S+)", line))), None)
        self.assertIsNotNone(url, "".join(said))
        with browser.Page(url) as page:
            page.wait("(document.body?.innerText ?? '').includes('ACTIVE')")
            self.assertEqual(page.errors, [])
        rest = demo.stdout.read()
        self.assertEqual(demo.wait(60), 0, rest)
        self.assertTrue((self.folder / "demo/report.html").exists(), rest)


if __name__ == "__main__":
    unittest.main()
