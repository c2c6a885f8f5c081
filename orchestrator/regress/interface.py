"""Units, types and start values as a part of a reference: they are kept beside its values, and a change is a difference."""

import json
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.cosim.component import Port
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.system import System
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.prepare import DRIVE, single

SCHEMA = "misfit.interface/1"
CHECK = "interface"
_ASPECTS = ("causality", "type", "unit", "variability", "dimensions", "start")
_SEEN_FROM_OUTSIDE = ("input", "output", "parameter", "structuralParameter")
_SHOWN = 5

Interface = Mapping[str, Mapping[str, Any]]


def interface_of(system: System) -> dict[str, dict[str, Any]]:
    """Inputs, outputs and parameters of a system by address, each with its causality, type, unit, dimensions and start value.

    A variable of a system of one component needs no component before it.
    """
    alone = single(system)
    return {
        port.name if name == alone else f"{name}.{port.name}": _described(port)
        for name, spec in system.components.items()
        if name != DRIVE
        for port in describe(spec, system.folder).ports
        if port.causality in _SEEN_FROM_OUTSIDE
    }


def _described(port: Port) -> dict[str, Any]:
    values = (port.causality, port.type, port.unit, port.variability, list(port.shape), _plain(port.start))
    return dict(zip(_ASPECTS, values, strict=True))


def _plain(start: Any) -> Any:
    """A start value as JSON has it."""
    if isinstance(start, np.ndarray | np.generic):
        start = start.tolist()
    if isinstance(start, list | tuple):
        return [_plain(each) for each in start]
    return start.hex() if isinstance(start, bytes) else start


def path_beside(reference: Path) -> Path:
    """Where the interface of a reference is kept.

    Example:
        >>> path_beside(Path("ball_ref.csv")).name
        'ball_ref.csv.interface.json'
    """
    return reference.with_name(f"{reference.name}.interface.json")


def write_interface(reference: Path, interface: Interface) -> None:
    """Keep an interface beside a reference.

    Raises:
        MisfitError: if it cannot be written.
    """
    path = path_beside(reference)
    lines = ",\n".join(f"    {json.dumps(name)}: {json.dumps(each)}" for name, each in sorted(interface.items()))
    text = f'{{\n  "schema": "{SCHEMA}",\n  "variables": {{\n{lines}\n  }}\n}}\n'
    try:
        write_atomically(path, text.encode())
    except OSError as error:
        raise MisfitError(f"{path} cannot be written: {error.strerror}; choose another place") from error


def read_interface(reference: Path) -> Interface | None:
    """The interface that is kept beside a reference, None if there is none.

    Raises:
        MisfitError: if the file is none.
    """
    path = path_beside(reference)
    if not path.is_file():
        return None
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        variables = document["variables"]
        if document["schema"] != SCHEMA or not all(isinstance(each, dict) for each in variables.values()):
            raise ValueError
    except (ValueError, KeyError, TypeError, AttributeError, OSError) as error:
        raise MisfitError(f"{path} is no {SCHEMA} file; delete it and run with --update to write it anew") from error
    return dict(variables)


def changes(before: Interface, now: Interface) -> Iterator[tuple[str, str]]:
    """What changed, `VARIABLE.ASPECT`, and how in words."""
    for name, old in before.items():
        new = now.get(name)
        if new is None:
            yield f"{name}.gone", f"{name} is gone"
            continue
        for aspect in _ASPECTS:
            if aspect in old and old[aspect] != new[aspect]:
                yield f"{name}.{aspect}", f"{aspect} of {name} was {_shown(old[aspect])}, is {_shown(new[aspect])}"
    for name in now:
        if name not in before:
            yield f"{name}.new", f"{name} is new"


def _shown(value: Any) -> str:
    text = "none" if value in ("", None) else json.dumps(value, ensure_ascii=False).strip('"')
    return text if len(text) <= 40 else f"{text[:37]}..."


def judge_interface(before: Interface, now: Interface, allowed: Sequence[str]) -> WholeVerdict:
    """Whether nothing changed but what a case allows, by patterns of `VARIABLE.ASPECT`.

    Args:
        before: the interface as it was recorded.
        now: the interface as it is.
        allowed: patterns such as `mass.start`, of changes that may be.
    """
    found = list(changes(before, now))
    wrong = [(key, words) for key, words in found if not any(fnmatchcase(key, pattern) for pattern in allowed)]
    figures = {"changed": [key for key, _ in found], "not_allowed": [key for key, _ in wrong]}
    if not wrong:
        return WholeVerdict(CHECK, True, "nothing changed" if not found else "only what is allowed changed", figures)
    more = f", and {len(wrong) - _SHOWN} more" if len(wrong) > _SHOWN else ""
    words = "; ".join(words for _, words in wrong[:_SHOWN]) + more
    advice = f"run with --update to take it in, or allow it: [interface] allow = [{json.dumps(wrong[0][0])}]"
    return WholeVerdict(CHECK, False, f"{words}; {advice}", figures)
