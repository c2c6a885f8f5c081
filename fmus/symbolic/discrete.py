"""Boolean and Integer variables that are functions of the present: `contact = s < 0`.

Such a variable has no memory, so it is its expression, and the relations in it are events as in any equation. What keeps a value,
by `when` or `pre()`, is not of this kind.
"""

from collections.abc import Mapping
from typing import Any

from fmus.symbolic.arena import Arena


def expressions(arena: Arena) -> dict[int, int]:
    """Nodes of the expressions of such variables, by the numbers of the variables."""
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
