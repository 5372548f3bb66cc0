"""The page of `softarm view`: what it draws is where the arm is, a browser gets it, and its usage. usage: view_test.py BIN_DIR"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "build/python/bin/python"
if not ENVIRONMENT.exists():
    print("skipped: tools/python_environment was not run")
    sys.exit(77)
if sys.prefix != str(ENVIRONMENT.parents[1]):
    os.execv(ENVIRONMENT, [ENVIRONMENT, *sys.argv])

import numpy as np
import softarm
import softarm.view

SOFTARM = pathlib.Path(sys.argv[1]) / "softarm"
CONFIG = ROOT / "config/paper_arm.yaml"
STRETCHING = ROOT / "config/paper_arm_stretching.yaml"


def drawn_where_the_arm_is(log, config):
    experiment = softarm.load_experiment(config)
    arm = softarm.Arm(experiment)
    view = softarm.view.View(experiment, "127.0.0.1", 0)
    pictures = softarm.view.read_log(log, experiment, config)
    assert pictures[-1].mode == "ACTIVE", pictures[-1]
    for picture in pictures[::50]:
        view.show(picture)
        state = [list(u) for u in picture.u.reshape(-1, 2)]
        if config == STRETCHING:
            state = [[*u, e] for u, e in zip(state, picture.e, strict=True)]
        assert np.allclose(view.tip_m(), arm.tip(np.ravel(state)), atol=1e-6)
        assert all(line.visible for line in view._lines.values()) or picture.mode != "ACTIVE"
    tip = [float(cell or "nan") for cell in pathlib.Path(log, "log.csv").read_text().splitlines()[-1].split(",")[-6:-3]]
    assert np.linalg.norm(view.tip_m() - tip) < 0.01, "the tip of the simulated arm"
    page = urllib.request.urlopen(f"http://127.0.0.1:{view.server.get_port()}/").read().decode()
    assert "<html" in page
    view.server.stop()


def answers(arguments, code, text):
    ended = subprocess.run([SOFTARM, "view", *arguments], capture_output=True, text=True, timeout=60)
    assert ended.returncode == code and re.search(text, ended.stdout + ended.stderr), ended


def served(log):
    page = subprocess.Popen(
        [SOFTARM, "view", CONFIG, "--log", log, "--port", "0"], stdout=subprocess.PIPE, text=True, bufsize=1
    )
    try:
        for line in page.stdout:
            if found := re.search(r"softarm view: (http://\S+)", line):
                urllib.request.urlopen(found[1]).read()
                return
        raise AssertionError("ended without a page")
    finally:
        page.terminate()
        page.wait(30)


with tempfile.TemporaryDirectory() as folder:
    for config in (STRETCHING, CONFIG):
        subprocess.run([SOFTARM, "run", config, "--duration", "1.5", "--out", folder, "--no-plots"], check=True, capture_output=True)
        drawn_where_the_arm_is(folder, config)
    served(folder)
answers(["--help"], 0, "CONFIG")
answers([], 64, "CONFIG")
answers(["/nowhere.yaml"], 78, "no such file")
answers([CONFIG, "--log", "/nowhere.csv"], 1, "/nowhere.csv")
answers([CONFIG, "--log", "/nowhere.lcm"], 1, r"cannot read /nowhere.lcm(?!.*Command '\[)(?s:.*)softarm view: /nowhere.lcm: expected")
answers([CONFIG, "--log", "x", "--control"], 64, "--control")
