"""From an SSP or SSD to a flat system of components."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from fmus.errors import MisfitError
from fmus.units import SiUnit
from orchestrator.cosim.addresses import resolve
from orchestrator.cosim.compatible import unit_scaling
from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.fmu import read_description
from orchestrator.cosim.ssp.files import NAMESPACES, STRUCTURE, parse, unpacked
from orchestrator.cosim.ssp.parsing import parse_structure, transformed
from orchestrator.cosim.ssp.tree import Flat, Part, Place, Way, compose, flatten, inside
from orchestrator.cosim.system import ComponentSpec, Connection, RunSettings, System, Value
from orchestrator.measurements.wording import shown

# What SSP has no place for: steps, the master, isolation. Other tools leave annotations alone.
ANNOTATION = "misfit.run"


def read_ssp(path: Path) -> System:
    """Read an .ssp or an .ssd as a flat system; component `inner` of the system `outer` becomes `outer_inner`.

    Raises:
        MisfitError: if a file is missing or unsafe, or the structure cannot be run; the message names the place.
    """
    folder = unpacked(path) if path.suffix.lower() == ".ssp" else path.parent
    structure = folder / STRUCTURE if path.suffix.lower() == ".ssp" else path
    root = parse_structure(structure, folder)
    system = _Reader(root, flatten(root), folder).system()
    return _annotated(system, structure)


@dataclass
class _Reader:
    root: Part
    flat: Flat
    folder: Path
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.names = _names(self.flat)
        self.ports: dict[Place, dict[str, Port]] = {}
        for path, part in self.flat.components.items():
            assert part.source is not None
            try:
                self.ports[path] = {port.name: port for port in read_description(part.source).ports}
            except MisfitError as error:
                raise type(error)(f"component {self.names[path]!r}: {error}") from error

    def system(self) -> System:
        connections, inputs, outputs = [], dict[str, tuple[str, ...]](), dict[str, str]()
        for way in self.flat.ways:
            if way.target[0] in self.flat.components and self._is_parameter(way):
                continue
            connection = self._connection(way)
            if way.source[0] and way.target[0]:
                connections.append(connection)
                continue
            if not way.source[0] and not way.target[0]:
                raise MisfitError(
                    f"{self.root.name}: input {way.source[1]!r} leads to output {way.target[1]!r} past all components"
                )
            if (connection.factor, connection.offset, connection.mapping) != (1.0, 0.0, ()):
                raise MisfitError(
                    f"{connection.source} -> {connection.target}: a transformation at an input or output of the whole "
                    f"system cannot be kept; apply it to the signal outside"
                )
            if way.source[0]:
                outputs[connection.target] = connection.source
            else:
                inputs[connection.source] = (*inputs.get(connection.source, ()), connection.target)
        values = self._values(self.root, ())
        units = {
            name: connector.unit
            for name, connector in self.root.connectors.items()
            if connector.unit and (name in inputs or name in outputs)
        }
        return System(
            self.root.name,
            {self.names[path]: self._spec(path, part, values) for path, part in self.flat.components.items()},
            tuple(connections),
            inputs,
            outputs,
            units,
            self._definitions(),
            RunSettings(start=self.root.defaults.get("start"), stop=self.root.defaults.get("stop")),
            self.folder,
            tuple(self.notes),
        )

    def _spec(self, path: Place, part: Part, values: Mapping[tuple[Place, str], Value]) -> ComponentSpec:
        assert part.source is not None
        inside_folder = part.source.is_relative_to(self.folder.resolve())
        source = part.source.relative_to(self.folder.resolve()) if inside_folder else part.source
        return ComponentSpec(
            self.names[path],
            source=source.as_posix(),
            values={variable: value for (place, variable), value in values.items() if place == path},
            units={
                name: connector.unit
                for name, connector in part.connectors.items()
                if name in self.ports[path] and self._says_more(connector.unit, self.ports[path][name], part)
            },
            options={} if part.interface is None else {"interface": part.interface},
        )

    def _says_more(self, unit: str, port: Port, part: Part) -> bool:
        """Whether the unit of a connector is more than what the FMU itself says of the variable."""
        same = unit == port.unit and part.definitions.get(unit) in (None, port.si)
        return bool(unit) and port.type in FLOATS and not same

    def _is_parameter(self, way: Way) -> bool:
        """Whether a way ends in a parameter: its value comes from bindings, not while running."""
        port = self.ports[way.target[0]].get(way.target[1])
        if port is None or port.causality not in ("parameter", "structuralParameter"):
            return False
        if way.source[0]:
            raise MisfitError(
                f"{self._address(way.source, ())} -> {self._address(way.target, ())}: parameters cannot be passed from one "
                f"component to another; give the value in a parameter set"
            )
        return True

    def _connection(self, way: Way) -> Connection:
        if any(hop.source_indices for hop in way.hops[1:]) or any(hop.target_indices for hop in way.hops[:-1]):
            raise MisfitError(
                f"{self._address(way.target, ())}: elements of arrays of nested systems cannot be connected"
            )
        source = self._address(way.source, way.hops[0].source_indices)
        target = self._address(way.target, way.hops[-1].target_indices)
        converts = {hop.wire.convert for hop in way.hops}
        whole = compose(way.hops)
        if whole is None or len(converts) > 1:
            factor, offset = self._explicit(way)
            return Connection(source, target, factor, offset, convert=False)
        return Connection(source, target, whole.factor, whole.offset, whole.pairs, converts == {True})

    def _explicit(self, way: Way) -> tuple[float, float]:
        """Factor and offset of a way, each hop in the unit of its own end."""
        factor, offset = 1.0, 0.0
        unit = self._unit(way.source)
        for hop in way.hops:
            if hop.wire.transformation.pairs:
                raise MisfitError(
                    f"{self._address(way.target, ())}: mappings and linear transformations in a row cannot be joined"
                )
            there = self._unit(hop.target)
            if hop.wire.convert and unit is not None and there is not None:
                scale, shift = unit_scaling(unit, there)
                factor, offset = scale * factor, scale * offset + shift
            by = hop.wire.transformation
            factor, offset = by.factor * factor, by.factor * offset + by.offset
            unit = there or unit
        return factor, offset

    def _unit(self, point: tuple[Place, str]) -> Port | None:
        """A stand-in with the unit at a point; None where nobody says."""
        port = self.ports.get(point[0], {}).get(point[1])
        if port is not None and port.unit:
            return port
        connector = self.flat.connector(point)
        if connector is None or not connector.unit:
            return None
        part = self.flat.components.get(point[0]) or self.flat.systems[point[0]]
        return Port(point[1], "output", unit=connector.unit, si=part.definitions.get(connector.unit))

    def _address(self, point: tuple[Place, str], indices: tuple[int, ...]) -> str:
        name = f"{point[1]}[{','.join(str(i) for i in indices)}]" if indices else point[1]
        return f"{self.names[point[0]]}.{name}" if point[0] else name

    def _values(self, part: Part, path: Place) -> dict[tuple[Place, str], Value]:
        """Values of all bindings: those of outer systems go before those of inner ones, later before earlier."""
        values: dict[tuple[Place, str], Value] = {}
        for each in part.parts:
            values |= self._values(each, (*path, each.name))
        for binding in part.bindings:
            for name, value in binding.items():
                found = self._named(part, path, name, value)
                values |= found
                if not found:
                    place = ".".join((self.root.name, *path))
                    self.notes.append(f"parameter {shown(name)} at {place} names no variable and is not used")
        return values

    def _named(self, part: Part, path: Place, name: str, value: Value) -> dict[tuple[Place, str], Value]:
        if part.is_component:
            try:
                resolve(self.ports[path], name, self.names[path])
            except MisfitError:
                return {}
            return {(path, name): value}
        found: dict[tuple[Place, str], Value] = {}
        if name in part.connectors:
            unit = part.connectors[name].unit
            own = value if value.unit or not unit else replace(value, unit=unit, si=part.definitions.get(unit))
            for way in inside(self.root, self.flat, path, name):
                passed = own
                for hop in way.hops:
                    passed = passed if hop.wire.convert else Value(passed.value)
                    passed = transformed(passed, hop.wire.transformation, shown(name))
                found[way.target] = passed
        for each in part.parts:
            if name.startswith(f"{each.name}.") and each.dictionary is None:
                found |= self._named(each, (*path, each.name), name[len(each.name) + 1 :], value)
        return found

    def _definitions(self) -> dict[str, SiUnit]:
        found: dict[str, SiUnit] = {}
        for part in (*self.flat.systems.values(), *self.flat.components.values()):
            for name, unit in part.definitions.items():
                if found.setdefault(name, unit) != unit:
                    raise MisfitError(
                        f"{self.root.name}: the unit {shown(name)} is defined twice, with different meanings"
                    )
        return found


def _names(flat: Flat) -> dict[Place, str]:
    """Component names without dots, one for each path."""
    names: dict[Place, str] = {}
    for path in flat.components:
        name = wanted = "_".join(path).replace(".", "_")
        number = 1
        while name in names.values():
            number += 1
            name = f"{wanted}_{number}"
        names[path] = name
    return names


def _annotated(system: System, structure: Path) -> System:
    """The system with what an export from here noted beside SSP; anything else is ignored."""
    document = parse(structure.read_bytes(), structure, "ssd:SystemStructureDescription")
    for annotation in document.findall("ssd:Annotations/ssc:Annotation", NAMESPACES):
        if annotation.get("type") != ANNOTATION:
            continue
        try:
            noted = json.loads("".join(annotation.itertext()))
            run = replace(system.run, **noted["run"])
            components = {
                name: replace(spec, **noted["components"].get(name, {})) for name, spec in system.components.items()
            }
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise MisfitError(
                f"{structure}: the annotation {ANNOTATION} cannot be read ({error}); take it out"
            ) from error
        return replace(system, run=run, components=components)
    return system
