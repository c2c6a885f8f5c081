"""What an FMU says about itself: ports, abilities, dependencies; read by FMPy once for each content."""

import hashlib
import math
import pickle
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fmus.errors import FmuError
from fmus.files import cache_folder, write_atomically
from fmus.sources import SourceSet, check_identifier, sources_of
from fmus.units import SiUnit
from orchestrator.cosim.component import FLOATS, INTEGERS, Port
from orchestrator.cosim.terminals import Terminal, read_terminals

CO_SIMULATION, MODEL_EXCHANGE, SCHEDULED = "CoSimulation", "ModelExchange", "ScheduledExecution"
_TYPES2 = {"Real": "Float64", "Integer": "Int32"}
_TRUE = ("true", "1")


@dataclass(frozen=True)
class Interface:
    """One way to run the FMU, `CoSimulation`, `ModelExchange` or `ScheduledExecution`, with what it can do there."""

    kind: str
    identifier: str
    needs_execution_tool: bool = False
    once_per_process: bool = False
    can_save: bool = False
    can_serialize: bool = False
    can_differentiate: bool = False
    variable_step: bool = True
    fixed_step: float | None = None  # of the FMU's own solver, in s
    interpolates_inputs: bool = False
    has_event_mode: bool = False
    asks_within_steps: bool = False
    needs_completed_step: bool = False
    sources: tuple[SourceSet, ...] = ()


@dataclass(frozen=True)
class Dependent:
    """A variable and those that it depends on (names; None: not said, so all)."""

    name: str
    dependencies: tuple[str, ...] | None


@dataclass(frozen=True)
class FmuDescription:
    """The model description, with FMI 2 types in the words of FMI 3. Times are in s."""

    path: Path
    digest: str
    version: int
    model_name: str
    token: str
    tool: str
    interfaces: Mapping[str, Interface]
    ports: tuple[Port, ...]
    references: tuple[int, ...]
    outputs: tuple[Dependent, ...]
    derivatives: tuple[Dependent, ...]
    initial_unknowns: tuple[Dependent, ...]
    state_names: tuple[str, ...]
    n_states: int
    n_indicators: int
    dimensions: Mapping[str, tuple[int | str, ...]]  # of arrays; names are structural parameters
    start_time: float | None = None
    stop_time: float | None = None
    tolerance: float | None = None
    step: float | None = None

    @cached_property
    def by_name(self) -> Mapping[str, tuple[Port, int]]:
        """Port and value reference of each variable."""
        return {port.name: (port, vr) for port, vr in zip(self.ports, self.references, strict=True)}

    @cached_property
    def terminals(self) -> Mapping[str, Terminal]:
        """Terminals by name, which only FMI 3.0 has."""
        return read_terminals(self.path) if self.version == 3 else {}

    @cached_property
    def feedthrough(self) -> Mapping[str, Sequence[str]]:
        """For each output with declared dependencies the inputs among them; a state that is read follows none at once."""
        return {**dict.fromkeys(self.state_names, ()), **self._declared(self.outputs)}

    @cached_property
    def initial_feedthrough(self) -> Mapping[str, Sequence[str]]:
        """The same during initialisation, where it is declared apart; a state's start may be computed from inputs."""
        given = {
            name: () for name in self.state_names if name in self.by_name and self.by_name[name][0].initial == "exact"
        }
        return {**given, **self._declared(self.outputs), **self._declared(self.initial_unknowns)}

    def _declared(self, unknowns: Sequence[Dependent]) -> Mapping[str, Sequence[str]]:
        inputs = {port.name for port in self.ports if port.causality == "input"}
        return {
            unknown.name: tuple(name for name in unknown.dependencies if name in inputs)
            for unknown in unknowns
            if unknown.dependencies is not None
        }

    def interface(self, kind: str | None = None) -> Interface:
        """The wanted interface, or co-simulation where there is a choice, then model exchange.

        Raises:
            FmuError: if the FMU does not have it.
        """
        for wanted in (kind,) if kind else (CO_SIMULATION, MODEL_EXCHANGE, SCHEDULED):
            if wanted in self.interfaces:
                return self.interfaces[wanted]
        has = " and ".join(self.interfaces) or "no interface"
        raise FmuError(f"{self.path.name} offers {has}, not {kind or 'what can be run here'}; ask for what it offers")


# More than that, 0.8 GB for one array, is a mistake.
_MOST_ELEMENTS = 10**8
_known: dict[tuple[Path, int, int], FmuDescription] = {}


def read_description(path: Path | str) -> FmuDescription:
    """Read the description of an FMU: from memory, else from the cache, else by FMPy.

    Raises:
        FmuError: if the file is no FMU, is not safe to unpack, or its description cannot be read.
    """
    path = Path(path)
    try:
        stat = path.stat()
    except OSError as error:
        raise FmuError(f"{path} cannot be read: {error.strerror}; check the path") from error
    key = (path.resolve(), stat.st_mtime_ns, stat.st_size)
    if key not in _known:
        _known[key] = _read(path)
    return _known[key]


def _read(path: Path) -> FmuDescription:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FmuError(f"{path} cannot be read: {error.strerror}; expected an FMU") from error
    digest = hashlib.sha256(content).hexdigest()
    # Whatever changes what is kept changes this file.
    layout = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:16]
    cached = cache_folder("descriptions") / f"{digest}-{layout}.pickle"
    if cached.is_file():
        try:
            kept = pickle.loads(cached.read_bytes())
        except Exception:  # a damaged entry is written anew
            kept = None
        if isinstance(kept, dict):
            return FmuDescription(path=path, digest=digest, **kept)
    values = _parse(path)
    write_atomically(cached, pickle.dumps(values))
    return FmuDescription(path=path, digest=digest, **values)


def _parse(path: Path) -> dict[str, Any]:
    from fmpy import read_model_description  # type: ignore[import-untyped]

    from fmus.archive import read_archive

    read_archive(path)  # refuses what is not safe
    try:
        return _values(path, read_model_description(str(path), validate=False))
    except FmuError as error:
        raise FmuError(f"{path}: {error}" if path.name not in str(error) else str(error)) from error
    except Exception as error:  # FMPy raises whatever its XML code meets, and takes texts for numbers as they are
        words = " ".join(str(error).split()) or type(error).__name__
        raise FmuError(f"{path}: the model description cannot be read: {words}; run misfit validate {path}") from error


def _values(path: Path, parsed: Any) -> dict[str, Any]:
    version = int(str(parsed.fmiVersion).split(".")[0])
    if version not in (1, 2, 3):
        raise FmuError(f"{path} is an FMU of FMI {parsed.fmiVersion}; FMI 1.0, 2.0 and 3.0 can be run")
    experiment = parsed.defaultExperiment
    units = {unit.name: _si(unit.baseUnit) for unit in parsed.unitDefinitions if unit.baseUnit is not None}
    return {
        "version": version,
        "model_name": parsed.modelName,
        "token": parsed.instantiationToken or "",
        "tool": parsed.generationTool or "",
        "interfaces": {interface.kind: interface for interface in _interfaces(path, parsed)},
        "ports": tuple(_port(variable, units) for variable in parsed.modelVariables),
        "references": tuple(variable.valueReference for variable in parsed.modelVariables),
        "outputs": _dependents(parsed.outputs),
        "derivatives": _dependents(parsed.derivatives),
        "initial_unknowns": _dependents(parsed.initialUnknowns),
        "state_names": tuple(u.variable.derivative.name for u in parsed.derivatives if u.variable.derivative),
        "n_states": int(parsed.numberOfContinuousStates),
        "n_indicators": int(parsed.numberOfEventIndicators),
        "dimensions": {
            v.name: tuple(d.start if d.variable is None else d.variable.name for d in v.dimensions)
            for v in parsed.modelVariables
            if v.dimensions
        },
        **{
            ours: _number(getattr(experiment, theirs, None))
            for ours, theirs in (
                ("start_time", "startTime"),
                ("stop_time", "stopTime"),
                ("tolerance", "tolerance"),
                ("step", "stepSize"),
            )
        },
    }


def _variable_step1(path: Path) -> bool:
    """Whether an FMU of FMI 1.0 takes steps of any size, which FMPy does not read."""
    with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as stream:
        found = ET.parse(stream).find("Implementation//Capabilities")
    return found is not None and _flag(found.get("canHandleVariableCommunicationStepSize"))


def _differentiable(path: Path) -> dict[str, bool]:
    """Which interfaces offer directional derivatives; FMPy does not read the attribute of FMI 3."""
    found = {}
    with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as stream:
        for _, element in ET.iterparse(stream, ("start",)):
            if element.tag in (CO_SIMULATION, MODEL_EXCHANGE):
                names = ("providesDirectionalDerivatives", "providesDirectionalDerivative")
                found[element.tag] = any(_flag(element.get(name)) for name in names)
            elif element.tag == "ModelVariables":
                break
    return found


def _interfaces(path: Path, parsed: Any) -> Iterator[Interface]:
    differentiable = _differentiable(path)
    offered = (parsed.coSimulation, parsed.modelExchange, parsed.scheduledExecution)
    for kind, found in zip((CO_SIMULATION, MODEL_EXCHANGE, SCHEDULED), offered, strict=True):
        if found is None:
            continue
        check_identifier(found.modelIdentifier, path.name)
        stepping = kind == CO_SIMULATION
        first, second = (str(parsed.fmiVersion) == version for version in ("1.0", "2.0"))
        yield Interface(
            kind=kind,
            identifier=found.modelIdentifier,
            needs_execution_tool=_flag(found.needsExecutionTool),
            once_per_process=_flag(found.canBeInstantiatedOnlyOncePerProcess),
            can_save=_flag(found.canGetAndSetFMUstate),
            can_serialize=_flag(found.canSerializeFMUstate),
            can_differentiate=differentiable.get(kind, False),
            variable_step=not stepping
            or (_variable_step1(path) if first else _flag(found.canHandleVariableCommunicationStepSize)),
            fixed_step=_number(found.fixedInternalStepSize) if stepping else None,
            interpolates_inputs=stepping and second and _flag(found.canInterpolateInputs),
            asks_within_steps=stepping and _flag(getattr(found, "providesIntermediateUpdate", False)),
            has_event_mode=stepping and _flag(found.hasEventMode),
            # FMI 1.0 has no word for that it is not needed.
            needs_completed_step=kind == MODEL_EXCHANGE and (first or _flag(found.needsCompletedIntegratorStep)),
            sources=sources_of(parsed, found.modelIdentifier),
        )


def _port(variable: Any, units: Mapping[str, SiUnit]) -> Port:
    declared = variable.declaredType
    kind = _TYPES2.get(variable.type, variable.type)

    def attribute(name: str) -> Any:
        own = getattr(variable, name, None)
        return own if own is not None or declared is None else getattr(declared, name, None)

    unit = attribute("unit") or ""
    items = () if declared is None else tuple((item.name, int(item.value)) for item in declared.items)
    shape = tuple(variable.shape or ())
    check_sizes(variable.name, shape)
    return Port(
        name=variable.name,
        causality=variable.causality,
        type=kind,
        shape=shape,
        unit=unit,
        variability=variable.variability if kind != "Clock" else variable.intervalVariability or "",
        start=_start(variable, kind, shape),
        minimum=_number(attribute("min")),
        maximum=_number(attribute("max")),
        nominal=_number(attribute("nominal")),
        description=variable.description or "",
        initial=variable.initial or "",
        si=units.get(unit),
        items=items,
        clocks=tuple(clock.name for clock in variable.clocks or ()),
    )


def check_sizes(name: str, shape: tuple[int, ...]) -> None:
    """Raise FmuError for an array that nothing can hold."""
    if math.prod(shape) > _MOST_ELEMENTS or min(shape, default=0) < 0:
        raise FmuError(f"array {name!r} has the sizes {shape}; expected at most {_MOST_ELEMENTS:.0e} elements")


def _start(variable: Any, kind: str, shape: tuple[int, ...]) -> Any:
    """Start value in Python's types; an array where several values are given or the shape says so."""
    text: str | None = variable.start
    if text is None or kind == "Clock":
        return None
    if kind == "String":
        return text
    try:
        if kind == "Binary":
            return bytes.fromhex(text)
        values = [_scalar(part, kind) for part in text.split()]
    except ValueError:
        raise FmuError(f"{variable.name!r} has the start value {text!r}, which is no {kind}") from None
    if not shape:
        return values[0] if values else None
    import numpy as np

    if len(values) == 1:
        values *= math.prod(shape)
    return np.array(values).reshape(shape) if len(values) == math.prod(shape) else None


def _scalar(text: str, kind: str) -> Any:
    if kind in FLOATS:
        return float(text)
    if kind in INTEGERS or kind == "Enumeration":
        return int(text)
    return text in _TRUE


def _dependents(unknowns: Sequence[Any]) -> tuple[Dependent, ...]:
    return tuple(
        Dependent(u.variable.name, None if u.dependencies is None else tuple(v.name for v in u.dependencies))
        for u in unknowns
    )


def _si(base: Any) -> SiUnit:
    exponents = {name: getattr(base, name) for name in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")}
    return SiUnit({name: power for name, power in exponents.items() if power}, base.factor, base.offset)


def _number(text: Any) -> float | None:
    return None if text is None else float(text)


def _flag(value: Any) -> bool:
    # FMPy leaves attributes of FMI 3 as text where its default has no type.
    return value in _TRUE if isinstance(value, str) else bool(value)
