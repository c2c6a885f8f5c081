"""The vocabulary of formulas: factors of what a missing force may depend on, read from `vocabulary.toml`."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from orchestrator.greybox.laws import LawParameter

FILE = Path(__file__).with_name("vocabulary.toml")
# In the text of a factor, the further variable that it speaks of.
OF = "of"


@dataclass(frozen=True)
class Factor:
    """One factor of a term: Modelica text, powers of the place's quantities, shapes, memory, and words for the reader."""

    id: str
    text: str
    words: str
    powers: Mapping[str, int] = field(default_factory=dict)
    shapes: tuple[LawParameter, ...] = ()
    states: Mapping[str, str] = field(default_factory=dict)
    library: str = ""
    weighs: bool = True


@cache
def factors(group: str) -> tuple[Factor, ...]:
    """The factors of a group, such as `speed` or `by_time`."""
    table = tomllib.loads(FILE.read_text())
    return tuple(_factor(entry, table["grids"]) for entry in table[group])


def _factor(entry: dict[str, Any], grids: Mapping[str, list[float]]) -> Factor:
    shapes = tuple(_shape(name, row, grids) for name, row in entry.pop("shapes", {}).items())
    return Factor(shapes=shapes, **entry)


def _shape(name: str, row: list[Any], grids: Mapping[str, list[float]]) -> LawParameter:
    kind, grid, description, *held = row
    values = grids[grid] if isinstance(grid, str) else grid
    return LawParameter(name, kind, grid=tuple(values), fitted=not held, description=description)
