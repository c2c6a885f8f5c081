"""Which language constructs and models of the Modelica Standard Library work: `python -m tests.benchmarks.constructs.run`.

Each construct is a small model whose value is known by algebra; `works` means that this value comes out, `refused` that one line
says why not, `wrong` that another value comes out. A value of nan stands for a model that has to be refused.

Models of the Standard Library are built if MODELICAPATH names it. `works` means that all their equations hold in the translation,
evaluated a second time from the front end's flat form; `partly checked` that some could not be evaluated there, `not checked` that none
could. What a model does at its events is no part of this check. If MAP_LIB_RESULTS names a checkout of
modelica/MAP-LIB_ReferenceResults, runs are compared with the results in it, and with SciPy's Radau from event to event.
"""

import math
import os
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.library import libraries, standard_subset
from fmus.symbolic.system import SymbolicSystem
from tests.benchmarks.constructs.constructs import CONSTRUCTS, Construct
from tests.benchmarks.constructs.published import deviation, published

REPORT = Path("docs/benchmarks/constructs.md")
TIME, INPUT = 0.3, 0.5
PUBLISHED = """`off published` is the largest difference of a run (relative tolerance 1e-10) from the published signals, as a share of each
signal's largest value; behind `SciPy` that from SciPy's Radau (1e-9) with the events found once more in Python. The published runs
have a tolerance of 1e-6 and were made by Dymola 2020x from version 4.0.0: EddyCurrentBrake has a ramp since, and with the excitation
of 1 that it had there it is 1.7e-6 off."""
AREAS = (
    "Mechanics/Rotational/Examples",
    "Mechanics/Translational/Examples",
    "Electrical/Analog/Examples",
    "Thermal/HeatTransfer/Examples",
)


def main() -> int:
    """Write the table; exit code 1 if anything is wrong."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MISFIT_CACHE"] = str(Path(folder) / "cache")
        rows = [(c.name, *_outcome(c, Path(folder))) for c in CONSTRUCTS]
        library = libraries()["Modelica"]
        fmu = Path(folder) / "model.fmu"
        found = [] if library == standard_subset() else _examples(library)
        models = [(name, *_built(name, path, fmu)) for name, path in found]
    text = _table("Language constructs", "construct", rows)
    if models:
        text += "\n" + _table(
            f"Models of the Modelica Standard Library {_version(library)}", "model", models, PUBLISHED
        )
    before = REPORT.read_text() if REPORT.is_file() else ""
    if not models and "## Models of" in before:  # keep what another machine measured
        text += "\n## Models of" + before.split("## Models of", 1)[1]
    REPORT.write_text(f"# What of Modelica works\n\nWritten by `python -m tests.benchmarks.constructs.run`.\n\n{text}")
    sys.stdout.write(text)
    return int(any(row[1] == "wrong" for row in (*rows, *models)))


def _outcome(construct: Construct, folder: Path) -> tuple[str, str]:
    file = folder / "M.mo"
    file.write_text(construct.text)
    try:
        found = _value(ModelicaModel("M", "M", file), construct.variable)
    except MisfitError as error:
        return "refused", str(error)
    if math.isnan(construct.value):
        return ("works", "") if construct.name.startswith("delay") else ("wrong", f"{found:g}, to be refused")
    if abs(found - construct.value) < 1e-9 * max(1.0, abs(construct.value)):
        return "works", ""
    return "wrong", f"{found:g} instead of {construct.value:g}"


def _value(model: ModelicaModel, variable: str) -> float:
    system = model.compile()
    states = [v.start for v in system.states]
    inputs, parameters = [INPUT] * len(system.inputs), [v.start for v in system.parameters]
    delayed = [INPUT] * system.n_delays
    arguments = [TIME, states, inputs, delayed, parameters]
    found = system.relations.rhs(*_settled(system, arguments)) if system.remembers else system.rhs(*arguments)
    dx, z = (np.array(part).ravel() for part in found)
    names = [*(f"der({v.name})" for v in system.states), *(v.name for v in system.algebraics)]
    return float(dict(zip(names, [*dx, *z], strict=True)).get(variable, math.inf))


def _settled(system: SymbolicSystem, arguments: list[Any]) -> list[Any]:
    """The arguments with relations and memories as Modelica's event iteration leaves them."""
    relations = system.relations
    assert relations is not None and relations.memory is not None
    time, parameters = arguments[0], arguments[4]
    instants, rising = (np.array(part).ravel() for part in relations.times(parameters))
    timed = np.where(rising > 0, time >= instants, time < instants).astype(float)
    sides, memory = np.zeros(relations.n_indicators), np.array(relations.memory.start(time, parameters)).ravel()
    while True:
        before = np.concatenate([sides, timed, memory])
        sides = (np.array(relations.indicators(*arguments, before)[0]).ravel() > 0).astype(float)
        if np.array_equal(sides, before[: len(sides)]):
            memory, states = (np.array(part).ravel() for part in relations.memory.update(*arguments, before))
            arguments = [time, states, *arguments[2:]]
        now = np.concatenate([sides, timed, memory])
        if np.array_equal(now, before):
            return [*arguments, now]


def _examples(library: Path) -> list[tuple[str, Path]]:
    found = []
    for area in AREAS:
        for file in sorted((library / area).glob("*.mo")):
            if file.name != "package.mo":
                found.append((".".join(("Modelica", *area.split("/"), file.stem)), file))
    return found


def _version(library: Path) -> str:
    found = re.search(r'^\s*version="([^"]*)"', (library / "package.mo").read_text(), re.MULTILINE)
    return found[1] if found else ""


def _built(name: str, file: Path, fmu: Path) -> tuple[str, str, str]:
    try:
        system = ModelicaModel(name, name, file).compile()
    except MisfitError as error:
        return "refused", str(error), ""
    run, unchecked = _off(system, name, fmu), [note for note in system.notes if "not checked" in note]
    if not unchecked:
        return "works", "", run
    return "not checked" if unchecked[0].startswith("the translation was") else "partly checked", unchecked[0], run


def _off(system: SymbolicSystem, name: str, fmu: Path) -> str:
    """How far a run is from the published one and from SciPy's, in words."""
    folder = published(name)
    if folder is None:
        return "not published"
    try:
        return off_in_words(*deviation(system, folder, fmu))
    except Exception as error:
        return f"ends early: {str(error).splitlines()[0][:60]}"


def off_in_words(far: float, integrated: float | None) -> str:
    return f"{far:.1e}" + ("" if integrated is None else f", SciPy {integrated:.1e}")


def _table(title: str, what: str, rows: Sequence[tuple[str, ...]], words: str = "") -> str:
    counts = Counter(row[1] for row in rows)
    summary = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
    heads = (what, "outcome", "why", "off published")[: len(rows[0])]
    lines = [
        f"## {title}",
        "",
        f"{len(rows)}: {summary}.",
        "",
        *([words, ""] if words else []),
        f"| {' | '.join(heads)} |",
        "|---" * len(heads) + "|",
    ]
    lines += [f"| {' | '.join(cell[:200].replace('|', '/') for cell in row)} |" for row in rows]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
