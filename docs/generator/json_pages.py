"""The reference of JSON documents: their keys, read from the code that writes them."""

import ast
import dataclasses
import importlib
import inspect
import textwrap
from dataclasses import dataclass
from itertools import repeat

from docs.generator.type_text import dataclasses_in, hints_of, text_of


@dataclass(frozen=True)
class Document:
    """A JSON document: its schema, the command that writes it, the module that makes it, and what its parts are made from."""

    schema: str
    command: str
    module: str
    sources: tuple[str, ...] = ()


DOCUMENTS = (
    Document("misfit.compare/1", "misfit compare --json F", "orchestrator.compare.result", ("Comparison",)),
    Document("misfit.diagnosis/1", "misfit diagnose --json F", "orchestrator.verdicts.result", ("Diagnosis",)),
    Document("misfit.ledger/1", "misfit ledger --json F", "orchestrator.ledger", ("LedgerEntry",)),
    Document("misfit.run/1", "misfit run --json F", "orchestrator.cli.cosim", ("orchestrator.cosim.run:RunOutcome",)),
    Document("misfit.swap/1", "misfit run --swap ... --json F", "orchestrator.cosim.swap.report", ("SwapReport",)),
    Document("misfit.sweep/1", "misfit sweep --json F", "orchestrator.cli.sweep"),
    Document("misfit.validate/1", "misfit validate --json F", "orchestrator.cli.factory"),
    Document("misfit.regress/1", "misfit regress --json F", "orchestrator.regress.outcome"),
    Document(
        "misfit.blocks/1", "misfit blocks --json F", "orchestrator.cli.blocks", ("orchestrator.gp.alike:Agreement",)
    ),
    Document("misfit.learn/1", "misfit learn --json F", "orchestrator.cli.learn"),
    Document("misfit.study/1", "misfit study caregivers --json F", "orchestrator.study.document"),
    Document("misfit.hil/1", "misfit hil hold --json F", "hil.session.entry"),
)


@dataclass(frozen=True)
class Key:
    """A key of a document: the attribute that its value is, or what is known of the value in words."""

    name: str
    source: str = ""
    words: str = ""


# Stands for all fields of a data class, where a dictionary takes them over.
ALL_FIELDS = "*"


def json_page() -> str:
    """Keys of the JSON documents, and the data classes that they are made from."""
    parts = [
        "# JSON documents",
        "What `--json` writes. Keys and types are read from the code; units and signs stand in the texts below, which are"
        " those of the classes that hold the values. Where a value is worked out on the way, its cell says only what is certain, or"
        " nothing. New keys may come in a version; a key that goes or changes its meaning"
        " raises the number behind the schema.",
    ]
    parts += [part for document in DOCUMENTS for part in _json_section(document)]
    parts += ["## Parts of the documents", *_part_sections()]
    return "\n\n".join(parts) + "\n"


def _json_section(document: Document) -> list[str]:
    types = _types(document)
    rows = [f"| `{key.name}` | {types.get(key.source) or key.words} |" for key in _keys(document)]
    return [
        f"## {document.schema} {{: #{document.schema.replace('.', '-').replace('/', '-')} }}",
        f"Written by `{document.command}`.",
        "\n".join(["| key | value |", "|---|---|", f"| `schema` | `{document.schema}` |", *rows]),
    ]


def _types(document: Document) -> dict[str, str]:
    return {name: text for source in _sources(document) for name, text in hints_of(source).items()}


def _sources(document: Document) -> list[type]:
    found = []
    for source in document.sources:
        module, _, name = source.rpartition(":")
        found.append(getattr(importlib.import_module(module or document.module), name))
    return found


def _keys(document: Document) -> list[Key]:
    """Keys of the dictionary that carries the schema.

    Raises:
        ValueError: if the module writes no such dictionary.
    """
    module = importlib.import_module(document.module)
    tree = ast.parse(inspect.getsource(module))
    names = {document.schema, *(name for name, value in vars(module).items() if value == document.schema)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Dict) and any(map(_is_schema, node.keys, node.values, repeat(names))):
            found = [key for key in _written_keys(node) if key.name != "schema"]
            return found or [key for source in _sources(document) for key in _fields(source)]
    raise ValueError(f"{document.module} writes no document {document.schema}")


def _written_keys(written: ast.Dict) -> list[Key]:
    """Keys that a dictionary in the code spells out, those that it takes over from another one by name included."""
    found: list[Key] = []
    for key, value in zip(written.keys, written.values, strict=True):
        if isinstance(key, ast.Constant):
            found.append(Key(str(key.value), _attribute(value), _literally(value)))
        elif isinstance(value, ast.Call) and getattr(value.func, "id", "") == "asdict":
            found.append(Key(ALL_FIELDS))
        elif isinstance(value, ast.DictComp) and isinstance(value.generators[0].iter, ast.Tuple):
            found += [Key(str(item.value)) for item in value.generators[0].iter.elts if isinstance(item, ast.Constant)]
    return found


def _literally(value: ast.expr) -> str:
    """What an expression says of its value where it hands on no attribute."""
    if isinstance(value, ast.Dict):
        keys = [f"`{k.value!s}`" for k in value.keys if isinstance(k, ast.Constant)]
        return f"object with {', '.join(keys)}" if len(keys) == len(value.keys) else "object"
    if isinstance(value, ast.DictComp):
        return "object by name"
    if isinstance(value, ast.List | ast.ListComp):
        return "list"
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Name):
        return {"str": "text", "list": "list", "sum": "number", "len": "whole number", "bool": "true or false"}.get(
            value.func.id, ""
        )
    return "number" if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Div) else ""


def _is_schema(key: ast.expr | None, value: ast.expr, names: set[str]) -> bool:
    said = value.value if isinstance(value, ast.Constant) else getattr(value, "id", None)
    return isinstance(key, ast.Constant) and key.value == "schema" and said in names


def _attribute(value: ast.expr) -> str:
    """The attribute that an expression hands on as it is, such as `signals` in `list(self.signals)`; else empty."""
    if isinstance(value, ast.Attribute):
        return value.attr if isinstance(value.value, ast.Name) else ""
    if isinstance(value, ast.IfExp):
        return _attribute(value.orelse) or _attribute(value.body)
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.BitOr):
        return _attribute(value.left)
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id in _AS_THEY_ARE:
        return _attribute(value.args[0]) if len(value.args) == 1 else ""
    if isinstance(value, ast.ListComp) and _is_element(value.elt):
        return _attribute(value.generators[0].iter)
    return ""


_AS_THEY_ARE = ("list", "dict", "tuple", "asdict")


def _is_element(value: ast.expr) -> bool:
    """Whether an expression writes one element of a list: `asdict(each)`, `list(each)`, `each.to_json()`."""
    if isinstance(value, ast.BinOp):
        return _is_element(value.left)
    if not isinstance(value, ast.Call):
        return False
    if isinstance(value.func, ast.Attribute):
        return value.func.attr == "to_json"
    return isinstance(value.func, ast.Name) and value.func.id in _AS_THEY_ARE and len(value.args) == 1


def _part_sections() -> list[str]:
    """Every data class that the value of a key shows, with its text and keys, and those that it holds."""
    wanted: dict[str, type] = {}
    waiting: list[type] = [found for document in DOCUMENTS for found in _held(document)]
    while waiting:
        source = waiting.pop(0)
        if source.__name__ not in wanted:
            wanted[source.__name__] = source
            waiting += dataclasses_in(source, {key.source for key in _part_keys(source)})
    return [part for name in sorted(wanted) for part in _part(wanted[name])]


def _held(document: Document) -> list[type]:
    named = {key.source for key in _keys(document)}
    return [found for source in _sources(document) for found in dataclasses_in(source, named)]


def _part_keys(source: type) -> list[Key]:
    """Keys that a data class writes: those of its own `to_json` where it has one, else its fields."""
    own = getattr(source, "to_json", None)
    written = ast.parse(textwrap.dedent(inspect.getsource(own))) if own else None
    for node in ast.walk(written) if written else ():
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Dict):
            keys = _written_keys(node.value)
            if not keys or keys[0].name != ALL_FIELDS:
                return keys
            others = {key.name: key for key in keys[1:]}
            return [others.pop(key.name, key) for key in _fields(source)] + list(others.values())
    return _fields(source)


def _fields(source: type) -> list[Key]:
    return [Key(field.name, field.name) for field in dataclasses.fields(source)]


def _part(source: type) -> list[str]:
    text = text_of(source).replace("*", r"\*")
    types = hints_of(source)
    rows = [f"| `{key.name}` | {types.get(key.source) or key.words} |" for key in _part_keys(source)]
    return [
        f"### {source.__name__} {{: #part-{source.__name__.lower()} }}",
        text,
        "\n".join(["| key | value |", "|---|---|", *rows]),
    ]
