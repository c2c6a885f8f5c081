"""Discrete variables: those that are functions of the present, such as `contact = s < 0`, and those that keep a value.

The first have no memory, so such a variable is its expression, and the relations in it are events as in any equation. The second are
assigned in `when` clauses: each has branches, of which the first that becomes active counts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena


@dataclass(frozen=True)
class Branch:
    """A value that a variable takes when the condition `trigger` becomes true and `guard` holds; always if they are None."""

    value: int
    trigger: int | None
    guard: int | None


def expressions(arena: Arena) -> dict[int, int]:
    """Nodes of the expressions of variables without a `when`, by the numbers of the variables."""
    found: dict[int, int] = {}
    for owner in arena.storage["discrete_value_owners"]:
        if is_expression(owner):
            values = owner["branches"][0]["values"]
            found.update({target: value["value"] for target, value in zip(owner["targets"], values, strict=True)})
    return found


def is_expression(owner: Mapping[str, Any]) -> bool:
    """Whether a discrete variable holds what its equation says at all times."""
    branches = owner["branches"]
    return (
        owner["structure"] is None
        and len(branches) == 1
        and branches[0]["activation"] == "always"
        and len(branches[0]["values"]) == len(owner["targets"])
    )


def branches(arena: Arena) -> dict[int, Sequence[Branch]]:
    """The branches of variables that keep a value, by the numbers of the variables.

    Raises:
        ModelicaError: with the place of an equation that is not solved for one variable.
    """
    found: dict[int, list[Branch]] = {}
    for owner in arena.storage["discrete_value_owners"]:
        if is_expression(owner):
            continue
        for branch in owner["branches"]:
            when = _when(branch["activation"])
            for target, value in zip(owner["targets"], branch["values"], strict=True):
                found.setdefault(target, []).append(Branch(value["value"], *when))
    for equation in arena.storage["discrete_real_equations"]:
        target, value = _solved(arena, equation)
        found.setdefault(target, []).append(Branch(value, *_when(equation["activation"])))
    return dict(found)


def _when(activation: Any) -> tuple[int | None, int | None]:
    if activation == "always":
        return None, None
    return activation["when"]["trigger"], activation["when"]["guard"]


def _solved(arena: Arena, equation: Mapping[str, Any]) -> tuple[int, int]:
    """The variable and the value of `v = value`."""
    tag, body = arena.node(equation["residual"]) if "residual" in equation else ("", {})
    if tag == "binary" and body["operator"] == "subtract":
        for one, other in ((body["lhs"], body["rhs"]), (body["rhs"], body["lhs"])):
            kind, inner = arena.node(one)
            if kind == "coordinate" and isinstance(inner, dict) and "discrete_real" in inner:
                return inner["discrete_real"], other
    place = arena.where(equation["provenance"])
    raise ModelicaError(f"{place}: this equation of discrete variables is not supported; write it as 'v = value'")
