"""The page about notebooks, in a real kernel of Jupyter: its blocks are cells, and all of them work."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "jupyter.md"
KERNEL = """
import json, sys
import nbformat
from nbclient import NotebookClient

cells = [nbformat.v4.new_code_cell(code) for code in json.load(sys.stdin)]
book = nbformat.v4.new_notebook(cells=cells)
NotebookClient(book, timeout=60, kernel_name="python3", allow_errors=True).execute()
json.dump([[dict(one) for one in cell.outputs] for cell in book.cells], sys.stdout)
"""
REFUSED = """
from actors import spin
try:
    spin(Talker)
except RuntimeError as error:
    print(error)
"""


@pytest.mark.realtime
def test_each_cell_of_the_page_works_in_a_kernel(tmp_path: Path) -> None:
    for package in ("ipykernel", "nbclient"):
        pytest.importorskip(package, reason=f"{package} is not installed, so no kernel of Jupyter can be tried")
    cells = [*re.findall(r"```python(?: notebook)?\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL), REFUSED]
    done = subprocess.run(
        [sys.executable, "-c", KERNEL],
        input=json.dumps(cells),
        capture_output=True,
        text=True,
        timeout=240,
        cwd=tmp_path,
        check=True,
    )
    outputs = [one for cell in json.loads(done.stdout) for one in cell]
    assert [one for one in outputs if one["output_type"] == "error"] == []
    printed = [one["text"] for one in outputs if one["output_type"] == "stream" and one["name"] == "stdout"]
    assert (
        "".join(printed).split("\n").count("5") == 3
    )  # by a script, by a thread's nodes, and by those of the kernel's loop
    assert "as in a notebook: `async with run(...) as system`" in printed[-1]
