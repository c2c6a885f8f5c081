"""Results show themselves in a notebook, with the words and numbers of the reports, and the example notebook runs."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import comparison, diagnosis, entries

from docs.generator import notebook_page
from docs.generator.notebook_page import EXECUTE, NOTEBOOK
from fmus.errors import MisfitError
from orchestrator.discover import Discovery
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.ledger import Ledger
from orchestrator.report.arm_drawing import Replay
from orchestrator.results.column import Column
from orchestrator.results.result import Result

ROOT = Path(__file__).parents[2]


def result() -> Result:
    time = np.linspace(0, 2, 5)
    columns = (Column("arm.q", "rad"), Column("arm.<b>", ""))
    return Result(time, columns, {"arm.q": time**2, "arm.<b>": -time})


def block() -> Block:
    """y = 3 x, observed at seven points without much noise."""
    x = np.linspace(-1, 1, 7)[:, None]
    seen = observe("all", x, {"f": 1.0}, 3 * x[:, 0], 1e-3)
    posterior = condition({"f": Latent(SquaredExponential(25.0, (1.0,)))}, [seen])
    return Block(posterior, {"x": "m"}, [Output("y", "N", (Term("f"),))], (seen,))


def replay() -> Replay:
    time = np.linspace(0, 1, 11)
    return Replay(time, np.column_stack([time, time]), np.column_stack([time, -time]))


SHOWN: dict[str, Callable[[], Any]] = {
    "comparison": lambda: comparison(n=60),
    "diagnosis": lambda: diagnosis(n=60),
    "discovery": lambda: Discovery((found := diagnosis(n=60)), (), tuple(entries(found))),
    "ledger": lambda: Ledger(entries(diagnosis(n=60))),
    "result": result,
    "block": block,
    "replay": replay,
}


class Balance(HTMLParser):
    """Which elements are open at the end, and what would be fetched."""

    VOID = ("img", "input", "br", "meta")

    def __init__(self, source: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.addresses: list[str] = []
        self.feed(source)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.addresses += [value or "" for name, value in attributes if name in ("src", "href", "data")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.mark.parametrize("kind", SHOWN)
def test_a_result_shows_itself_as_whole_elements_that_fetch_nothing(kind: str) -> None:
    shown = SHOWN[kind]()._repr_html_()
    found = Balance(shown)

    assert found.open == []
    assert all(address.startswith("data:image/") for address in found.addresses)
    # Styles reach no other cell.
    assert re.findall(r"^:root", shown, re.MULTILINE) == []
    assert shown.count('<div class="misfit-report">') >= 1


@pytest.mark.parametrize("kind", [kind for kind in SHOWN if kind != "replay"])
def test_plot_gives_a_picture_that_says_what_it_shows(kind: str) -> None:
    shown = SHOWN[kind]().plot()._repr_html_()

    assert re.search(r'(alt|aria-label)="[^"]*\d[^"]*"', shown)


def test_numbers_are_those_of_the_result() -> None:
    found = diagnosis(n=60)

    assert "tauC[1] 37.3 mN·m (36.1 to 38.5)" in found._repr_html_().replace("\u00a0", " ")
    table = result()._repr_html_()
    assert "arm.&lt;b&gt;" in table and "<b>" not in table
    cells = re.sub(r' data-label="[^"]*"', "", table)
    assert re.search(r"arm.q</th><td>rad</td><td>0</td><td>0</td><td>4</td><td>4</td>", cells)
    # The curve through 3 x on [-1, 1] ends at 3, where the prior of variance 25 hardly pulls.
    assert "y up to 3.00 N" in block().plot().html


def test_a_trial_is_drawn_by_its_name() -> None:
    found = comparison(n=60)

    assert "trial_02.csv" in found.plot("trial_02.csv").html
    with pytest.raises(MisfitError, match="no curves of trial_99.csv"):
        found.plot("trial_99.csv")
    with pytest.raises(MisfitError, match="keeps no curves"):
        replace(found, curves=()).plot()


def test_what_cannot_be_drawn_is_told_in_one_line() -> None:
    with pytest.raises(MisfitError, match="fewer than two"):
        Ledger(entries(diagnosis(n=60))[:1]).plot()
    with pytest.raises(MisfitError, match="no column 'q'"):
        result().plot("q")
    empty = Result(np.zeros(0), result().columns, {"arm.q": np.zeros(0), "arm.<b>": np.zeros(0)}, failure="it broke")
    assert "The run ended early: it broke" in empty._repr_html_()


def test_example_notebook_is_stored_without_outputs() -> None:
    cells = [cell for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"]

    assert [(cell["outputs"], cell["execution_count"]) for cell in cells] == [([], None)] * len(cells)


def test_the_page_of_the_notebook_shows_every_cell_with_what_it_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    codes = {place: "".join(cell["source"]) for place, cell in enumerate(cells) if cell["cell_type"] == "code"}
    monkeypatch.setattr(notebook_page, "_outputs", lambda: {place: f"<b>shown {place}</b>" for place in codes})
    text = notebook_page.with_outputs(notebook_page.page())

    for place, code in codes.items():
        assert text.index(code) < text.index(f"<b>shown {place}</b>")


def test_example_notebook_runs_and_every_cell_shows_something(tmp_path: Path) -> None:
    target = tmp_path / "executed.ipynb"
    # Threads of a linear algebra on small matrices only wait for each other.
    environment = {**os.environ, "IPYTHONDIR": str(tmp_path), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", EXECUTE, str(NOTEBOOK), str(ROOT), str(target)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr[-2000:]

    cells = [cell for cell in json.loads(target.read_text())["cells"] if cell["cell_type"] == "code"]
    outputs = [output for cell in cells for output in cell["outputs"]]
    shown, progress = (
        ["".join(output["data"].get("text/html", "")) for output in outputs if output["output_type"] == kind]
        for kind in ("execute_result", "display_data")
    )
    assert progress and not any(progress)  # the line that says what is being done goes when it is done
    assert len(shown) == len(cells)
    assert all(text.lstrip().startswith('<div class="misfit-report">') for text in shown)
    assert "Viscous friction at joint1 is missing" in shown[2]
    assert "Missing force with 90 % band" in shown[5]
    assert "Replay of the worst trial" in shown[-1]
    assert not any(output.get("name") == "stderr" for cell in cells for output in cell["outputs"])
