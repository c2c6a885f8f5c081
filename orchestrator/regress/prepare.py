"""From a case to a system that can run: the model with its parameters, and what drives its inputs."""

from dataclasses import replace

import numpy as np

from fmus.errors import MisfitError
from orchestrator.cosim.addresses import resolve
from orchestrator.cosim.component import Port
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.load import load_system
from orchestrator.cosim.system import ComponentSpec, Connection, System, split_address
from orchestrator.measurements.wording import nearest
from orchestrator.regress.case import Case, Stimulus
from orchestrator.regress.reference import read_table, replay_of
from orchestrator.regress.wave import SOURCE, Wave, checked_wave, generated

# Name of the component that drives the inputs.
DRIVE = "inputs_of_the_case"
_DEFAULT_STEPS = 500
# A signal of so many points takes a gigabyte.
_MOST_STEPS = 1e8


def model_path(case: Case, model: str = "") -> str:
    """What `load_system` takes for the model of a case, or for another one that it names."""
    text = model or case.model
    if case.is_built and not model:
        return str(case.folder / text) if ".mo:" in text else text
    return str(case.folder / text)


def system_of(case: Case, model: str = "") -> System:
    """The system of a case, ready to run; `model` takes the place of the case's own.

    Raises:
        MisfitError: if the model cannot be read, or a parameter or input does not fit it.
    """
    system = load_system(model_path(case, model))
    if case.interface:
        system = _with_interface(system, case.interface)
    system = system.with_values({_address(system, name): value for name, value in case.parameters.items()})
    start = case.start if case.start is not None else system.run.start or 0.0
    stop = case.stop if case.stop is not None else system.run.stop
    if stop is None:
        raise MisfitError(f"{case.name}: nothing says how long to run; give stop, in s, in [run]")
    if not stop > start:
        raise MisfitError(f"{case.name}: the run would end at {stop:g} s, but begins at {start:g} s; give a later stop")
    step = case.step or system.run.step or (stop - start) / _DEFAULT_STEPS
    if case.step is None and system.run.step is None:
        described = [describe(spec, system.folder) for spec in system.components.values()]
        own = [getattr(each, "own_step", None) or getattr(each, "step", None) for each in described]
        step = min((each for each in own if each), default=step)
    if not (stop - start) / step <= _MOST_STEPS:
        raise MisfitError(f"{case.name}: {(stop - start) / step:.2g} steps of {step:g} s; give a longer step in [run]")
    master = case.master or system.run.master
    tolerance = case.solver_tolerance if case.solver_tolerance is not None else system.run.tolerance
    run = replace(system.run, start=start, stop=stop, step=step, master=master, tolerance=tolerance)
    waves = waves_of(case, start, stop, step)
    return driven(replace(system, run=run), waves)


def single(system: System) -> str:
    """Name of the only component besides what drives it; "" if there are several."""
    names = [name for name in system.components if name != DRIVE]
    return names[0] if len(names) == 1 else ""


def waves_of(case: Case, start: float, stop: float, step: float) -> dict[str, tuple[Wave, str]]:
    """Wave and unit ("": that of the input) for each driven input.

    Args:
        case: the case.
        start: beginning of the run, in s.
        stop: its end, in s.
        step: its step, in s.

    Raises:
        MisfitError: if a file or a generator cannot be used; names the case and the input.
    """
    found: dict[str, tuple[Wave, str]] = {}
    given = case.stimulus
    if given.file is not None:
        table = read_table(given.file)
        columns = given.columns or {name: name for name in table.columns}
        for name, column in columns.items():
            if column not in table.columns:
                raise MisfitError(f"{given.file} has no column {column!r}; {nearest(column, table.columns)}")
            try:
                wave = checked_wave(table.time, table.columns[column], given.hold)
            except MisfitError as error:
                raise MisfitError(f"{given.file}, column {column}: {error}") from error
            found[name] = wave, table.units.get(column, "")
    for name, signal in given.signals.items():
        try:
            found[name] = generated(signal, start, stop, step), ""
        except MisfitError as error:
            raise MisfitError(f"{case.file}: input {name}: {error}") from error
    return found


def _with_interface(system: System, interface: str) -> System:
    for spec in list(system.components.values()):
        if spec.kind == "fmu":
            system = system.with_component(replace(spec, options={**spec.options, "interface": interface}))
    return system


def _address(system: System, name: str) -> str:
    if name in system.inputs or name.partition(".")[0] in system.components:
        return name
    if len(system.components) == 1:
        return f"{next(iter(system.components))}.{name}"
    raise MisfitError(
        f"{name!r} is no COMPONENT.VARIABLE of {system.name!r}; components are {', '.join(system.components)}"
    )


def driven(system: System, waves: dict[str, tuple[Wave, str]]) -> System:
    """The system with a component that drives its inputs, which are named by address; each has its wave and its unit."""
    if not waves:
        return system
    ports, connections, inputs = [], [], dict(system.inputs)
    for name, (_, unit) in waves.items():
        targets = inputs.pop(name, None) or (_address(system, name),)
        inputs.pop(name.partition("[")[0], None)
        port = _target(system, targets[0])
        ports.append(
            Port(name, "output", port.type, unit=unit or port.unit, si=None if unit else port.si, items=port.items)
        )
        connections += [Connection(f"{DRIVE}.{name}", target) for target in targets]
    if DRIVE in system.components:
        raise MisfitError(f"system {system.name!r} has a component {DRIVE!r}, a name that cases use; rename it")
    arguments = {"ports": ports, "waves": {name: wave for name, (wave, _) in waves.items()}}
    drive = ComponentSpec(DRIVE, "python", SOURCE, options={"arguments": arguments})
    # First, so that what it drives gets the values of the instant.
    components = {DRIVE: drive, **system.components}
    return replace(system, components=components, connections=(*system.connections, *connections), inputs=inputs)


def _target(system: System, address: str) -> Port:
    component, variable = split_address(address)
    ports = {port.name: port for port in describe(system.component(component), system.folder).ports}
    return resolve(ports, variable, component)[0].port


def with_own_experiment(case: Case) -> Case:
    """The case with the inputs, step and end of the experiment whose results its FMU brings along."""
    system = load_system(model_path(case))
    paths = [system.folder / spec.source for spec in system.components.values() if spec.kind == "fmu"]
    replay = replay_of(paths[0]) if len(paths) == 1 else None
    if replay is None:
        return case
    case = replace(
        case,
        stop=case.stop if case.stop is not None else float(replay.results.times[-1]),
        step=case.step or replay.step,
    )
    if case.stimulus.file is not None or case.stimulus.signals:
        return case
    waves = {
        name: as_table(replay.inputs.times, replay.inputs.values[:, k]) for k, name in enumerate(replay.inputs.names)
    }
    return replace(case, stimulus=Stimulus(signals=waves))


def as_table(time: np.ndarray, values: np.ndarray) -> dict[str, object]:
    """A generator that goes through points."""
    return {"kind": "table", "times": np.asarray(time).tolist(), "values": np.asarray(values).tolist()}
