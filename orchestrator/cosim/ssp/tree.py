"""A system structure as it is written: systems in systems, their connectors, connections and parameter bindings."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.units import SiUnit
from orchestrator.cosim.system import Value
from orchestrator.measurements.wording import shown


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


_IN, _OUT = ("input", "parameter", "structuralParameter"), ("output", "calculatedParameter", "local", "constant")
_DICTIONARY = "<signal dictionary>"

# Elements from the outermost system, then the connector; a signal dictionary is an element of its system.
Place = tuple[str, ...]
Point = tuple[Place, str]


@dataclass(frozen=True)
class Hop:
    """One connection on the way from an output to an input: what it does, and where it leads."""

    wire: Wire
    target: Point
    source_indices: tuple[int, ...]
    target_indices: tuple[int, ...]


@dataclass(frozen=True)
class Way:
    """All connections from a source to a target, in the direction of the signal."""

    source: Point
    target: Point
    hops: tuple[Hop, ...]


@dataclass
class Flat:
    """Components by path, the ways between them, and the connectors of all parts."""

    components: dict[Place, Part] = field(default_factory=dict)
    systems: dict[Place, Part] = field(default_factory=dict)
    ways: list[Way] = field(default_factory=list)

    def connector(self, point: Point) -> Connector | None:
        """The connector at a point, where it was declared."""
        part = self.components.get(point[0]) or self.systems.get(point[0])
        return None if part is None else part.connectors.get(point[1])


def flatten(root: Part) -> Flat:
    """Follow the connections of all systems.

    Raises:
        MisfitError: if a connection names an element that is not there, joins two outputs or two inputs, or an input has two.
    """
    flat, into = Flat(), dict[Point, tuple[Point, Hop]]()
    _collect(root, (), flat, into, {})
    for target in into:
        if target[0] in flat.components or not target[0]:
            hops: list[Hop] = []
            source = target
            while source in into and (source == target or source[0] not in flat.components):
                source, hop = into[source]
                hops.append(hop)
                if len(hops) > len(into):
                    raise MisfitError(f"connection at {_text(target)} goes round in a circle through connectors only")
            if source[0] in flat.components or not source[0]:
                flat.ways.append(Way(source, target, tuple(reversed(hops))))
    return flat


def inside(root: Part, flat: Flat, system: Place, connector: str) -> Iterator[Way]:
    """Ways from a system's connector to the variables of components that it stands for, parameters included.

    Args:
        root: the outermost structure.
        flat: its components and systems.
        system: place of the system.
        connector: name of its connector.
    """
    part = flat.systems.get(system)
    for wire in () if part is None else part.wires:
        for own, other in ((wire.start, wire.end), (wire.end, wire.start)):
            if own.element is None and own.connector == connector and other.element is not None:
                hop = Hop(wire, ((*system, other.element), other.connector), own.indices, other.indices)
                if hop.target[0] in flat.components:
                    yield Way((system, connector), hop.target, (hop,))
                for way in inside(root, flat, *hop.target):
                    yield Way((system, connector), way.target, (hop, *way.hops))


def _collect(
    part: Part, path: Place, flat: Flat, into: dict[Point, tuple[Point, Hop]], dictionaries: Mapping[str, Place]
) -> None:
    if part.is_component:
        flat.components[path] = part
        return
    flat.systems[path] = part
    known = {**dictionaries, **{name: (*path, _DICTIONARY, name) for name in part.dictionaries}}
    for each in part.parts:
        if each.dictionary is None:
            _collect(each, (*path, each.name), flat, into, known)
        elif each.dictionary not in known:
            raise MisfitError(f"{_text((path, each.name))}: there is no signal dictionary {shown(each.dictionary)}")
    for wire in part.wires:
        _join(part, path, wire, into, known)


def _join(
    part: Part, path: Place, wire: Wire, into: dict[Point, tuple[Point, Hop]], known: Mapping[str, Place]
) -> None:
    names = {each.name: each for each in part.parts}
    points, roles = [], []
    for end in (wire.start, wire.end):
        if end.element is not None and end.element not in names:
            raise MisfitError(
                f"{_text((path, ''))}: a connection names the element {shown(end.element)}, which is not there"
            )
        owner = part if end.element is None else names[end.element]
        if owner.dictionary is not None:
            points.append((known[owner.dictionary], end.connector))
        else:
            points.append((path if end.element is None else (*path, owner.name), end.connector))
        roles.append(_role(owner, end.connector, owner is part))
    if roles[0] and roles[0] == roles[1]:
        raise MisfitError(f"connection {_text(points[0])} - {_text(points[1])} joins two {roles[0]}s")
    ends, pointed = (wire.start, wire.end), points
    if roles[0] == "target" or roles[1] == "source":
        ends, pointed = (wire.end, wire.start), points[::-1]
    source, target = pointed
    if target in into:
        raise MisfitError(
            f"{_text(target)} is the target of two connections, from {_text(into[target][0])} and {_text(source)}"
        )
    into[target] = (source, Hop(wire, target, ends[0].indices, ends[1].indices))


def _role(owner: Part, connector: str, is_own: bool) -> str:
    """Whether a connector is the source or the target of a signal within the system; "" where it is not said."""
    found = owner.connectors.get(connector)
    kind = "" if found is None else found.kind
    if kind in _IN:
        return "source" if is_own else "target"
    if kind in _OUT:
        return "target" if is_own else "source"
    return ""


def compose(hops: tuple[Hop, ...]) -> Transformation | None:
    """One transformation for all hops together; None where units between them decide what the linear ones mean."""
    changing = [hop.wire.transformation for hop in hops if not hop.wire.transformation.is_identity]
    if not changing:
        return Transformation()
    if len(changing) == 1 and (changing[0].pairs or hops[-1].wire.transformation is changing[0]):
        return changing[0]
    return None


def _text(point: Point) -> str:
    return ".".join((*point[0], point[1])).strip(".") or "the outermost system"
