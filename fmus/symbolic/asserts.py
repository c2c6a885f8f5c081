"""`assert` as a check: of parameters when the model is built, of variables by a note that says it is not watched."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ModelicaError
from fmus.symbolic.arena import Arena
from fmus.symbolic.dae import column
from fmus.symbolic.expressions import Evaluator
from fmus.symbolic.operators import BINARY, negate
from fmus.symbolic.values import Value, is_number

MOST_NOTED = 3


def check_asserts(
    arena: Arena, evaluator: Evaluator, parameters: Sequence[ca.SX], values: Sequence[float]
) -> tuple[str, ...]:
    """Evaluate the asserts of a model that speak of parameters, at their declared values.

    Args:
        arena: the model.
        evaluator: for its expressions.
        parameters: symbols of the parameters.
        values: their values.

    Returns:
        Notes about asserts that speak of variables, which no run watches.

    Raises:
        ModelicaError: with file, line and message of an assert that does not hold.
    """
    watched: list[str] = []
    for place, message, condition in _asserts(arena, evaluator):
        held = condition
        if not is_number(condition):
            known = {s.element_hash() for s in parameters}
            if any(s.element_hash() not in known for s in ca.symvar(ca.SX(condition))):
                watched.append(place)
                continue
            found = ca.Function("held", [column(list(parameters))], [ca.SX(condition)])(ca.DM(list(values)))
            held = bool(np.array(found).ravel()[0])
        if not held:
            raise ModelicaError(f"{place}: the assert does not hold at the declared values: {message}")
    if not watched:
        return ()
    more = f" and {len(watched) - MOST_NOTED} more" if len(watched) > MOST_NOTED else ""
    return (f"asserts on variables are not watched during runs: {', '.join(watched[:MOST_NOTED])}{more}",)


def _asserts(arena: Arena, evaluator: Evaluator) -> Iterator[tuple[str, str, Value]]:
    """Place, message and condition of each assert of level error."""
    for action in arena.storage["event_actions"]:
        kind = action["kind"]
        if not isinstance(kind, Mapping) or "assert" not in kind:
            continue
        failed = _condition(arena, evaluator, action["guard"])
        tag, body = arena.node(kind["assert"]["message"])
        message = body["string"] if tag == "literal" and "string" in body else "its condition is false"
        yield arena.where(action["provenance"]), message, negate(failed)


def _condition(arena: Arena, evaluator: Evaluator, index: int) -> Value:
    """The value of one of the front end's conditions."""
    node: Any = arena.storage["conditions"][index]["node"]
    if node == "always":
        return True
    if node == "initial":
        return False
    [(tag, body)] = node.items()
    if tag == "relation":
        return evaluator.value(arena.storage["relations"][body]["relation"]["expression"])
    if tag == "not":
        return negate(_condition(arena, evaluator, body))
    if tag in ("and", "or"):
        return BINARY[tag](*(_condition(arena, evaluator, body[side]) for side in ("lhs", "rhs")))
    if tag == "discrete":
        return evaluator.value(body)
    # Conditions of events, such as a rise: nothing that could be told here.
    return ca.SX.sym("unknown")
