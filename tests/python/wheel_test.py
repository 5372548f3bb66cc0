"""`pip install ./python` as a user has it: a wheel, in a Python that has nothing else, away from the tree.

usage: wheel_test.py BUILD_DIR VERSION
"""

import pathlib
import subprocess
import sys
import tempfile
import venv
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
build, version = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]

IN_THE_WHEEL = """
import importlib.metadata, pathlib, sys
import numpy, softarm
assert softarm.__version__.startswith(sys.argv[1]), softarm.__version__
assert importlib.metadata.version("softarm") == sys.argv[1]
folder = pathlib.Path(softarm.__file__).parent
assert pathlib.Path(sys.prefix) in folder.parents, folder
assert (folder / "py.typed").exists() and "class Arm" in (folder / "_core.pyi").read_text()
log = softarm.run(softarm.load_experiment(sys.argv[2]), 1.0)
assert log["mode"][-1] == "ACTIVE", log["mode"][-1]
print("numpy", numpy.__version__, "tip error", numpy.abs(log["u_ref"] - log["u"])[-1].max())
"""


def run(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, text=True, **options)


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    venv.create(folder / "venv", with_pip=True)
    python = folder / "venv/bin/python"
    pip = [python, "-m", "pip", "--disable-pip-version-check", "--retries", "1"]
    reached = subprocess.run(
        [*pip, "download", "--quiet", "--no-deps", "--dest", folder, "scikit-build-core"], capture_output=True, text=True
    )
    if reached.returncode != 0:
        print("skipped: pip cannot fetch scikit-build-core:", reached.stderr[-300:])
        sys.exit(77)
    # A build folder that stays makes the next run quick.
    run(*pip, "wheel", "--quiet", "--no-deps", f"--config-settings=build-dir={build}", "--wheel-dir", folder, ROOT / "python")
    (wheel,) = folder.glob(f"softarm-{version}-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    foreign = [name for name in names if not name.startswith(("softarm/", f"softarm-{version}.dist-info/"))]
    assert not foreign, foreign
    run(*pip, "install", "--quiet", wheel)
    run(python, "-I", "-c", IN_THE_WHEEL, version, ROOT / "config/paper_arm.yaml", cwd=folder)
