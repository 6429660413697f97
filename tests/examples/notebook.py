"""Make examples/first_episode.ipynb: `make notebook`, or `python -m tests.examples.notebook [FILE.ipynb]`.

Its text and code are those of first_episode.md, beside this file. Each block of code becomes a cell, and is executed.
"""

import os
import re
import sys
from pathlib import Path
from typing import Any, Final

import nbformat
from nbclient import NotebookClient
from nbformat import v4
from traitlets.config import Config

from tests.helpers.repository import ROOT

NOTEBOOK: Final = ROOT / "examples" / "first_episode.ipynb"
_SOURCE: Final = Path(__file__).with_name("first_episode.md")
_CODE: Final = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_LIMIT_S: Final = 600
_LOCAL: Final = Config({"KernelManager": {"transport": "ipc"}})
"""Sockets of files, not of a network"""


def make() -> Any:
    """Return the notebook, executed from its first cell to its last; CellExecutionError where one fails."""
    cells: list[Any] = []
    for number, part in enumerate(_CODE.split(_SOURCE.read_text(encoding="utf-8"))):
        text, name = part.strip("\n"), f"cell-{len(cells)}"
        if text:
            cells.append(v4.new_code_cell(text, id=name) if number % 2 else v4.new_markdown_cell(text, id=name))
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})
    client = NotebookClient(notebook, timeout=_LIMIT_S, record_timing=False, config=_LOCAL)
    client.execute(cwd=str(ROOT), env=os.environ | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"})
    notebook.metadata.language_info = {"name": "python"}  # without the version that ran
    return notebook


def texts(notebook: Any) -> list[list[str]]:
    """Return the texts that each cell of code printed or showed, and `picture` for a picture."""
    shown: list[list[str]] = []
    for cell in notebook.cells:
        if cell.cell_type == "code":
            data = [output.get("data", {"text/plain": output.get("text")}) for output in cell.outputs]
            shown.append(["picture" if "image/png" in one else str(one["text/plain"]) for one in data])
    return shown


if __name__ == "__main__":
    nbformat.write(make(), Path(sys.argv[1]) if sys.argv[1:] else NOTEBOOK)
