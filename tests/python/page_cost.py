"""What `softarm view` costs the daemon and how often it draws: figures for docs/results, nothing is asserted.

usage: tools/with_loopback_network build/python/bin/python tests/python/page_cost.py BIN_DIR [ROUNDS] [SECONDS]

Every round runs softarmd and softarm-plant (SCHED_FIFO) for SECONDS without, with the page, and with a browser that shows it, one
after the other, and reads the tick's times that softarmd prints when it ends. The browser counts the texts that the page
showed, in each of which t and the tip's place changed, and its own frames.
"""

import contextlib
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
WARM_S = 20.0
COUNT_TEXTS = """(() => { window.texts = 0; let last = '';
  setInterval(() => { const now = [...document.querySelectorAll('p')].map(p => p.textContent).find(t => t.includes('tip [')) ?? '';
                      if (now !== last) { last = now; ++window.texts; } }, 10); })()"""
COUNT_FRAMES = """(() => { window.frames_drawn = 0;
  const draw = () => { ++window.frames_drawn; requestAnimationFrame(draw); }; requestAnimationFrame(draw); })()"""


def ended(process, number=signal.SIGTERM):
    process.send_signal(number)
    return process.communicate(timeout=30)[0]


def one_run(folder, page, shown):
    """Tick's p50, p99 and lateness' p99 in us, what the page received and drew a second, the page's share of a core."""
    config = write_config(folder, "paper_arm.yaml", own_url())
    with contextlib.ExitStack() as at_end:

        def started(*words, **options):
            process = subprocess.Popen(
                [str(word) for word in words], env={**os.environ, "XDG_STATE_HOME": str(folder)}, text=True, **options
            )
            at_end.callback(lambda: process.poll() is None and process.kill())
            return process

        plant = started("chrt", "-f", "40", BIN / "softarm-plant", config, stderr=subprocess.DEVNULL)
        both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        daemon = started("chrt", "-f", "50", BIN / "softarmd", config, **both)
        view, texts, frames, share = None, 0.0, 0.0, 0.0
        if page:
            view = started(BIN / "softarm", "view", config, "--port", "0", stdout=subprocess.PIPE, bufsize=1)
            url = next(found[1] for line in view.stdout if (found := re.search(r"(http://\S+)", line)))
        if shown:
            with browser.Page(url, (700, 500), patience_s=180.0) as seen:
                seen.wait("(document.body?.innerText ?? '').includes('ACTIVE')")
                time.sleep(WARM_S)  # WebGL in software compiles its shaders
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
            share = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") / (SECONDS + WARM_S * shown)
            ended(view)
        said = ended(daemon)
        ended(plant)
    ticks = re.search(r"tick +p50 +([\d.]+) us +p99 +([\d.]+) us", said)
    late = re.search(r"lateness +p50 +[\d.]+ us +p99 +([\d.]+) us", said)
    return float(ticks[1]), float(ticks[2]), float(late[1]), texts, frames, share


rows = {name: [] for name in ("without", "page", "page in a browser")}
for _ in range(ROUNDS):
    for name, page, shown in (("without", False, False), ("page", True, False), ("page in a browser", True, True)):
        with tempfile.TemporaryDirectory() as folder:
            rows[name].append(one_run(pathlib.Path(folder), page, shown))
print("                     tick p50 [us]      p99 [us]           lateness p99 [us]  texts/s  frames/s  share of a core, with its start")
for name, runs in rows.items():
    p50, p99, late, texts, frames, share = zip(*runs)
    print(
        f"{name:20} {statistics.median(p50):6.1f} {min(p50):5.1f}-{max(p50):5.1f} {statistics.median(p99):6.1f} {min(p99):5.1f}-{max(p99):5.1f}"
        f" {statistics.median(late):6.1f} {min(late):5.1f}-{max(late):5.1f} {statistics.median(texts):8.1f} {statistics.median(frames):8.1f}"
        f" {statistics.median(share):8.2f}"
    )
