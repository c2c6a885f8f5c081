"""Reference results as files of an FMU, labelled by the layered standard fmi-ls-ref.

The standard says which files belong together, not what they hold. Ours are two tables in the style of the FMI
cross-check, and annotations with the step of the experiment and the tolerance of each signal.
"""

import csv
import io
import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from fmus.archive import check_xml
from fmus.description_parts import to_bytes
from fmus.errors import FmuError
from fmus.reference import Array, Experiment, Reference, pulses, solve_reference
from fmus.symbolic.system import SymbolicSystem

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{FOLDER}/fmi-ls-manifest.xml"
_LS = "http://fmi-standard.org/fmi-ls-manifest"
_ATTRIBUTES = {
    "fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    "fmi-ls-version": "1.0.0-alpha.1",
    "fmi-ls-description": "Layered Standard providing information on related files included in an FMU.",
}
_EXPERIMENT, _TOLERANCES = "misfit.experiment", "misfit.tolerances"


@dataclass(frozen=True)
class Table:
    """Columns over time (s): straight between rows, jumping where a time occurs twice."""

    times: Array  # (n_rows,), never decreasing
    names: tuple[str, ...]
    values: Array  # (n_rows, n_columns)


@dataclass(frozen=True)
class Replay:
    """An experiment to run with steps of `step` (s), and what has to come out, within a tolerance for each signal."""

    step: float
    inputs: Table
    results: Table
    tolerances: dict[str, float]


def reference_files(system: SymbolicSystem, stop_time: float, step: float) -> dict[str, bytes]:
    """The experiment, its results and the manifest, by archive path; nothing if there are no results of use.

    Args:
        system: the model.
        stop_time, step: end and communication step of the experiment, s.
    """
    experiment = pulses(system, stop_time, step)
    reference = solve_reference(system, experiment)
    if reference is None:
        return {}
    units = {v.name: v.unit for v in (*system.states, *system.algebraics)}
    inputs = _input_table(system, experiment, float(reference.times[-1]))
    return {
        MANIFEST: _manifest(experiment.step, reference, units),
        f"{FOLDER}/inputs.csv": _to_csv(inputs),
        f"{FOLDER}/reference.csv": _to_csv(Table(reference.times, reference.names, reference.values)),
    }


def read_replay(folder: Path) -> Replay | None:
    """The replay of an unpacked FMU; None if it has none of ours.

    Raises:
        FmuError: if the manifest or a file that it names cannot be read.
    """
    manifest = folder / MANIFEST
    if not manifest.is_file():
        return None
    check_xml(manifest.read_bytes(), MANIFEST)
    related = {str(e.get("role")): e for e in ET.fromstring(manifest.read_bytes()).iterfind("Related")}
    for element in related.values():
        _source(element, manifest)
    experiment = _annotation(related.get("experiment/validation"), _EXPERIMENT, "Experiment")
    tolerances = _annotation(related.get("result"), _TOLERANCES, "Tolerance")
    if not experiment or not tolerances:
        return None
    inputs = _read_csv(_source(related["experiment/validation"], manifest))
    results = _read_csv(_source(related["result"], manifest))
    limits = {str(e.get("name")): _number(e, "absolute") for e in tolerances}
    for name in results.names:
        if not limits.get(name, math.nan) > 0.0:
            raise FmuError(f"{MANIFEST} gives no positive tolerance for {name!r}")
    return Replay(_number(experiment[0], "stepSize"), inputs, results, limits)


def _input_table(system: SymbolicSystem, experiment: Experiment, last: float) -> Table:
    """Two rows for each jump, before and after it."""
    times, rows = [0.0], [experiment.levels[0]]
    for jump, before, after in zip(experiment.jumps[1:], experiment.levels, experiment.levels[1:], strict=False):
        if jump < last:
            times += [jump, jump]
            rows += [before, after]
    names = tuple(v.name for v in system.inputs)
    return Table(np.array([*times, last]), names, np.array([*rows, rows[-1]]).reshape(len(times) + 1, len(names)))


def _manifest(step: float, reference: Reference, units: dict[str, str]) -> bytes:
    ET.register_namespace("fmi-ls", _LS)
    root = ET.Element("fmiReferences", {f"{{{_LS}}}{key}": value for key, value in _ATTRIBUTES.items()})
    stop = repr(float(reference.times[-1]))
    experiment = ET.Element("Experiment", startTime="0.0", stopTime=stop, stepSize=repr(float(step)))
    words = "Inputs over time (s), straight between rows, jumping where a time occurs twice"
    _related(root, "inputs.csv", "experiment/validation", words, _EXPERIMENT, [experiment])
    tolerances = [
        ET.Element("Tolerance", name=name, absolute=repr(float(f"{limit:.3g}")), unit=units[name])
        for name, limit in zip(reference.names, reference.tolerances, strict=True)
    ]
    words = "Outputs over time (s), solved from the model's equations by CVODES"
    _related(root, "reference.csv", "result", words, _TOLERANCES, tolerances)
    return to_bytes(root)


def _related(root: ET.Element, source: str, role: str, words: str, kind: str, content: Sequence[ET.Element]) -> None:
    element = ET.SubElement(root, "Related", type="text/csv", source=source, role=role, description=words)
    ET.SubElement(ET.SubElement(element, "Annotations"), "Annotation", type=kind).extend(content)


def _annotation(element: ET.Element | None, kind: str, tag: str) -> list[ET.Element]:
    if element is None:
        return []
    return [found for a in element.iter("Annotation") if a.get("type") == kind for found in a.iterfind(tag)]


def _source(element: ET.Element, manifest: Path) -> Path:
    source = unquote(str(element.get("source")))
    path = (manifest.parent / source).resolve()
    inside = path.is_relative_to(manifest.parents[2].resolve())
    if "://" not in source and not (inside and path.is_file()):
        raise FmuError(f"{MANIFEST} names {source!r}, which is not in the FMU")
    return path


def _number(element: ET.Element, key: str) -> float:
    try:
        value = float(element.get(key, ""))
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise FmuError(f"{MANIFEST}: {key} of {element.tag} is {element.get(key)!r}; expected a positive number")
    return value


def _to_csv(table: Table) -> bytes:
    lines = [",".join(["time", *(f'"{name}"' if "," in name else name for name in table.names)])]
    lines += [",".join(f"{x:.10g}" for x in (t, *row)) for t, row in zip(table.times, table.values, strict=True)]
    return ("\n".join(lines) + "\n").encode()


def _read_csv(path: Path) -> Table:
    header, *rows = list(csv.reader(io.StringIO(path.read_text(errors="replace")))) or [[]]
    try:
        numbers = np.array([[float(cell) for cell in row] for row in rows]).reshape(len(rows), len(header))
    except ValueError as error:
        raise FmuError(f"{path.name} is not a table of numbers with a row of names: {error}") from error
    if (
        header[:1] != ["time"]
        or not len(numbers)
        or not np.isfinite(numbers).all()
        or (np.diff(numbers[:, 0]) < 0).any()
    ):
        raise FmuError(f"{path.name} needs a first column 'time' that does not go back, and finite numbers")
    return Table(numbers[:, 0], tuple(header[1:]), numbers[:, 1:])
