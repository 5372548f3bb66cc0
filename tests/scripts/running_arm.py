"""What the tests of scripts share that look at a running arm: a port of their own, programs that end with the test."""
import json
import os
import pathlib
import signal
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON = ROOT / "build/python/bin/python"


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
    """Begins the test anew in the Python that has the package lcm, or skips it."""
    if pathlib.Path(sys.prefix) != PYTHON.parents[1]:
        skip_without_our_python()
        os.execv(PYTHON, [PYTHON, "-B", *sys.argv])


def own_url():
    return f"udpm://239.255.76.67:{20000 + os.getpid() % 12000}?ttl=0"


def write_config(folder, base, url, more=""):
    """An experiment like config/BASE on LCM at `url`, for a busy machine; `more` is YAML of the top level."""
    config = folder / pathlib.Path(base).name
    config.write_text(f"include: {ROOT}/config/{base}\nname: under_test\n{more}daemon: {{lcm: {{url: \"{url}\", command_validity_s: 0.3}}}}\n",
                      encoding="utf-8")
    return config


def start(test, folder, *command):
    """A process that gets SIGTERM when `test` ends; what it prints goes to FOLDER/PROGRAM.txt."""
    output = open(folder / f"{pathlib.Path(command[0]).name}.txt", "w", encoding="utf-8")
    test.addCleanup(output.close)
    process = subprocess.Popen(command, stdout=output, stderr=output)

    def end():
        process.send_signal(signal.SIGTERM)
        process.wait()

    test.addCleanup(end)
    return process


def tracks_within(test, programs, config, bound_rad, patience=8):
    """Waits for four seconds in which the arm follows its reference within `bound_rad` (RMS of u); a machine that is busy with other
    things may need several beginnings."""
    seen = []
    for attempt in range(patience):
        out = pathlib.Path(config).parent / f"tracked_{attempt}"
        watch = subprocess.run([programs / "softarm", "watch", config, "--duration", "4", "--out", out],
                               capture_output=True, text=True, timeout=120, check=False)
        if watch.returncode == 0:
            seen.append(json.loads((out / "summary.json").read_text(encoding="utf-8"))["tracking"]["u_rms_rad"])
            if seen[-1] < bound_rad:
                return
        else:
            seen.append(watch.stderr)
    test.fail(f"never within {bound_rad} rad: {seen}")
