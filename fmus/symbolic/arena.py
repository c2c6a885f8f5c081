"""Read access to the front end's flat DAE: expression nodes with their operands, variables, source positions."""

from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from fmus.errors import ModelicaError

SCHEMA_VERSION = 43
# A quotient (div, mod, rem) of variables reserves six node numbers that carry no node of their own.
QUOTIENT_GAP = 6

Node = tuple[str, Any]

# Of the constructors of the Standard Library's tables.
TABLE_ARGUMENT = 2


class Arena:
    """The DAE of one model; expressions are addressed by their position in one list of nodes.

    `node(i)` is `(tag, body)`; `operands(i)` lists the operands (or subscripts) of a node, which the
    representation stores in two flat lists in node order.
    """

    def __init__(self, dae: Mapping[str, Any]) -> None:
        if dae.get("schema_version") != SCHEMA_VERSION:
            raise ModelicaError(
                f"the Modelica front end speaks schema {dae.get('schema_version')}, this misfit needs "
                f"{SCHEMA_VERSION}; install the locked version of rumoca"
            )
        self.storage: dict[str, Any] = dae["storage"]
        self.variables: list[dict[str, Any]] = self.storage["variables"]
        self.functions: list[dict[str, Any]] = self.storage["functions"]
        self.tables: list[dict[str, Any]] = dae.get("external_tables") or []
        self._flat: Mapping[str, Any] = (dae.get("flat") or {}).get("variables") or {}
        self._files = {entry[0]: (entry[1], entry[2]) for entry in dae["source_map"]["files"]}
        self._nodes: list[Node] = []
        self._operands: dict[int, list[Any]] = {}
        self._read_nodes(self.storage["expressions"])
        self.folds = {index: self._folds(index, function) for index, function in enumerate(self.functions)}

    def _read_nodes(self, expressions: Mapping[str, Any]) -> None:
        operands, subscripts = iter(expressions["operands"]), iter(expressions["subscripts"])
        for node in expressions["nodes"]:
            tag: str
            body: Any
            tag, body = (node, None) if isinstance(node, str) else next(iter(node.items()))
            if isinstance(body, dict) and "operand_count" in body:
                self._operands[len(self._nodes)] = [next(operands) for _ in range(body["operand_count"])]
            if isinstance(body, dict) and "subscript_count" in body:
                self._operands[len(self._nodes)] = [next(subscripts)["kind"] for _ in range(body["subscript_count"])]
            self._nodes.append((tag, body))
            if tag == "runtime_quotient_owner" and "model" in body["kind"]:
                self._nodes.extend([("gap", None)] * QUOTIENT_GAP)
        if next(operands, None) is not None or next(subscripts, None) is not None:
            raise ModelicaError("the front end's expressions were not understood (operands left over)")

    def _folds(self, index: int, function: Mapping[str, Any]) -> dict[int, tuple[list[int], list[int]]]:
        """Match each loop of a function (by identity of its body) with its fold nodes.

        Fold parameters are numbered when a loop begins, fold outputs when it ends.
        """
        begins = self._fold_nodes("function_fold_parameter", index)
        ends = self._fold_nodes("function_fold_output", index)
        found: dict[int, tuple[list[int], list[int]]] = {}

        def walk(statements: list[dict[str, Any]]) -> None:
            for statement in statements:
                loop = statement.get("for")
                if loop is not None:
                    first = [next(begins) for _ in loop["targets"]]
                    walk(loop["statements"])
                    found[id(loop)] = (first, [next(ends) for _ in loop["targets"]])

        walk(function["statements"])
        return found

    def _fold_nodes(self, tag: str, function: int) -> Iterator[int]:
        return (i for i, (t, body) in enumerate(self._nodes) if t == tag and body["function"] == function)

    def node(self, index: int) -> Node:
        """Return the tag and the body of a node."""
        return self._nodes[index]

    def operands(self, index: int) -> list[Any]:
        """Return the operands or subscripts of a node."""
        return self._operands.get(index, [])

    def is_implicit(self, index: int, variable: Mapping[str, Any]) -> bool:
        """Tell a value that the front end made up from one that is written: it points at the whole declaration."""
        own = self.storage["expressions"]["provenance"][index]
        return bool(own == variable["declaration"] or own.get("origin") != "source")

    @cached_property
    def table_names(self) -> dict[int, list[str]]:
        """Names of the handles of tables by their numbers."""
        found: dict[int, list[str]] = {}
        for variable in self.variables:
            node = variable["attributes"].get("binding")
            if variable["name"].endswith("tableID") and node is not None:
                tag, body = self.node(node)
                if tag == "literal" and "integer" in body:
                    found.setdefault(body["integer"], []).append(variable["name"])
        return found

    def table_source(self, handle: str) -> str:
        """Name of the parameter that holds the rows of a table, empty where it is none; blocks call theirs `table`."""
        call = (self._flat.get(handle) or {}).get("binding") or {}
        arguments = call.get("FunctionCall", {}).get("args") or []
        if len(arguments) <= TABLE_ARGUMENT:
            return handle.removesuffix("tableID") + "table"
        written = arguments[TABLE_ARGUMENT].get("VarRef")
        return str(written["name"]["name"]) if written and not written["subscripts"] else ""

    def value_type(self, index: int) -> dict[str, Any]:
        """Return the scalar kind and the dimensions of a variable's or function value's type."""
        return self.storage["value_types"][index]

    def binders(self, domain: int) -> list[dict[str, Any]]:
        """Return the iterators of a for-equation, comprehension or loop."""
        return self.storage["domains"][domain]["domain"]["binders"]

    def text_and_place(self, index: int) -> tuple[str, str]:
        """Return a node as it is written in the source, and where."""
        provenance = self.storage["expressions"]["provenance"][index]
        span = provenance.get("span")
        if span is None or span["source"] not in self._files:
            return "", ""
        text = self._files[span["source"]][1].encode()[span["start"] : span["end"]].decode()
        return " ".join(text.split()), self.where(provenance)

    def package(self, provenance: Mapping[str, Any] | None) -> str:
        """The library in whose files something stands; empty if it is generated or stands in the user's file."""
        if not provenance or "span" not in provenance or provenance["span"]["source"] not in self._files:
            return ""
        parts = Path(self._files[provenance["span"]["source"]][0]).parts
        return parts[parts.index("libraries") + 1] if "libraries" in parts[:-1] else ""

    def where(self, provenance: Mapping[str, Any] | None) -> str:
        """Say where in the source something stands, as `file:line`, empty if it is generated."""
        if not provenance or "span" not in provenance or provenance["span"]["source"] not in self._files:
            return ""
        span = provenance["span"]
        path, text = self._files[span["source"]]
        # Spans count bytes, not characters.
        line = text.encode()[: span["start"]].count(b"\n") + 1
        return f"{path.rsplit('/', 1)[-1]}:{line}"
