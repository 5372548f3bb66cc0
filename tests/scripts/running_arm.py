"""Shared by the tests of scripts that look at a running arm: a separate port, programs that end with the test."""
import concurrent.futures
import itertools
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON = ROOT / "build/python/bin/python"
PATIENCE_S = 120  # bounds a test that fails; how long one takes is the machine's affair
_numbers = itertools.count()


def skip_without_multicast():
    if subprocess.run([ROOT / "tools/with_loopback_network", "--check"], capture_output=True, check=False).returncode != 0:
        print("skipped: no multicast route here (tools/with_loopback_network)")
        sys.exit(77)


def skip_without_our_python():
    """Skips where tools/python_environment was not run, which fetches the package lcm; brings its types up to date where it was."""
    if not PYTHON.exists():
        print("skipped: tools/python_environment was not run (it fetches the Python package lcm)")
        sys.exit(77)
    subprocess.run([ROOT / "tools/python_environment"], check=True, capture_output=True)


def go_on_in_our_python():
    """Starts the test again in the Python that has the package lcm, or skips it."""
    if pathlib.Path(sys.prefix) != PYTHON.parents[1]:
        skip_without_our_python()
        os.execv(PYTHON, [PYTHON, "-B", *sys.argv])


def own_url():
    """A different one with every call, below those of the C++ tests (tests/own_url.hpp)."""
    return f"udpm://239.255.76.67:{8000 + (32 * os.getpid() + next(_numbers)) % 12000}?ttl=0"


# A machine that is busy with other things must look like nothing else.
SAFETY = "hold_after_s: 0.1, vent_after_s: 0.25, max_latency_s: 0.2, law_validity_s: 0.3, law_vent_after_s: 0.3"


def write_config(folder, base, url, more="", name=None, safety=SAFETY, daemon=""):
    """An experiment like config/BASE on LCM at `url`, for a busy machine: FOLDER/NAME.yaml, by default named as BASE. `more` is YAML of
    the top level, `daemon` of two spaces below `daemon:`."""
    config = folder / f"{name or pathlib.Path(base).stem}.yaml"
    config.write_text(f"include: {ROOT}/config/{base}\nname: under_test\n{more}daemon:\n"
                      f"  lcm: {{url: \"{url}\", command_validity_s: 0.3}}\n  safety: {{{safety}}}\n{daemon}", encoding="utf-8")
    return config


def start(test, folder, *command):
    """A process that is ended when `test` ends, a test or its class; what it prints goes to FOLDER/PROGRAM.txt."""
    # No daemon finds the FAULT of another test.
    environment = {**os.environ, "XDG_STATE_HOME": str(folder)}
    with open(folder / f"{pathlib.Path(command[0]).name}.txt", "w", encoding="utf-8") as output:
        process = subprocess.Popen(command, stdout=output, stderr=output, env=environment)

    def end():
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    (test.addClassCleanup if isinstance(test, type) else test.addCleanup)(end)
    return process


def wait_for(reached, what):
    end = time.monotonic() + PATIENCE_S
    while not reached():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.01)


def main_at_once():
    """As unittest.main(), but all tests of the script at the same time, each in a thread: they wait much more than they compute."""
    tests = [test for suite in unittest.TestLoader().loadTestsFromModule(sys.modules["__main__"]) for test in suite]

    class AtOnce(unittest.TestSuite):
        def run(self, result, debug=False):
            with concurrent.futures.ThreadPoolExecutor(len(tests)) as pool:
                list(pool.map(lambda test: test(result), tests))
            return result

    sys.exit(0 if unittest.TextTestRunner().run(AtOnce(tests)).wasSuccessful() else 1)


def tracks_within(test, programs, config, bound_rad, patience=8):
    """Waits for four seconds in which the arm follows its reference within `bound_rad` (RMS of u); a machine that is busy with other
    things may need several beginnings."""
    seen = []
    for attempt in range(patience):
        out = pathlib.Path(config).parent / f"tracked_{attempt}"
        watch = subprocess.run([programs / "softarm", "watch", config, "--duration", "4", "--out", out],
                               capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        if watch.returncode == 0:
            seen.append(json.loads((out / "summary.json").read_text(encoding="utf-8"))["tracking"]["u_rms_rad"])
            if seen[-1] < bound_rad:
                return
        else:
            seen.append(watch.stderr)
    test.fail(f"never within {bound_rad} rad: {seen}")
