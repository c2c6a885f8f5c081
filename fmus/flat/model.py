"""The flat model of the front end: bindings and equations as trees."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fmus.flat.evaluate import Unknown
from fmus.flat.expressions import Tree

_OPERATORS = {
    "Add": "+",
    "Sub": "-",
    "Mul": "*",
    "Div": "/",
    "Exp": "^",
    "Lt": "<",
    "Le": "<=",
    "Gt": ">",
    "Ge": ">=",
    "Eq": "==",
    "Neq": "<>",
    "And": "and",
    "Or": "or",
    "AddElem": "+",
    "SubElem": "-",
    "MulElem": ".*",
    "DivElem": "./",
    "ExpElem": ".^",
}


@dataclass(frozen=True)
class FlatEquation:
    """`left = right`; `span` is where it stands: the number of a source, first and last byte."""

    left: Tree
    right: Tree
    span: Mapping[str, int] | None


@dataclass
class FlatModel:
    """Bindings and sizes of variables by name, and equations; `skipped` says what was not understood."""

    bindings: dict[str, Tree] = field(default_factory=dict)
    sizes: dict[str, list[int]] = field(default_factory=dict)
    equations: list[FlatEquation] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)


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


def read_flat(flat: Mapping[str, Any]) -> FlatModel:
    """Turn the front end's flat representation into trees."""
    model = FlatModel()
    for name, variable in flat["variables"].items():
        model.sizes[name] = variable["dims"]
        if variable["binding"] is not None:
            try:
                model.bindings[name] = tree_of(variable["binding"])
            except Unknown as why:
                model.skipped.append(str(why))
    for equation in flat["equations"]:
        try:
            tree = tree_of(equation["residual"])
        except Unknown as why:
            model.skipped.append(str(why))
            continue
        left, right = tree[2:] if tree[:2] == ("binary", "-") else (tree, ("number", 0.0))
        model.equations.append(FlatEquation(left, right, equation["span"]))
    return model


def tree_of(node: Any) -> Tree:
    """Convert one expression.

    Raises:
        Unknown: for a kind of node that is not known.
    """
    [(tag, body)] = node.items()
    match tag:
        case "Literal":
            [(kind, value)] = body["value"].items()
            return ("string", value) if kind == "String" else ("number", value)
        case "VarRef":
            base: Tree = ("name", body["name"]["name"])
            return ("index", base, [_subscript(s) for s in body["subscripts"]]) if body["subscripts"] else base
        case "Binary" if body["op"] in _OPERATORS:
            return ("binary", _OPERATORS[body["op"]], tree_of(body["lhs"]), tree_of(body["rhs"]))
        case "Unary":
            operand = tree_of(body["rhs"])
            return operand if body["op"] == "Plus" else ("unary", "not" if body["op"] == "Not" else "-", operand)
        case "BuiltinCall":
            name = body["function"][0].lower() + body["function"][1:]
            return ("call", name, [tree_of(a) for a in body["args"]])
        case "FunctionCall" if not body["is_constructor"]:
            return ("call", body["name"]["name"], [tree_of(a) for a in body["args"]])
        case "If":
            tree = tree_of(body["else_branch"])
            for condition, value in reversed(body["branches"]):
                tree = ("if", tree_of(condition), tree_of(value), tree)
            return tree
        case "Array":
            return ("array", [tree_of(item) for item in body["elements"]])
        case "Tuple":
            return ("outputs", [tree_of(item) for item in body["elements"]])
        case "Range":
            step = ("number", 1.0) if body["step"] is None else tree_of(body["step"])
            return ("range", tree_of(body["start"]), step, tree_of(body["end"]))
        case "Index":
            return ("index", tree_of(body["base"]), [_subscript(s) for s in body["subscripts"]])
    raise Unknown(f"the expression {tag}")


def _subscript(node: Mapping[str, Any]) -> Tree:
    [(tag, body)] = node.items()
    if tag == "Index":
        return ("number", body["value"])
    return ("all",) if tag == "Colon" else tree_of(body["expr"])
