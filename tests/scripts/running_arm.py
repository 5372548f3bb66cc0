"""What the tests of scripts share that look at a running arm: a port of their own, programs that end with the test."""
import os
import pathlib
import signal
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def skip_without_multicast():
    if subprocess.run([ROOT / "tools/with_loopback_network", "--check"], capture_output=True, check=False).returncode != 0:
        print("skipped: no multicast route here (tools/with_loopback_network)")
        sys.exit(77)


def own_url():
    return f"udpm://239.255.76.67:{20000 + os.getpid() % 40000}?ttl=0"


def write_config(folder, base, url, more=""):
    """An experiment like config/BASE on LCM at `url`; `more` is YAML of the top level."""
    config = folder / "config.yaml"
    config.write_text(f"include: {ROOT}/config/{base}\nname: under_test\n{more}daemon: {{lcm: {{url: \"{url}\"}}}}\n",
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
