"""What `softarm view` costs the daemon and how often it draws: figures for docs/results, nothing is asserted.

usage: tools/with_loopback_network build/python/bin/python tests/python/page_cost.py BIN_DIR [ROUNDS] [SECONDS]

Every round runs softarmd and softarm-plant (SCHED_FIFO) for SECONDS without, with the page, and with a browser that shows it, one
after the other, and reads the tick's times that softarmd prints when it ends. The browser counts the texts that the page
received, in each of which t and the tip's place changed.
"""

import os
import pathlib
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/scripts"), str(ROOT / "tests/python")]
import browser  # noqa: E402
from running_arm import own_url, write_config  # noqa: E402

BIN = pathlib.Path(sys.argv[1])
ROUNDS, SECONDS = int((sys.argv[2:3] or ["5"])[0]), float((sys.argv[3:4] or ["10"])[0])
COUNT_TEXTS = """(() => { window.texts = 0; let last = '';
  setInterval(() => { const now = (document.body.innerText.match(/ACTIVE.*tip \\[[^\\]]*\\]/s) ?? [''])[0];
                      if (now !== last) { last = now; ++window.texts; } }, 5); })()"""
COUNT_FRAMES = """(() => { window.frames_drawn = 0;
  const draw = () => { ++window.frames_drawn; requestAnimationFrame(draw); }; requestAnimationFrame(draw); })()"""


def one_run(folder, page, shown):
    """Tick's p50, p99 and lateness' p99 in us, what the page received and drew a second, the page's share of a core."""
    config = write_config(folder, "paper_arm.yaml", own_url())
    environment = {**os.environ, "XDG_STATE_HOME": str(folder)}
    plant = subprocess.Popen(["chrt", "-f", "40", BIN / "softarm-plant", config], env=environment, stderr=subprocess.DEVNULL)
    daemon = subprocess.Popen(
        ["chrt", "-f", "50", BIN / "softarmd", config], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    view, texts, frames, share = None, 0.0, 0.0, 0.0
    if page:
        view = subprocess.Popen([BIN / "softarm", "view", config, "--port", "0"], stdout=subprocess.PIPE, text=True, bufsize=1)
        url = next(found[1] for line in view.stdout if (found := re.search(r"(http://\S+)", line)))
    if shown:
        with browser.Page(url) as seen:
            seen.wait("(document.body?.innerText ?? '').includes('ACTIVE')")
            seen.value(COUNT_TEXTS)
            seen.value(COUNT_FRAMES)
            begin = time.monotonic()
            time.sleep(SECONDS)
            took = time.monotonic() - begin
            texts, frames = seen.value("window.texts") / took, seen.value("window.frames_drawn") / took
    else:
        time.sleep(SECONDS)
    if view:
        fields = pathlib.Path(f"/proc/{view.pid}/stat").read_text().rsplit(")", 1)[1].split()
        share = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") / SECONDS
        view.terminate()
        view.wait(30)
    daemon.send_signal(signal.SIGTERM)
    said = daemon.communicate(timeout=30)[0]
    plant.terminate()
    plant.wait(30)
    ticks = re.search(r"tick +p50 +([\d.]+) us +p99 +([\d.]+) us", said)
    late = re.search(r"lateness +p50 +[\d.]+ us +p99 +([\d.]+) us", said)
    return float(ticks[1]), float(ticks[2]), float(late[1]), texts, frames, share


rows = {name: [] for name in ("without", "page", "page in a browser")}
for _ in range(ROUNDS):
    for name, page, shown in (("without", False, False), ("page", True, False), ("page in a browser", True, True)):
        with tempfile.TemporaryDirectory() as folder:
            rows[name].append(one_run(pathlib.Path(folder), page, shown))
print("                     tick p50 [us]      p99 [us]           lateness p99 [us]  texts/s  frames/s  share of a core")
for name, runs in rows.items():
    p50, p99, late, texts, frames, share = zip(*runs)
    print(
        f"{name:20} {statistics.median(p50):6.1f} {min(p50):5.1f}-{max(p50):5.1f} {statistics.median(p99):6.1f} {min(p99):5.1f}-{max(p99):5.1f}"
        f" {statistics.median(late):6.1f} {min(late):5.1f}-{max(late):5.1f} {statistics.median(texts):8.1f} {statistics.median(frames):8.1f}"
        f" {statistics.median(share):8.2f}"
    )
