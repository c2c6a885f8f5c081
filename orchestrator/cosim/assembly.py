"""From a description to components that are loaded, wired and scheduled, and what the user should know about it."""

import math
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fmus.errors import MisfitError
from fmus.units import after_number
from orchestrator.cosim.component import Component
from orchestrator.cosim.connections import wire
from orchestrator.cosim.graph import Loop, Read, forced_delay, plan, without_feedthrough
from orchestrator.cosim.joined import join_equations
from orchestrator.cosim.kinds import describe, open_component
from orchestrator.cosim.masters import Master, MasterSettings, TableMaster, find_master
from orchestrator.cosim.masters.coupling import Coupling
from orchestrator.cosim.masters.events import Ticks
from orchestrator.cosim.masters.not_finite import Noted, NotFinite
from orchestrator.cosim.masters.operations import Schedule
from orchestrator.cosim.progress import Progress
from orchestrator.cosim.system import System
from orchestrator.cosim.wiring import OUTSIDE, Slot, Wiring
from orchestrator.results.column import Column, chosen

_UNRECORDED = ("String", "Binary", "Clock")


@dataclass
class Report:
    """What a user should know before trusting a run, in lines; `engine` is why the loop in C is not used, if it is not.

    `not_finite` and `ticks` grow during the run: values that were not finite numbers and did not end it, and clocks that
    ticked, by name.
    """

    conversions: tuple[str, ...] = ()
    unconnected: tuple[str, ...] = ()
    delays: tuple[str, ...] = ()
    loops: tuple[str, ...] = ()
    together: tuple[str, ...] = ()
    engine: str = ""
    not_finite: Mapping[str, Noted] = field(default_factory=dict)
    ticks: Mapping[str, Ticks] = field(default_factory=dict)

    @property
    def lines(self) -> list[str]:
        """All of it."""
        found = [f"kept without a connection: {line}" for line in self.unconnected]
        found += [f"one step late: {line}" for line in self.delays]
        found += [f"algebraic loop, solved at every step: {line}" for line in self.loops]
        found += [f"integrated as one system of equations: {line}" for line in self.together]
        found += [f"{name} was {noted}" for name, noted in self.not_finite.items()]
        found += [f"clock {name} {ticks}" for name, ticks in self.ticks.items()]
        return [*self.conversions, *found]


@dataclass
class Assembly:
    """Everything that a simulation consists of; times in s, `recorded` are slots and places of the columns."""

    components: Mapping[str, Component]
    wiring: Wiring
    coupling: Coupling
    master: Master
    initial: tuple[Any, ...]
    recorded: tuple[tuple[Slot, int], ...]
    columns: tuple[Column, ...]
    report: Report
    provenance: Callable[[], Mapping[str, Any]]
    start: float
    stop: float | None
    step: float
    tolerance: float | None
    chunk: int = field(default=64)

    def initialise(self) -> None:
        """Set what was given, find consistent values, and let all components start."""
        progress, coupling = self.coupling.progress, self.coupling
        for name, component in self.components.items():
            starts = self.wiring.starts.get(name, {})
            progress.enter(coupling.number[name], "initialise", self.start)
            if starts:
                component.set(list(starts), list(starts.values()))
            component.initialise(self.start, self.stop, self.tolerance)
        coupling.evaluate(self.initial, self.start)
        for name, component in self.components.items():
            progress.enter(coupling.number[name], "start", self.start)
            component.start()
        self.master.prepare(coupling)

    def refuse_other_steps(self, size: float, time: float) -> None:
        """Raise MisfitError where a component takes steps of one size only."""
        for name, component in self.components.items():
            if not component.variable_step:
                raise MisfitError(
                    f"{name} takes steps of one size only, {self.step:g} s; the step from t = {time:.9g} s would be {size:.9g} s; "
                    "choose a stop time that is a multiple of the step"
                )

    def close(self) -> None:
        """Terminate all components, also where one of them fails at that."""
        failure: Exception | None = None
        for name, component in self.components.items():
            self.coupling.progress.enter(self.coupling.number[name], "terminate", self.coupling.time)
            try:
                component.terminate()
            except Exception as error:  # the others have to be freed all the same
                failure = failure or error
        self.coupling.progress.leave()
        if failure is not None:
            raise failure


def assemble(
    system: System,
    progress: Progress,
    *,
    record: Sequence[str] | None,
    stop: float | None,
    step: float | None,
    master: str | None,
    tolerance: float | None,
) -> Assembly:
    """Check and load a system.

    Args:
        system: the system.
        progress: where it is noted what is called.
        record: addresses of what is recorded; None for the outputs of the system.
        stop: end of the run in s; None for that of the system.
        step: communication step in s; None for that of the system.
        master: name of the algorithm; None for that of the system.
        tolerance: relative tolerance of the components; None for that of the system.

    Raises:
        MisfitError: if it does not fit together, or nothing says how large steps are.
        ComponentError: if a component cannot be loaded.
    """
    if not system.components:
        raise MisfitError(f"system {system.name!r} has no components; give it at least one")
    described = {name: describe(spec, system.folder) for name, spec in system.components.items()}
    wiring = wire(system, described)
    kind = find_master(master or system.run.master)
    components = _load(system, described, progress)
    try:
        feedthrough = _feedthrough(wiring, components)
        recorded, columns = recorded_values(wiring, record)
        wanted = _wanted(wiring, recorded)
        together = join_equations(wiring, components, feedthrough, system, progress)
        order = plan(wiring, feedthrough, wanted)
        start = system.run.start or 0.0
        own_steps = {name: component.own_step for name, component in components.items()}
        settings = settings_of(system, described, own_steps, step, tolerance)
        made = kind(wiring, order, list(system.components), settings)
        _check_clocks(made, wiring)
        _check_rollback(made, components)
        not_finite = NotFinite(wiring, system.run.nan)
        coupling = Coupling(wiring, components, progress, made.shaper, not_finite)
        coupling.time = coupling.last_good = start
        told_stop = system.run.stop if stop is None else stop
        coupling.stop = math.inf if told_stop is None else told_stop
        return Assembly(
            components=components,
            wiring=wiring,
            coupling=coupling,
            master=made,
            initial=Schedule(wiring).evaluation(initial_order(wiring, described, feedthrough, wanted)),
            recorded=recorded,
            columns=columns,
            report=_report(wiring, components, order, together, coupling),
            provenance=lambda: _provenance(system, described, settings, made),
            start=start,
            stop=told_stop,
            step=settings.step,
            tolerance=system.run.tolerance if tolerance is None else tolerance,
        )
    except BaseException:
        for component in components.values():
            component.terminate()
        raise


def _wanted(wiring: Wiring, recorded: Sequence[tuple[Slot, int]]) -> dict[tuple[str, str], None]:
    """Outputs to be read at every point; those of clocks are read when these tick."""
    outputs = (slot for slot, _ in recorded if slot.port.causality == "output")
    return dict.fromkeys(
        (slot.component, slot.port.name)
        for slot in outputs
        if not (slot.port.clocks and slot.component in wiring.ticking)
    )


def _load(system: System, described: Mapping[str, Any], progress: Progress) -> dict[str, Component]:
    components: dict[str, Component] = {}
    try:
        for number, (name, spec) in enumerate(system.components.items()):
            progress.enter(number, "load", system.run.start or 0.0)
            found = described[name]
            components[name] = found if isinstance(found, Component) else open_component(spec, system.folder)
    except BaseException:
        for component in components.values():
            component.terminate()
        raise
    return components


def _feedthrough(wiring: Wiring, components: Mapping[str, Component]) -> dict[str, Mapping[str, Sequence[str]]]:
    return {
        name: component.feedthrough if component.follows_inputs else without_feedthrough(wiring, name)
        for name, component in components.items()
    }


def initial_order(
    wiring: Wiring,
    described: Mapping[str, Any],
    feedthrough: Mapping[str, Mapping[str, Sequence[str]]],
    wanted: Mapping[tuple[str, str], None],
) -> tuple[Read | Loop, ...]:
    """What depends on what during initialisation, which FMUs may declare apart.

    Args:
        wiring: the links between ports.
        described: description of each component.
        feedthrough: inputs that each output follows within a step, by component.
        wanted: component and variable of what is read, in this order.
    """
    initial = {name: getattr(described[name], "initial_feedthrough", feedthrough[name]) for name in feedthrough}
    return plan(wiring, initial, wanted)


def recorded_values(
    wiring: Wiring, patterns: Sequence[str] | None
) -> tuple[tuple[tuple[Slot, int], ...], tuple[Column, ...]]:
    """Outputs, or whatever inputs and outputs patterns choose."""
    slots = [slot for slot in wiring.slots if slot.component != OUTSIDE and slot.port.type not in _UNRECORDED]
    if patterns is None:
        slots = [slot for slot in slots if slot.port.causality == "output"]
    places, columns = [], []
    for slot in slots:
        for k, element in enumerate(slot.port.elements):
            places.append((slot, slot.first + k))
            columns.append(Column(f"{slot.component}.{element}", slot.port.unit, slot.port.type, slot.port.description))
    picked = chosen(columns, patterns or ())
    return tuple(places[k] for k in picked), tuple(columns[k] for k in picked)


def settings_of(
    system: System,
    described: Mapping[str, Any],
    own_steps: Mapping[str, float | None],
    step: float | None = None,
    tolerance: float | None = None,
) -> MasterSettings:
    """What the master is told; `own_steps` are those that components insist on, in s, by name.

    Args:
        system: the system.
        described: description of each component.
        own_steps: steps in s that components insist on, by name; None where one does not.
        step: communication step in s; None for that of the system.
        tolerance: relative tolerance; None for that of the system.

    Raises:
        MisfitError: if nothing says how large steps are.
    """
    own = {name: spec.step or own_steps[name] for name, spec in system.components.items()}
    wanted = system.run.step if step is None else step
    if wanted is None:
        suggested = [own[name] or getattr(described[name], "step", None) for name in system.components]
        known = [each for each in suggested if each]
        if not known:
            raise MisfitError(
                f"nothing says how large the steps of {system.name!r} are; give a communication step in s"
            )
        wanted = min(known)
    if not wanted > 0.0:
        raise MisfitError(f"communication step of {wanted:g} s: expected a positive time")
    return MasterSettings(
        step=wanted,
        tolerance=(system.run.tolerance if tolerance is None else tolerance) or 1e-6,
        own_steps={name: each for name, each in own.items() if each},
        options=system.run.options,
    )


def _check_rollback(master: Master, components: Mapping[str, Component]) -> None:
    unable = [name for name, component in components.items() if master.needs_rollback and not component.can_save]
    if unable:
        raise MisfitError(
            f"master {master.name!r} goes back in time, but {', '.join(unable)} cannot save the state; choose ordered, jacobi or gauss_seidel"
        )


def _check_clocks(master: Master, wiring: Wiring) -> None:
    if wiring.ticking and not isinstance(master, TableMaster):
        raise MisfitError(
            f"clocks tick in {', '.join(wiring.ticking)}, for which master {master.name!r} makes no room between its steps; "
            "choose ordered, jacobi or gauss_seidel, or say event_mode = false of the component"
        )


def _report(
    wiring: Wiring,
    components: Mapping[str, Component],
    order: Sequence[Read | Loop],
    together: Sequence[str],
    coupling: Coupling,
) -> Report:
    late = (
        forced_delay(wiring, name, component.feedthrough)
        for name, component in components.items()
        if not component.follows_inputs
    )
    return Report(
        conversions=wiring.notes,
        unconnected=tuple(str(each) for each in wiring.unconnected),
        delays=tuple(str(each) for each in late if each is not None),
        loops=tuple(str(part) for part in order if isinstance(part, Loop)),
        together=tuple(together),
        not_finite=coupling.not_finite.noted,
        ticks=coupling.events.ticks,
    )


def _provenance(
    system: System, described: Mapping[str, Any], settings: MasterSettings, master: Master
) -> dict[str, Any]:
    from importlib.metadata import version

    parts = {}
    for name, spec in system.components.items():
        values = {variable: f"{value.value}{after_number(value.unit)}" for variable, value in spec.values.items()}
        parts[name] = {"kind": spec.kind, "source": spec.source, "values": values}
        digest = getattr(described[name], "digest", None)
        if digest is not None:
            parts[name] |= {"sha256": digest, "tool": described[name].tool}
    return {
        "system": system.name,
        "components": parts,
        "connections": [f"{each.source} -> {each.target}" for each in system.connections],
        "master": master.name,
        "step_s": settings.step,
        "tolerance": settings.tolerance,
        "options": dict(settings.options),
        "versions": {"misfit-fmu": version("misfit-fmu"), "python": platform.python_version()},
    }
