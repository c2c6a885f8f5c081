"""A system structure as it is written: systems in systems, their connectors, connections and parameter bindings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmus.units import SiUnit
from orchestrator.cosim.system import Value


@dataclass(frozen=True)
class Connector:
    """A connector of a system or component; `kind` is input, output, parameter, ..., or "" where not said."""

    name: str
    kind: str
    unit: str = ""


@dataclass(frozen=True)
class Transformation:
    """What a connection or a mapping of parameters does to a value: a factor and an offset, or pairs of values."""

    factor: float = 1.0
    offset: float = 0.0
    pairs: tuple[tuple[Any, Any], ...] = ()

    @property
    def is_identity(self) -> bool:
        """Whether the value stays as it is."""
        return not self.pairs and (self.factor, self.offset) == (1.0, 0.0)


@dataclass(frozen=True)
class End:
    """One end of a connection: an element of the system (None for the system itself), its connector, an array's element."""

    element: str | None
    connector: str
    indices: tuple[int, ...] = ()


@dataclass(frozen=True)
class Wire:
    """A connection between two ends of one system, in either direction."""

    start: End
    end: End
    transformation: Transformation
    convert: bool


@dataclass(frozen=True)
class Part:
    """A system, a component (`source` is its file) or a reference to a signal dictionary.

    `bindings` holds values by name as seen from this part, each set after those before it. `definitions` are the units of
    the file that the part is from.
    """

    name: str
    connectors: Mapping[str, Connector]
    definitions: Mapping[str, SiUnit]
    source: Path | None = None
    interface: str | None = None
    dictionary: str | None = None
    parts: tuple["Part", ...] = ()
    wires: tuple[Wire, ...] = ()
    bindings: tuple[Mapping[str, Value], ...] = ()
    dictionaries: tuple[str, ...] = ()
    defaults: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_component(self) -> bool:
        """Whether it has a file of its own rather than parts."""
        return self.source is not None
