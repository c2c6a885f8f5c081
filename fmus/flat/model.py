"""The flat model of the front end: bindings and equations as trees."""

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
