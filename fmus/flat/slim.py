"""What of the front end's flat equations is kept. It runs in the compiler's process, which loads nothing else of this package."""

import itertools
from collections.abc import Mapping
from typing import Any


def slim(flat: Mapping[str, Any]) -> dict[str, Any]:
    """What `read_flat` needs of the front end's representation."""
    variables = {
        name: {"binding": _without_places(v["binding"]), "dims": v["dims"]} for name, v in flat["variables"].items()
    }
    equations = [{"residual": _without_places(e["residual"]), "span": e.get("span")} for e in flat["equations"]]
    for family in flat["structured_equations"]:
        if not family["interiors_materialized"]:
            _write_out(family, equations)
    return {"variables": variables, "equations": equations}


def _write_out(family: Mapping[str, Any], equations: list[dict[str, Any]]) -> None:
    """Fill in the rows of a regular loop: the front end writes out the first ones only, the others as placeholders."""
    binders = family["domain"]["binders"]
    ranges = [range(b["lower"], b["upper"] + (1 if b["step"] > 0 else -1), b["step"]) for b in binders]
    count = family["equations_per_point"]
    body = _without_places((family["template"] or {}).get("body", []))
    for number, point in enumerate(itertools.product(*ranges)):
        values = dict(zip([b["display_name"] for b in binders], point, strict=True))
        for k in range(count):
            row = equations[family["first_equation_index"] + number * count + k]
            row["residual"] = _with_values(body[k], values) if len(body) == count else {"for-equation": None}


def _with_values(node: Any, values: Mapping[str, int]) -> Any:
    """Replace iterators by their values."""
    if isinstance(node, list):
        return [_with_values(item, values) for item in node]
    if not isinstance(node, dict):
        return node
    reference = node.get("VarRef")
    if reference is not None and not reference["subscripts"] and reference["name"]["name"] in values:
        return {"Literal": {"value": {"Integer": values[reference["name"]["name"]]}}}
    return {key: _with_values(item, values) for key, item in node.items()}


def _without_places(node: Any) -> Any:
    if isinstance(node, dict):
        return {k: _without_places(v) for k, v in node.items() if k not in ("span", "component_ref")}
    return [_without_places(item) for item in node] if isinstance(node, list) else node
