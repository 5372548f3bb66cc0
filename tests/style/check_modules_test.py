#!/usr/bin/python3
"""check_modules finds what it is there to find: each rule broken once in a small tree."""
import pathlib
import subprocess
import sys
import tempfile

CHECK = pathlib.Path(__file__).with_name("check_modules")
GOOD = {
    "src/modules.txt": "# comment\nbase:\nmodel: base\napps: *\n",
    "include/softarm/base/time.hpp": "#pragma once\n",
    "src/model/arm.cpp": '#include "softarm/base/time.hpp"\n#include "model/own.hpp"\n// printf("in a comment")\n',
    "src/model/own.hpp": "#pragma once\nconst char* text = \"std::cout\";\n",
    "src/apps/main.cpp": '#include "softarm/model/arm.hpp"\nint main() { std::cout << 1; }\n',
}
BROKEN = {
    "an arrow back": ({"src/base/time.cpp": '#include "softarm/model/arm.hpp"\n'}, "base may not include model"),
    "a private header": ({"src/apps/run.cpp": '#include "model/own.hpp"\n'}, "model/own.hpp is private to model"),
    "a header of the tools": ({"tools/x.hpp": "", "src/model/b.cpp": '#include "x.hpp"\n'}, "belongs to tools or tests"),
    "a module that is not there": ({"src/other/a.cpp": ""}, "no module other"),
    "a table with an arrow back": ({"src/modules.txt": "base: model\nmodel: base\napps: *\n"}, "does not stand above"),
    "an arrow that nobody uses": ({"src/model/arm.cpp": "\n"}, "model does not include base"),
    "std::cout": ({"src/model/b.cpp": "void f() { std::cout << 1; }\n"}, "src/model/b.cpp:1: std::cout"),
    "fmt::print": ({"include/softarm/base/b.hpp": "\n\nvoid f() { fmt::print(file, text); }\n"}, "base/b.hpp:3: fmt::print"),
    "an exit code": ({"src/base/b.cpp": "int f() { return kExitUsage; }\n"}, "kExitUsage"),
    "exit": ({"src/base/b.cpp": "void f() { std::exit(1); }\n"}, "exit"),
    "a command line": ({"src/base/b.cpp": "void f(CLI::App& app);\n"}, "CLI::"),
    "a long program": ({"src/apps/long.cpp": "\n" * 201}, "201 lines"),
}


def run(files):
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            path = pathlib.Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        done = subprocess.run([sys.executable, CHECK, folder], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr


def main():
    failures = []
    code, text = run(GOOD)
    if code != 0:
        failures.append(f"the good tree was refused: {text}")
    for name, (change, expected) in BROKEN.items():
        code, text = run(GOOD | change)
        if code != 1 or expected not in text:
            failures.append(f"{name}: exit code {code}, {text!r} does not contain {expected!r}")
    print("\n".join(failures) or f"{len(BROKEN)} broken trees were refused")
    return 1 if failures else 0


sys.exit(main())
