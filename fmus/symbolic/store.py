"""Keep explicit systems on disk, so that an unchanged class is not translated again."""

import json
from dataclasses import asdict, fields

import casadi as ca

from fmus.symbolic.system import SymbolicSystem, Variable

FUNCTIONS = ("rhs", "history", "dependent", "initial", "consistent")
VARIABLES = ("inputs", "states", "algebraics", "parameters", "dependents")


def to_bytes(system: SymbolicSystem) -> bytes:
    """Write a system as JSON, its functions in CasADi's own serialisation."""
    plain = {f.name: getattr(system, f.name) for f in fields(system) if f.name not in (*FUNCTIONS, *VARIABLES)}
    document = {
        **plain,
        **{name: [asdict(v) for v in getattr(system, name)] for name in VARIABLES},
        **{name: _serialized(getattr(system, name)) for name in FUNCTIONS},
    }
    return json.dumps(document).encode()


def from_bytes(content: bytes) -> SymbolicSystem:
    """Read what `to_bytes` has written."""
    document = json.loads(content)
    for name in VARIABLES:
        document[name] = tuple(Variable(**entry) for entry in document[name])
    for name in FUNCTIONS:
        document[name] = None if document[name] is None else ca.Function.deserialize(document[name])
    document["outputs"] = tuple(document["outputs"])
    document["notes"] = tuple(document["notes"])
    document["solved"] = tuple(map(tuple, document["solved"]))
    return SymbolicSystem(**document)


def _serialized(function: ca.Function | None) -> str | None:
    return None if function is None else function.serialize()
