"""Values in Modelica text."""

import re
from collections.abc import Mapping
from typing import Any

from fmus.frontend.lint.tree import ClassDef


def literal(value: float | Mapping[str, float]) -> str:
    """A number, or an array by its elements' full names, such as `m[1,2]` or `part[1].m[2]`, row-major."""
    if isinstance(value, int | float):
        return f"{float(value)!r}".removesuffix(".0") if abs(value) < 1e15 else repr(float(value))
    numbers = [literal(item) for item in value.values()]
    shape = [int(part) for part in re.findall(r"[\[,](\d+)", list(value)[-1])]
    for length in reversed(shape[1:]):
        numbers = ["{" + ", ".join(numbers[k : k + length]) + "}" for k in range(0, len(numbers), length)]
    return "{" + ", ".join(numbers) + "}"


def extended(name: str, base: str, values: Mapping[str, float | Mapping[str, float]], definition: ClassDef) -> str:
    """A class that extends another one of the same place with other values, without the last semicolon."""
    tree: dict[str, Any] = {}
    for full, value in values.items():
        *parts, last = full.split(".")
        place = tree
        for part in parts:
            place = place.setdefault(part, {})
        place[last] = literal(value)
    modifiers = ",\n    ".join(_written(tree))
    kind = "block" if definition.kind == "block" else "model"
    return f"{kind} {name}\n  // values adjusted by misfit\n  extends {base}(\n    {modifiers});\nend {name}"


def _written(tree: Mapping[str, Any]) -> list[str]:
    return [f"{k}({', '.join(_written(v))})" if isinstance(v, dict) else f"{k}={v}" for k, v in tree.items()]
