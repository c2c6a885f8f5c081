"""The reference of TOML files: their keys, read from the code that reads them."""

import ast
import dataclasses
import importlib
import inspect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from docs.generator.type_text import hints_of, text_of
from hil.emulation.settings import Learning
from hil.safety.limits import JointLimits, Limits, Zone
from orchestrator.measurements.case_file import _REMARK_KEYS

ROOT = Path(__file__).parents[2]


# What a method of TomlTable, or a function on top of it, promises of the value that it returns.
KINDS = {
    "get_table": "table",
    "get_text": "text",
    "get_texts": "list of texts",
    "get_integers": "list of whole numbers",
    "get_window": "[start, stop] in s",
    "get_number": "number",
    "get_positive": "number above 0",
    "get_flag": "true or false",
    # Functions of the readers themselves, which take the table first.
    "_address": "COMPONENT.VARIABLE",
    "_text": "text",
    "_number": "number",
}


@dataclass(frozen=True)
class TomlFile:
    """A TOML format: `tables` maps a table's name to the tuple of its keys, as `module:NAME`; `also` are further keys at the top.

    `example` is in the repository.
    """

    name: str
    what: str
    guide: str
    modules: tuple[str, ...]
    tables: Mapping[str, str]
    example: str
    also: tuple[str, ...] = ()


TOML_FILES = (
    TomlFile(
        "case.toml",
        "describes a measurement set",
        "../measurements.md",
        ("orchestrator.measurements.case_file", "orchestrator.measurements.split"),
        {"": "orchestrator.measurements.case_file:_KNOWN_KEYS"},
        "tests/cases/arm/case_009/case.toml",
        _REMARK_KEYS,
    ),
    TomlFile(
        "system.toml",
        "describes a system of coupled components",
        "../cosimulation.md",
        ("orchestrator.cosim.toml_file",),
        {
            "": "orchestrator.cosim.toml_file:_SYSTEM",
            "[components.NAME]": "orchestrator.cosim.toml_file:_COMPONENT",
            "[[connections]]": "orchestrator.cosim.toml_file:_CONNECTION",
            "[run]": "orchestrator.cosim.toml_file:_RUN",
        },
        "tests/cosim/arm.toml",
    ),
    TomlFile(
        "NAME.regress.toml",
        "describes a regression test",
        "../regress.md",
        ("orchestrator.regress.case_file",),
        {
            "": "orchestrator.regress.case_file:_CASE",
            "[run]": "orchestrator.regress.case_file:_RUN",
            "[interface]": "orchestrator.regress.case_file:_INTERFACE",
            "[limits]": "orchestrator.regress.case_file:_LIMITS",
        },
        "tests/cases/regress/arm.regress.toml",
        ("case",),
    ),
    TomlFile(
        "effect card",
        "says what to fit of an effect and where it can be",
        "../effect_cards.md",
        ("orchestrator.library.cards",),
        {
            "": "orchestrator.library.cards:_KEYS",
            "[parameters.NAME]": "orchestrator.library.cards:_PARAMETER_KEYS",
            "[[needs]]": "orchestrator.library.needs:KINDS",
        },
        "orchestrator/library/cards/stribeck_friction.toml",
    ),
    TomlFile(
        "protocol.toml",
        "lists the trials of a session",
        "../bench.md",
        ("hil.trials.protocol",),
        {"[[trials]]": "hil.trials.protocol:_TRIAL_KEYS", "[study]": "hil.trials.protocol:_STUDY_KEYS"},
        "hil/trials/study.toml",
    ),
)


def toml_page() -> str:
    """Keys of the TOML files."""
    parts = [
        "# TOML files",
        "The keys that each file may have, as the code that reads it knows them. A key that is not here is refused, or noted,"
        " with the nearest one. Where a cell is empty, the value has a form of its own. What the keys mean stands on the"
        " page that each section names.",
    ]
    for file in TOML_FILES:
        parts += _toml_section(file)
    parts += _bench_section()
    return "\n\n".join(parts) + "\n"


def _toml_section(file: TomlFile) -> list[str]:
    kinds = _kinds(file.modules)
    parts = [f"## {file.name}", f"It {file.what}: [guide]({file.guide})."]
    for table, place in file.tables.items():
        module, _, name = place.partition(":")
        keys = (*getattr(importlib.import_module(module), name), *(() if table else file.also))
        parts.append(f"Keys of `{table}`:" if table else "Keys at the top:")
        parts.append(
            "\n".join(["| key | value |", "|---|---|", *(f"| `{key}` | {kinds.get(key, '')} |" for key in keys)])
        )
    example = (ROOT / file.example).read_text().strip()
    parts.append(f"Example, `{file.example}`:\n\n```toml\n{example}\n```")
    return parts


def _bench_section() -> list[str]:
    """The bench file, whose tables are data classes."""
    parts = ["## bench.toml", "It describes a bench: bus, robot and limits: [guide](../bench.md)."]
    for table, source, left_out in BENCH_TABLES:
        rows = [
            f"| `{field.name}` | {hints_of(source)[field.name]} | {_default(field)} |"
            for field in dataclasses.fields(source)
            if field.name not in left_out
        ]
        parts += [
            f"### {table} {{: #part-{source.__name__.lower()} }}",
            text_of(source),
            "\n".join(["| key | value | default |", "|---|---|---|", *rows]),
        ]
    return parts


def _default(field: "dataclasses.Field[Any]") -> str:
    missing = field.default is dataclasses.MISSING
    return "that of the robot" if missing else f"`{field.default}`"


BENCH_TABLES = (
    ("[limits]", Limits, ("joints", "period_ns")),
    ("[[joints]]", JointLimits, ()),
    ("zones of a joint", Zone, ()),
    ("[learning]", Learning, ()),
)


def _kinds(modules: Iterable[str]) -> dict[str, str]:
    """What the code asks of the values of keys, from its calls such as `table.get_positive("step")`."""
    found: dict[str, str] = {}
    for module in modules:
        tree = ast.parse(inspect.getsource(importlib.import_module(module)))
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and node.args:
                asked = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
                key = node.args[1] if asked.startswith("_") and len(node.args) == 2 else node.args[0]
                if asked in KINDS and isinstance(key, ast.Constant):
                    found.setdefault(str(key.value), KINDS[asked])
    return found
