"""The commands of README, CONTRIBUTING and docs run as printed. Arguments: folder of the programs, and `fast` or `slow`.

All `sh` blocks of a page run in one shell, in a temporary folder that looks like the project's, in their own network. What is not
run, or only in the slow tier, is in the tables below with its reason. Every command, also those in the text, must name programs,
sub-commands, options, files and tests that exist. docs/tutorial/laboratory.md is run by laboratory_test.py.
"""
import collections
import concurrent.futures
import fnmatch
import functools
import os
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = pathlib.Path(sys.argv.pop(1)).resolve()
SLOW_TIER = {"fast": False, "slow": True}[sys.argv.pop(1)]
PATIENCE_S = 600 if SLOW_TIER else 150
LABORATORY = ROOT / "docs/tutorial/laboratory.md"

INSTALLS = "installs packages, builds everything, or both"
NEEDS_ROOT = "changes the machine, as root, under systemd"
MEASURES = "measures for minutes to hours on a machine with nothing else to do"
NOT_RUN = {
    "tools/demo": INSTALLS,
    "tools/test": INSTALLS,
    "tools/test --all": INSTALLS,
    "tools/test -- -L unit": INSTALLS,
    "tools/test -- -R docs": INSTALLS,
    "tools/build dev": INSTALLS,
    "tools/install_packages": INSTALLS,
    "tools/build release softarm softarmd softarm-plant softarm_python": INSTALLS,
    "tools/build release softarm unit_model_tests": INSTALLS,
    "tools/package": INSTALLS,
    "tools/install_packages --fuzz": INSTALLS,
    "dpkg -i build/package/softarm_*.deb": NEEDS_ROOT + "; install.package does it on a copy of the file system",
    "dpkg --purge softarm": NEEDS_ROOT,
    "cmake --install build/release --prefix /usr/local": NEEDS_ROOT,
    "install -D -m 644 config/paper_arm.yaml /etc/softarm/paper_arm.yaml": NEEDS_ROOT,
    "softarm check /etc/softarm/paper_arm.yaml": NEEDS_ROOT,
    "systemctl daemon-reload": NEEDS_ROOT,
    "systemctl enable --now softarmd@paper_arm": NEEDS_ROOT,
    "systemctl status softarmd@paper_arm": NEEDS_ROOT,
    "journalctl --follow --unit softarmd@paper_arm": NEEDS_ROOT,
    "systemctl stop softarmd@paper_arm": NEEDS_ROOT,
    "tools/fuzz": MEASURES,
    "tools/fuzz tick_record_t --runs 100000": "builds with clang; tools/test --all runs every target",
    "tools/with_loopback_network build/release/bin/softarm-dev soak config/paper_arm.yaml --duration 3600 --between 2": MEASURES,
    "chrt -f 20 build/release/bin/softarm-dev soak config/paper_arm.yaml --duration 3600 --between 2 --seed 20261130": MEASURES,
    "tools/with_loopback_network build/release/bin/softarm-dev bench loop": MEASURES,
    "tools/with_loopback_network build/release/bin/softarm-dev bench loop --law --seconds 10": MEASURES,
    "tools/with_loopback_network build/python/bin/python tests/python/page_cost.py build/release/bin 3 6": MEASURES,
    "ROUNDS=5 tools/with_loopback_network python3 tests/scripts/every_interface_test.py build/release/bin":
        MEASURES + "; scripts.every_interface",
    "SOFTARM_HOSTILE_PACKETS=1000000 tools/with_loopback_network build/release/bin/faults_softarmd_tests "
    "--gtest_filter='*MalformedPacketsWithoutEnd*'": MEASURES + "; faults.softarmd.AMillionMalformedPackets",
    "SOFTARM_REPLAY_SECONDS=600 chrt -f 10 tools/with_loopback_network build/release/bin/integration_replay_tests "
    "--gtest_filter='*RecordedWithFaults*'": MEASURES + "; integration.replay.TenMinutesWithFaults",
    "tools/with_loopback_network ctest --test-dir build/release -R TenMinutesWithFaults -V": "is a test, ten minutes",
    "tools/spy --screenshot docs/how-to/lcm_spy.png --curve 'u_rad[0][0]'": "overwrites the picture of the page; scripts.spy",
    "lcm-logplayer --lcm-url='udpm://239.255.76.67:7700?ttl=0' run.log &": "plays to the window that the next command opens",
    "tools/spy --url 'udpm://239.255.76.67:7700?ttl=0'": "opens a window; scripts.spy",
}
SLOW = {
    "softarm identify config/paper_arm.yaml --hold 0.5 --output identified.yaml --out out/identified",
    "tools/plot_identification.py out/identified",
    "softarm run config/paper_simulation.yaml",
    "softarm run config/paper_simulation_noisy.yaml",
    "softarm identify config/paper_simulation.yaml --linear --no-lag --no-delay",
    "build/python/bin/python examples/follow.py --duration 12",
}
# What a busy machine may make of them: a check of the timing fails (1). Without a pulse not everything is checked (3).
MAY_FAIL_OR_NOT_CHECK = {
    "softarm check --live config/paper_arm.yaml --seconds 2",
    "softarm check --live config/one_segment.yaml --seconds 2 --pulse --hold 0.45",  # fails as documented
}
NEEDS_PYTHON = "build/python/"  # made by tools/python_environment, which fetches a package

BLOCK = re.compile(r"^```sh\n(.*?)^```[ \t]*$", re.MULTILINE | re.DOTALL)
FENCE = re.compile(r"^```.*?^```[ \t]*$", re.MULTILINE | re.DOTALL)
DEFINED_TEST = re.compile(r"\bTEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\s*\)")
TEST_PROGRAM = re.compile(r"(unit|numerics|integration|faults|fuzz)_(\w+)_tests")
OURS = re.compile(r"(softarm(d|-plant|-valves|-dev)?|tools/[\w.]+|ctest|" + TEST_PROGRAM.pattern + r")( |$)")
# Of the shell, of Debian and of LCM.
OTHERS = {"cat", "cmake", "cpack", "date", "dpkg", "export", "grep", "install", "journalctl", "kill", "lcm-logger", "lcm-logplayer",
          "python3", "set", "sleep", "systemctl", "true", "wait", "xargs"}
WRAPPERS = {"chrt": 1, "nice": 0, "sudo": 0, "timeout": 1, "tools/with_loopback_network": 0}  # words before the command, beside options
Command = collections.namedtuple("Command", "key text")


def pages():
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]


def commands(block):
    """Those of a block: `text` as printed, `key` in one line without comments."""
    lines = iter(block.splitlines())
    for line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        text = line
        while text.endswith("\\"):
            text += "\n" + next(lines)
        key = re.sub(r"\s+#.*$", "", re.sub(r"\\\n\s*", "", text)).strip()
        here = re.search(r"<<'?(\w+)'?", line)
        while here and text.splitlines()[-1] != here.group(1):
            text += "\n" + next(lines)
        yield Command(key, text)


def blocks(page):
    return [list(commands(block)) for block in BLOCK.findall(page.read_text(encoding="utf-8"))]


def simple_commands(line):
    """What a line of shell starts, word by word, without redirections."""
    lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    words, redirected = [], False
    for word in lexer:
        if set(word) <= set("();&|"):
            if words:
                yield words
            words = []
        elif set(word) <= set("<>"):
            redirected = True
            if words and words[-1].isdigit():
                words.pop()
        elif redirected:
            redirected = False
        elif words or word not in ("do", "done", "for", "then", "fi", "{", "}"):
            words.append(word)
    if words:
        yield words


def unwrapped(words):
    """The command behind assignments and wrappers such as chrt -f 10."""
    while words and re.match(r"\w+=", words[0]):
        words = words[1:]
    while words and words[0] in WRAPPERS:
        count, words = WRAPPERS[words[0]], words[1:]
        while words and words[0].startswith("-"):
            words = words[1:]
        words = words[count:]
    return words


@functools.cache
def help_of(*command):
    if not os.access(command[0], os.X_OK):
        return ""
    done = subprocess.run([*command, "--help"], capture_output=True, text=True, timeout=60, check=False)
    return done.stdout if done.returncode == 0 else ""


def sub_commands(text):
    """Those that the help of a program lists."""
    listed = re.search(r"^Subcommands:\n((?:  .*\n?)*)", text, flags=re.MULTILINE)
    return re.findall(r"^  (\w[\w-]*)", listed.group(1), flags=re.MULTILINE) if listed else []


def option_complaints(arguments, text, name):
    for word in arguments:
        if word == "--":
            return
        option = re.match(r"--?[A-Za-z][\w-]*", word)
        if option and not re.search(rf"(?<![\w-]){re.escape(option.group())}(?![\w-])", text):
            yield f"{name} has no option {option.group()}"


def program_complaints(program, arguments):
    """A program with CLI11's help: sub-commands by name, then options."""
    command = [program]
    text = help_of(*command)
    if not text:
        yield f"no program {program}, or it prints no help"
        return
    while sub_commands(text):
        name = next((word for word in arguments if not word.startswith("-")), None)
        if name is None:
            break
        if name not in sub_commands(text):
            yield f"{pathlib.Path(program).name} has no sub-command {name}"
            return
        command.append(name)
        arguments = arguments[arguments.index(name) + 1:]
        text = help_of(*command)
    yield from option_complaints(arguments, text, " ".join([pathlib.Path(program).name, *command[1:]]))


@functools.cache
def defined_tests():
    """Names of all tests, as ctest has them, from the sources: no preset builds every one."""
    names = set()
    for path in (ROOT / "tests").rglob("*"):
        if path.name == "CMakeLists.txt":
            names |= set(re.findall(r"add_test\(NAME (\S+)", path.read_text(encoding="utf-8")))
        elif path.name.endswith("_test.cpp"):
            folder = ".".join(path.relative_to(ROOT / "tests").parent.parts)
            names |= {".".join((folder, *match)) for match in DEFINED_TEST.findall(path.read_text(encoding="utf-8"))}
    return names


def test_complaints(label, folder, arguments):
    """A program of GoogleTest: its folder, and tests that its filter chooses."""
    names = [name for name in defined_tests() if name.startswith(f"{label}.{folder}.")]
    if not names:
        yield f"no tests in tests/{label}/{folder}"
    for word in arguments:
        name, _, pattern = word.partition("=")
        if name != "--gtest_filter":
            yield f"{name} is not expected here"
        elif not any(fnmatch.fnmatchcase(each, f"{label}.{folder}.{pattern}") for each in names):
            yield f"no test of {label}_{folder}_tests is called {pattern}"


def ctest_complaints(arguments):
    for option, word in zip(arguments, arguments[1:]):
        if option == "-R" and not any(re.search(word, name) for name in defined_tests()):
            yield f"no test is called {word}"
        if option == "-L" and not any(name.startswith(word + ".") for name in defined_tests()):
            yield f"no tests are labelled {word}"


def script_complaints(script, arguments):
    """A script of tools/ by its help, one in Python elsewhere by its text, which needs no packages."""
    path = ROOT / script
    if path.is_dir() and not arguments:
        return
    if not path.is_file():
        yield f"no script {script}"
    elif script.startswith("tools/"):
        yield from option_complaints(arguments, help_of(path), script)
    else:
        yield from option_complaints(arguments, path.read_text(encoding="utf-8"), script)


def complaints(line):
    """What of a line of shell does not exist here."""
    for words in map(unwrapped, simple_commands(line)):
        if not words:
            continue
        name, arguments = words[0].removeprefix("build/release/bin/"), words[1:]
        test = TEST_PROGRAM.fullmatch(name)
        if re.fullmatch(r"softarm[\w-]*", name):
            yield from program_complaints(str(PROGRAMS / name), arguments)
        elif test:
            yield from test_complaints(test.group(1), test.group(2), arguments)
        elif name == "ctest":
            yield from ctest_complaints(arguments)
        elif name in ("python3", NEEDS_PYTHON + "bin/python"):
            yield from script_complaints(arguments[0], arguments[1:])
        elif name.startswith("tools/"):
            yield from script_complaints(name, arguments)
        elif name not in OTHERS and not re.fullmatch(r"\w+ in .*|\w+", name):
            yield f"unknown program {name}"
        for word in words[1:]:
            if re.match(r"(config|tests|examples|lcmtypes)/[\w./-]+$", word) and not (ROOT / word).exists():
                yield f"no file {word}"


def has_own_networks():
    network = ["readlink", "/proc/self/ns/net"]
    inside = subprocess.run([ROOT / "tools/with_loopback_network", *network], capture_output=True, check=False).stdout
    return inside != subprocess.run(network, capture_output=True, check=False).stdout


def run_page(page, printed):
    """Exit code, seconds, and what the page's commands print."""
    lines = ["set -euo pipefail"]
    lines += [each.key + " || [[ $? == [13] ]]" if each.key in MAY_FAIL_OR_NOT_CHECK else each.text for each in printed]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for part in ("config", "tools", "tests", "examples", "lcmtypes"):
            (folder / part).symlink_to(ROOT / part)
        (folder / "build/release").mkdir(parents=True)
        (folder / "build/release/bin").symlink_to(PROGRAMS)
        (folder / "build/python").symlink_to(ROOT / "build/python")
        start = time.monotonic()
        with open(folder / "output.txt", "w", encoding="utf-8") as file, subprocess.Popen(
                [ROOT / "tools/with_loopback_network", "bash", "-c", "\n".join(lines)], cwd=folder, stdout=file, stderr=file,
                start_new_session=True, env=os.environ | {"PATH": f"{PROGRAMS}:{os.environ['PATH']}"}) as shell:
            try:
                code = shell.wait(timeout=PATIENCE_S)
            except subprocess.TimeoutExpired:
                code = f"none within {PATIENCE_S} s"
            finally:
                try:
                    os.killpg(shell.pid, signal.SIGKILL)  # what the page leaves running
                except ProcessLookupError:
                    pass
        output = (folder / "output.txt").read_text(encoding="utf-8", errors="replace")
        return code, time.monotonic() - start, f"{page.name}:\n{output}"


class Commands(unittest.TestCase):
    maxDiff = None

    @unittest.skipIf(SLOW_TIER, "is in the fast tier")
    def test_everything_they_name_exists(self):
        found = []
        for page in pages():
            text = page.read_text(encoding="utf-8")
            lines = [command.key for block in blocks(page) for command in block]
            lines += [span for span in re.findall(r"`([^`]+)`", FENCE.sub("", text)) if OURS.match(" ".join(unwrapped(span.split())))]
            found += [f"{page.relative_to(ROOT)}: {line}: {what}" for line in lines for what in complaints(line)]
        self.assertEqual(found, [])

    def test_exceptions_are_commands_of_a_page(self):
        printed = {command.key for page in pages() for block in blocks(page) for command in block}
        self.assertEqual({*NOT_RUN, *SLOW, *MAY_FAIL_OR_NOT_CHECK} - printed, set())

    def test_what_does_not_exist_is_noticed(self):
        for line in ("softarm no_such_command", "softarm run --no-such-option config/paper_arm.yaml", "softarmx", "tools/no_such_script",
                     "softarm run config/no_such_file.yaml", "tools/spy --no-such-option", "sleep 1; softarmd --no-such-option x &",
                     "chrt -f 10 tools/with_loopback_network build/release/bin/softarm-plant --no-such-option",
                     "unit_model_tests --gtest_filter='NoSuchTest.*'", "ctest -R no_such_test"):
            self.assertNotEqual(list(complaints(line)), [], line)

    def test_pages_run_as_printed(self):
        chosen = {}
        for page in pages():
            printed = [command for block in blocks(page) for command in block]
            if page != LABORATORY and (not SLOW_TIER or any(command.key in SLOW for command in printed)):
                chosen[page] = [command for command in printed if self.is_run(command.key)]
        chosen = {page: printed for page, printed in chosen.items() if printed}
        # Two pages at once, where each has its own network.
        with concurrent.futures.ThreadPoolExecutor(2 if has_own_networks() else 1) as pool:
            done = dict(zip(chosen, pool.map(run_page, chosen, chosen.values())))
        for page, (code, seconds, output) in done.items():
            print(f"{page.relative_to(ROOT)}: {seconds:.1f} s", flush=True)
            with self.subTest(page=str(page.relative_to(ROOT))):
                self.assertEqual(code, 0, output[-6000:])

    def is_run(self, key):
        if key.startswith(NEEDS_PYTHON) and not (ROOT / "build/python/bin/python").exists():
            print(f"left out, tools/python_environment was not run: {key}")
            return False
        return key not in NOT_RUN and (SLOW_TIER or key not in SLOW)


if __name__ == "__main__":
    if subprocess.run([ROOT / "tools/with_loopback_network", "true"], capture_output=True, check=False).returncode != 0:
        print("skipped: no separate network can be made here, and there is no multicast route")
        sys.exit(77)
    unittest.main()
