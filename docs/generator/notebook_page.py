"""The example notebook as a page: its text and code, and what each cell shows, executed by the build."""

import json
import os
import re
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from docs.generator.studio_pictures import content_of, wanted
from fmus.files import cache_folder

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "docs" / "examples" / "results_in_a_notebook.ipynb"
PAGE = "examples/notebook.md"
# Whatever can change what a cell shows.
SOURCES = (NOTEBOOK, ROOT / "misfit.py", ROOT / "orchestrator", ROOT / "fmus" / "symbolic")
OUTPUT = re.compile(r"<!-- output (\d+) -->")
# In a process of its own, as a reader's kernel would be.
EXECUTE = """
import sys, nbformat
from nbclient import NotebookClient
book = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(book, timeout=300, resources={"metadata": {"path": sys.argv[2]}}).execute()
nbformat.write(book, sys.argv[3])
"""


def page() -> str:
    """The page as Markdown; what a cell shows stands in a comment until the page is HTML."""
    parts = []
    for place, cell in enumerate(_cells(NOTEBOOK)):
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```\n\n<!-- output {place} -->")
    download = f"[Download the notebook]({NOTEBOOK.name}), and run it in the repository's root."
    return "\n\n".join([*parts, download]) + "\n"


def with_outputs(html: str) -> str:
    """A page whose comments are what the cells show."""
    shown = _outputs()
    return OUTPUT.sub(lambda found: shown.get(int(found[1]), ""), html)


@cache
def _outputs() -> dict[int, str]:
    """The HTML of each cell by its place; none where the build takes no pictures."""
    if not wanted():
        return {}
    target = cache_folder("notebook-pages") / f"{content_of(SOURCES)}.ipynb"
    if not target.is_file():
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            executed = Path(folder) / target.name
            threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "IPYTHONDIR": folder}
            command = [sys.executable, "-c", EXECUTE, str(NOTEBOOK), str(ROOT), str(executed)]
            subprocess.run(command, check=True, capture_output=True, env={**os.environ, **threads})
            executed.replace(target)
    return {place: _html(cell) for place, cell in enumerate(_cells(target)) if cell["cell_type"] == "code"}


def _cells(file: Path) -> list[dict[str, Any]]:
    return list(json.loads(file.read_text())["cells"])


def _html(cell: dict[str, Any]) -> str:
    results = (output for output in cell["outputs"] if output["output_type"] == "execute_result")
    return "".join("".join(output["data"].get("text/html", "")) for output in results)
