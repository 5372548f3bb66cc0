"""Every cell of docs/tutorial/python.ipynb runs, and finds what it says."""

import os
import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "build/python/bin/python"
if not (ROOT / "build/python/notebook_requirements.txt").exists():
    print("skipped: tools/python_environment --all was not run")
    sys.exit(77)
if sys.prefix != str(ENVIRONMENT.parents[1]):
    os.execv(ENVIRONMENT, [ENVIRONMENT, *sys.argv])

import nbclient
import nbformat

FOUND = """
assert tracking_mrad < 2.0, tracking_mrad
assert np.allclose(found[:, 0], arm.stiffness_nm_per_rad, rtol=0.05), found
assert np.allclose(found[:, 1], arm.damping_nms_per_rad, rtol=0.3), found
assert np.abs(bend[-1] - wanted).max() < 0.02, bend[-1]
"""

path = ROOT / "docs/tutorial/python.ipynb"
notebook = nbformat.read(path, as_version=4)
assert not any(cell.get("outputs") for cell in notebook.cells), "outputs are not kept in the repository"
notebook.cells.append(nbformat.v4.new_code_cell(FOUND))
with tempfile.TemporaryDirectory() as folder:
    os.environ.update(IPYTHONDIR=folder, JUPYTER_RUNTIME_DIR=folder, JUPYTER_DATA_DIR=folder, JUPYTER_CONFIG_DIR=folder)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}}).execute()
figures = sum("image/png" in output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", []))
assert figures == 3, figures
print(f"{len(notebook.cells)} cells, {figures} figures")
