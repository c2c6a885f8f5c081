"""A model-exchange FMU as equations: straight lines about the states that its record shows.

An FMU tells its rates and their slopes only where it is asked. A filter that sees the record stays near one trajectory, so
its rates are asked for along that trajectory, sample by sample, and

    rate(x, u) = f + A (x - x0) + B (u - u0)

takes the place of its equations, with f, A, B, x0 and u0 as further inputs that run in straight lines between samples. The
trajectory is filtered again with the new lines until it stays (iterated extended Kalman filter; Jazwinski 1970, 8.3).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fmus.errors import ComponentError, MisfitError
from fmus.symbolic.balances import Balance, is_store
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.blackbox.ports import Description, Port
from orchestrator.blackbox.sites import MOST_PARAMETERS, plain_sites
from orchestrator.blackbox.source import FmuSource
from orchestrator.greybox.evidence import Case, filtered_states, states_with
from orchestrator.greybox.extended import CORRECTION
from orchestrator.greybox.filtering import GreyBox
from orchestrator.greybox.unit_algebra import combined
from orchestrator.measurements import BoundSet, MeasurementSet, bind

ROUNDS, STAYS = 5, 1e-3
# By unit of an input, units of states whose balance it is a flow into.
DRIVES = {
    "N": ("m/s",),
    "N.m": ("rad/s",),
    "W": ("K", "degC", "J"),
    "V": ("A",),
    "A": ("V", "C"),
    "m3/s": ("Pa", "bar", "m", "m3"),
    "kg/s": ("Pa", "bar", "kg", "m"),
    "mol/s": ("mol", "mol/m3"),
}
# What varies by no more than this share counts as constant; differences are no more exact.
EXACT = 1e-6
# Relative step of a parameter for slopes.
NUDGE = 1e-4
# Points at which an FMU is looked at without a record.
POINTS = 20


@dataclass(frozen=True, eq=False)
class Tape:
    """Along one trial: states (n, nx), inputs (n, nu), rates and outputs (n, nx + ny), their slopes in states, inputs and
    parameters (n, nx + ny, nx + nu + np)."""

    states: np.ndarray
    inputs: np.ndarray
    values: np.ndarray
    slopes: np.ndarray


def can_be_taped(source: FmuSource) -> bool:
    """Whether an FMU tells its rates: model exchange, with states, no arrays, and not a system of FMUs."""
    fmu = source.fmu
    description = fmu.description
    ports = (*description.inputs, *description.outputs, *description.states)
    return not description.cosimulation and bool(description.states) and all(p.size == 1 for p in ports)


def taped_case(source: FmuSource, measurements: MeasurementSet) -> Case:
    """An FMU and its measurements for the grey box. Held-out trials are taped, too; they choose nothing.

    Raises:
        MisfitError: if the data do not fit the FMU.
        ComponentError: if the FMU fails, or cannot follow the record.
    """
    description = source.fmu.started
    plain = plain_sites(description)
    data = bind(measurements, plain.inputs, plain.outputs)
    start = np.array([v.variable.start or 0.0 for v in description.states])
    along = [np.tile(start, (len(trial.time), 1)) for trial in data.trials]
    for _ in range(ROUNDS):
        case = _case(source, description, data, _tapes(source, data, along, ()), ())
        before, along = along, filtered_states(case)
        spread = np.maximum(np.concatenate(along).std(axis=0), 1e-12)
        moved = max(float(np.sqrt(np.mean(((a - b) / spread) ** 2))) for a, b in zip(along, before, strict=True))
        if moved < STAYS:
            break
    return _with_parameters(source, data, along)


def retaped_case(case: Case, box: GreyBox, theta: np.ndarray) -> Case:
    """The FMU's lines about the states that the record shows if effects are in the model, `box` with values `theta`.

    Lines about what the model as given makes of a record are wrong to second order in what it lacks: beside a late sensor, two
    values of a pendulum seemed wrong.

    Args:
        case: the FMU beside its trials.
        box: the model with effects.
        theta: values (k,) of its free parameters.

    Raises:
        ComponentError: if the FMU fails.
    """
    assert isinstance(case.source, FmuSource)
    nx = len(case.base.states)
    along = [states[:, :nx] for states in states_with(case, box, theta)]
    columns = len(case.inputs)
    plain = tuple(
        replace(
            t,
            inputs=_all_inputs(case.source, t.inputs[:, :columns]),
            held=tuple(name for name in t.held if not name.startswith("tape[")),
        )
        for t in case.data.trials
    )
    return _with_parameters(case.source, replace(case.data, trials=plain), along)


def _all_inputs(source: FmuSource, own: np.ndarray) -> np.ndarray:
    """Inputs (n, nu) of the FMU, those for corrections of its rates at rest."""
    description = source.fmu.started
    found = np.tile([v.variable.start or 0.0 for v in description.inputs], (len(own), 1))
    found[:, _own_inputs(description)] = own
    return found


def _with_parameters(source: FmuSource, data: BoundSet, along: Sequence[np.ndarray]) -> Case:
    description = source.fmu.started
    parameters = tuple(p for p in description.parameters if p.variable.start)[:MOST_PARAMETERS]
    return _case(source, description, data, _tapes(source, data, along, parameters), parameters)


def _tapes(source: FmuSource, data: BoundSet, along: Sequence[np.ndarray], parameters: Sequence[Port]) -> list[Tape]:
    fmu = source.fmu
    found = []
    for trial, states in zip(data.trials, along, strict=True):
        values, slopes = fmu.slopes(trial.time, states, trial.inputs)
        own = _own_inputs(fmu.description)
        columns = [np.delete(slopes, [states.shape[1] + k for k in range(trial.inputs.shape[1]) if k not in own], 2)]
        for port in parameters:
            here = float(port.variable.start or 0.0)
            try:
                moved = fmu.slopes(trial.time, states, trial.inputs, {port.reference: here * (1 + NUDGE)})[0]
                columns.append(((moved - values) / (here * NUDGE))[:, :, None])
            except ComponentError:  # this one may not be changed
                columns.append(np.zeros((*values.shape, 1)))
        found.append(Tape(states, trial.inputs[:, own], values, np.concatenate(columns, axis=2)))
    return found


def _own_inputs(description: Description) -> list[int]:
    """Inputs by number, without those that misfit's own FMUs have for corrections of their rates."""
    return [k for k, p in enumerate(description.inputs) if not p.name.startswith(CORRECTION)]


def _case(
    source: FmuSource, description: Description, data: BoundSet, tapes: Sequence[Tape], parameters: Sequence[Port]
) -> Case:
    if not np.isfinite(np.concatenate([t.values for t in tapes])).all():
        raise MisfitError(f"{source.name}: its rates are no finite numbers at states that the record shows")
    own = _own_inputs(description)
    lines = _Lines(source.name, description, tapes, parameters)
    base, balances = lines.system()
    further = tuple(v.name for v in base.inputs if v.name.startswith("tape["))
    trials = tuple(
        replace(
            trial,
            inputs=np.column_stack([trial.inputs[:, own], *lines.columns(tape)]),
            # Where an input is held, lines between samples would lead through rates of inputs that never were.
            held=(*trial.held, *further) if trial.held else (),
        )
        for trial, tape in zip(data.trials, tapes, strict=True)
    )
    inputs = tuple(description.inputs[k].variable for k in own)
    return Case(source, base, balances, inputs, replace(data, trials=trials), data.output_names)


class _Lines:
    """Straight lines for all trials; what is the same everywhere is a number, the rest an input."""

    def __init__(self, name: str, description: Description, tapes: Sequence[Tape], parameters: Sequence[Port]) -> None:
        self.name = name
        self.description = replace(description, inputs=tuple(description.inputs[k] for k in _own_inputs(description)))
        description = self.description
        self.nx, self.nu, self.ny = (len(p) for p in (description.states, description.inputs, description.outputs))
        slopes = np.concatenate([t.slopes for t in tapes])
        values = np.concatenate([t.values for t in tapes])
        points = np.concatenate([np.column_stack([t.states, t.inputs]) for t in tapes])
        self.middle = np.median(slopes, axis=0)
        row = np.maximum(np.ptp(values, axis=0), 1e-9 * np.abs(values).max(axis=0))
        reach = np.maximum(np.ptp(points, axis=0), 1e-9)
        own = np.array([abs(p.variable.start or 0.0) for p in parameters])
        weight = np.abs(slopes).max(axis=0) * np.concatenate([reach, own]) / np.maximum(row, 1e-300)[:, None]
        varies = np.abs(slopes - self.middle).max(axis=0) > EXACT * np.abs(slopes).max(axis=0)
        self.middle = np.where(weight > EXACT, self.middle, 0.0)
        self.middle = np.where(np.abs(self.middle - 1.0) < EXACT, 1.0, self.middle)
        self.varies = varies & (weight > EXACT)
        rest = values - np.einsum("ij,nj->ni", self.middle[:, : self.nx + self.nu], points)
        straight = ~self.varies[:, : self.nx + self.nu].any(axis=1) & (np.ptp(rest, axis=0) < 1e-5 * row)
        self.straight, self.rest = (
            straight,
            np.where(np.abs(np.median(rest, axis=0)) > 1e-9 * row, np.median(rest, axis=0), 0.0),
        )
        # A parameter that shows nowhere is none.
        self.kept = [k for k in range(len(parameters)) if (weight[:, self.nx + self.nu + k] > 1e-4).any()]
        self.parameters = [parameters[k].variable for k in self.kept]

    def columns(self, tape: Tape) -> list[np.ndarray]:
        """What the further inputs are along a trial, in their order."""
        found = [tape.states, tape.inputs]
        for r in np.flatnonzero(~self.straight):
            found.append(tape.values[:, [r]])
        found += [tape.slopes[:, r, c][:, None] for r, c in self._changing]
        return found

    @property
    def _changing(self) -> list[tuple[int, int]]:
        kept = {self.nx + self.nu + k for k in self.kept}
        return [(r, c) for r, c in np.argwhere(self.varies).tolist() if c < self.nx + self.nu or c in kept]

    def system(self) -> tuple[SymbolicSystem, tuple[Balance, ...]]:
        """The equations with an input at each balance."""
        states, outputs = ([p.variable for p in part] for part in (self.description.states, self.description.outputs))
        inputs = [p.variable for p in self.description.inputs]
        balances, directions = self._balances(states, inputs)
        x, u = ca.SX.sym("x", self.nx), ca.SX.sym("u", self.nu)
        c, p = ca.SX.sym("c", len(balances)), ca.SX.sym("p", len(self.parameters))
        bent = np.flatnonzero(~self.straight)
        x0, u0 = ca.SX.sym("x0", self.nx), ca.SX.sym("u0", self.nu)
        f, a = ca.SX.sym("f", len(bent)), ca.SX.sym("a", len(self._changing))
        tape = ca.vertcat(x0, u0, f, a)
        slope = ca.SX(ca.DM(self.middle))
        for k, (r, col) in enumerate(self._changing):
            slope[r, col] = a[k]
        point, about = ca.vertcat(x, u), ca.vertcat(x0, u0)
        n = self.nx + self.nu
        rows = []
        for r in range(self.nx + self.ny):
            if self.straight[r]:
                rows.append(ca.DM(self.middle[r : r + 1, :n]) @ point + self.rest[r])
            else:
                rows.append(f[int(np.flatnonzero(bent == r)[0])] + slope[r, :n] @ (point - about))
            for k, place in enumerate(self.kept):
                rows[r] += slope[r, n + place] * (p[k] - float(self.parameters[k].start or 0.0))
        whole = ca.vertcat(*rows)
        for k, direction in enumerate(directions):  # an accelerometer feels what acts by an input, too
            whole += (slope[:, self.nx + direction] if direction >= 0 else self._unit(states, balances[k])) * c[k]
        given = [*inputs, *(Variable(b.input, b.unit, "", 0.0) for b in balances)]
        further = [Variable(f"tape[{k}]", "", "", 0.0) for k in range(tape.numel())]
        t, d = ca.SX.sym("t"), ca.SX.sym("d", 0)
        every = ca.vertcat(u, c, tape)
        system = SymbolicSystem(
            name=self.name,
            description="",
            inputs=(*given, *further),
            states=tuple(states),
            algebraics=tuple(outputs),
            parameters=tuple(self.parameters),
            dependents=(),
            outputs=tuple(v.name for v in outputs),
            rhs=ca.Function("rhs", [t, x, every, d, p], [whole[: self.nx], whole[self.nx :]]),
            history=ca.Function("history", [t, every, p], [ca.SX(0, 1), ca.SX(0, 1)]),
            dependent=ca.Function("dependent", [p], [ca.SX(0, 1)]),
            initial=ca.Function("initial", [p], [ca.DM([v.start or 0.0 for v in states])]),
        )
        return system, tuple(balances)

    def _unit(self, states: Sequence[Variable], balance: Balance) -> ca.DM:
        return ca.DM([*(float(v.name == balance.state) for v in states), *[0.0] * self.ny])

    def _balances(self, states: Sequence[Variable], inputs: Sequence[Variable]) -> tuple[list[Balance], list[int]]:
        """Balances, and by which input a force acts there; -1 where none does and the rate itself is added to."""
        position_of = self._positions()
        found, directions = [], []
        for j, state in enumerate(states):
            if j in position_of:
                continue
            position = next((states[q].name for q, v in position_of.items() if v == j), "")
            i = self._force_on(j, state, inputs)
            unit = inputs[i].unit if i >= 0 else combined((state.unit or "1", 1), ("s", -1))
            found.append(Balance(state.name, unit, position, f"balance({state.name})"))
            directions.append(i)
        return found, directions

    def _positions(self) -> dict[int, int]:
        """States whose rate is another state, by number."""
        found = {}
        for q in range(self.nx):
            entries = np.flatnonzero(self.middle[q, : self.nx + self.nu])
            if not self.straight[q] or self.rest[q] != 0.0 or len(entries) != 1 or entries[0] >= self.nx:
                continue
            kept = is_store(self.description.states[q].variable.unit)
            if entries[0] != q and self.middle[q, entries[0]] == 1.0 and not kept:
                found[q] = int(entries[0])
        return found

    def _force_on(self, j: int, state: Variable, inputs: Sequence[Variable]) -> int:
        """The input that is a flow into the balance of a state, and moves this state most of those that it can drive; -1 without
        one."""
        slopes = self.middle[: self.nx, self.nx : self.nx + self.nu]
        size = np.abs(slopes)
        units = [v.variable.unit for v in self.description.states]
        for i in np.argsort(-size[j]) if self.nu else ():
            if slopes[j, i] < 0:  # a law's force acts in the direction of its state, and this input against it
                continue
            driven = DRIVES.get(inputs[i].unit, ())
            fitting = state.unit in driven or not state.unit and inputs[i].unit in DRIVES
            # A force on a cart turns its pole, by a number that may be the larger one, in another unit.
            rivals = [k for k, unit in enumerate(units) if not unit or unit in driven]
            if size[j, i] > 0 and fitting and size[j, i] >= (1 - EXACT) * size[rivals, i].max(initial=0.0):
                return int(i)
        return -1


@dataclass(frozen=True, eq=False)
class Outline:
    """An FMU without a record: its equations about its start, balances, and the input that acts on each as a force does, empty
    if none does; its parameters."""

    system: SymbolicSystem
    balances: tuple[Balance, ...]
    acting: Mapping[str, str]
    parameters: tuple[Variable, ...]


def outline(source: FmuSource) -> Outline:
    """Look at an FMU about its start.

    Raises:
        ComponentError: if the FMU fails.
    """
    description, random = source.fmu.started, np.random.default_rng(0)
    states, inputs = (
        np.array([v.variable.start or 0.0 for v in part]) for part in (description.states, description.inputs)
    )
    x = states + 0.1 * (1 + np.abs(states)) * random.uniform(-1, 1, (POINTS, len(states)))
    u = inputs + 0.1 * (1 + np.abs(inputs)) * random.uniform(-1, 1, (POINTS, len(inputs)))
    values, slopes = source.fmu.slopes(np.zeros(POINTS), x, u)
    own = _own_inputs(description)
    slopes = np.delete(slopes, [len(states) + k for k in range(len(inputs)) if k not in own], 2)
    u = u[:, own]
    system, balances = _Lines(source.name, description, [Tape(x, u, values, slopes)], ()).system()
    variables = [description.inputs[k].variable for k in own]
    acting = {b.input: force_input(system, variables, b) for b in balances}
    return Outline(system, balances, acting, tuple(p.variable for p in description.parameters))


def force_input(system: SymbolicSystem, inputs: Sequence[Variable], balance: Balance) -> str:
    """The FMU's input that acts on a balance as a force does; empty if none does.

    Args:
        system: the equations along the record.
        inputs: the FMU's inputs.
        balance: the balance.
    """
    return next((v.name for v in inputs if v.unit == balance.unit and _acts(system, v.name, balance)), "")


def _acts(system: SymbolicSystem, name: str, balance: Balance) -> bool:
    """Whether an input moves all states as the balance's own force does."""
    names = [v.name for v in system.inputs]
    t, x = ca.SX.sym("t"), ca.SX.sym("x", len(system.states))
    u, d, p = ca.SX.sym("u", len(names)), ca.SX.sym("d", 0), ca.SX.sym("p", len(system.parameters))
    slopes = ca.jacobian(system.rhs(t, x, u, d, p)[0], u)
    one, other = slopes[:, names.index(name)], slopes[:, names.index(balance.input)]
    return bool(ca.is_equal(ca.densify(one), ca.densify(other), 3))
