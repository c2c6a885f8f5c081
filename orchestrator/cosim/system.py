"""A system as it was described: components, connections and how to run them; nothing is loaded or checked yet."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.units import SiUnit


@dataclass(frozen=True)
class Value:
    """A value given by the user; `unit` is "" where it is meant in the unit of the variable.

    `si` is what the file with the value defines the unit to mean, where it does.
    """

    value: Any
    unit: str = ""
    si: SiUnit | None = None


@dataclass(frozen=True)
class ComponentSpec:
    """How to make one component.

    `source` is a file relative to the folder of the system, or `module:Class`; what else a kind needs is in `options`.
    `values` are parameters and start values by variable, `units` the units of variables for which the component names
    none. `step` is the component's own communication step in s, None for that of the system. `isolate` asks for a worker
    process, None leaves it to the run.
    """

    name: str
    kind: str = "fmu"
    source: str = ""
    values: Mapping[str, Value] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    step: float | None = None
    isolate: bool | None = None
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Connection:
    """From an output to an input, both `component.variable`, or one element of an array `component.variable[i]`.

    The target receives `factor * x + offset`, with x converted from the unit of the source to that of the target
    beforehand unless `convert` is False. `mapping` holds pairs of values instead, for integers, Booleans and enumerations;
    a value that is not among them stays as it is.
    """

    source: str
    target: str
    factor: float = 1.0
    offset: float = 0.0
    mapping: tuple[tuple[Any, Any], ...] = ()
    convert: bool = True


@dataclass(frozen=True)
class RunSettings:
    """How to run a system where the caller does not say: times in s, None for what the components suggest.

    `options` belong to the master, such as the order of extrapolation. `nan` says what to do about outputs that are not
    finite numbers, by patterns of names: stop, hold or warn.
    """

    start: float | None = None
    stop: float | None = None
    step: float | None = None
    master: str = "ordered"
    tolerance: float | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    nan: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class System:
    """Components by name and the connections between them.

    A component's name has no dot; what follows the first dot of an address is the variable, which may have dots. `inputs`
    maps an input of the system to the component inputs that it drives, `outputs` an output of the system to the component
    output that it shows; `units` holds the units of either where they differ from those of the (first) variable inside.
    `definitions` says what the names of units mean to this system, where it says so. `folder` is where the files of the
    components are. `notes` are lines for the user about what was assumed or left out when the system was read.
    """

    name: str
    components: Mapping[str, ComponentSpec]
    connections: tuple[Connection, ...] = ()
    inputs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    definitions: Mapping[str, SiUnit] = field(default_factory=dict)
    run: RunSettings = field(default_factory=RunSettings)
    folder: Path = field(default_factory=Path)
    notes: tuple[str, ...] = ()

    def with_values(self, values: Mapping[str, Value]) -> "System":
        """The same system with further values, each by `component.variable` or the name of an input of the system.

        Raises:
            MisfitError: if an address is none, or there is no such component.
        """
        components = dict(self.components)
        for address, value in values.items():
            if address in self.inputs and not value.unit:
                unit = self.units.get(address, "")
                value = replace(value, unit=unit, si=self.definitions.get(unit))
            for inside in self.inputs.get(address, (address,)):
                name, variable = split_address(inside)
                self.component(name)
                spec = components[name]
                components[name] = replace(spec, values={**spec.values, variable: value})
        return replace(self, components=components)

    def with_component(self, spec: ComponentSpec) -> "System":
        """The same system with the component of that name replaced.

        Raises:
            MisfitError: if there is no such component.
        """
        return replace(self, components={**self.components, self.component(spec.name).name: spec})

    def component(self, name: str) -> ComponentSpec:
        """The component of that name.

        Raises:
            MisfitError: if there is none; the message lists what there is.
        """
        try:
            return self.components[name]
        except KeyError:
            known = ", ".join(self.components)
            raise MisfitError(f"system {self.name!r} has no component {name!r}; it has {known}") from None


def split_address(address: str) -> tuple[str, str]:
    """Component and variable of an address.

    Raises:
        MisfitError: if it has no dot with something on either side.

    Example:
        >>> split_address("arm.joint1.q")
        ('arm', 'joint1.q')
    """
    component, _, variable = address.partition(".")
    if not component or not variable:
        raise MisfitError(f"{address!r} is no address of a variable; expected COMPONENT.VARIABLE, such as arm.q1")
    return component, variable
