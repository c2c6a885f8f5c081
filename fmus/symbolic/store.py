"""Keep explicit systems on disk, so that an unchanged class is not translated again."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import casadi as ca

from fmus.symbolic.system import Relations, Remembered, SymbolicSystem, Variable

FUNCTIONS = ("rhs", "history", "dependent", "initial", "consistent")
VARIABLES = ("inputs", "states", "algebraics", "parameters", "dependents")


def to_bytes(system: SymbolicSystem) -> bytes:
    """Write a system as JSON, its functions in CasADi's own serialisation."""
    others = (*FUNCTIONS, *VARIABLES, "relations")
    plain = {f.name: getattr(system, f.name) for f in fields(system) if f.name not in others}
    document = {
        **plain,
        **{name: [asdict(v) for v in getattr(system, name)] for name in VARIABLES},
        **{name: _serialized(getattr(system, name)) for name in FUNCTIONS},
        "relations": None if system.relations is None else _relations_document(system.relations),
    }
    return json.dumps(document).encode()


def from_bytes(content: bytes) -> SymbolicSystem:
    """Read what `to_bytes` has written."""
    document = json.loads(content)
    for name in VARIABLES:
        document[name] = tuple(Variable(**entry) for entry in document[name])
    for name in FUNCTIONS:
        document[name] = None if document[name] is None else ca.Function.deserialize(document[name])
    if document["relations"] is not None:
        document["relations"] = _relations(document["relations"])
    document["outputs"] = tuple(document["outputs"])
    document["notes"] = tuple(document["notes"])
    document["solved"] = tuple(map(tuple, document["solved"]))
    return SymbolicSystem(**document)


def _serialized(function: ca.Function | None) -> str | None:
    return None if function is None else function.serialize()


RELATION_FUNCTIONS = ("rhs", "indicators", "times")
MEMORY_FUNCTIONS = ("start", "due", "update")


def _relations_document(relations: Relations) -> dict[str, Any]:
    functions = {name: getattr(relations, name).serialize() for name in RELATION_FUNCTIONS}
    memory = relations.memory
    kept = None
    if memory is not None:
        kept = {name: getattr(memory, name).serialize() for name in MEMORY_FUNCTIONS}
        kept |= {"names": memory.names, "resets": memory.resets}
    return {"names": relations.names, "holds_at_zero": relations.holds_at_zero, "memory": kept, **functions}


def _relations(document: Mapping[str, Any]) -> Relations:
    functions = {name: ca.Function.deserialize(document[name]) for name in RELATION_FUNCTIONS}
    memory, kept = None, document["memory"]
    if kept is not None:
        own = {name: ca.Function.deserialize(kept[name]) for name in MEMORY_FUNCTIONS}
        memory = Remembered(names=tuple(kept["names"]), resets=kept["resets"], **own)
    names, holds_at_zero = tuple(document["names"]), tuple(document["holds_at_zero"])
    return Relations(names=names, holds_at_zero=holds_at_zero, memory=memory, **functions)
