"""What a model keeps from event to event, along a record: a thermostat's switch, the command of a sampled controller.

A filter follows the record, so its states say when the model's own conditions become true and its clocks tick. What is kept then
are inputs that stand still from event to event, each event at a row of its own. The states are filtered again with them until
they stay.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from fmus.errors import ComponentError
from fmus.symbolic.balances import Balance
from fmus.symbolic.system import KeptInputs, SymbolicSystem
from orchestrator.greybox.extended import own_inputs
from orchestrator.measurements import BoundSet, BoundTrial

ROUNDS, STAYS = 5, 0.01
# Updates of one event until nothing changes any more.
MOST_UPDATES = 20
# An event in a sample interval is looked for in so many parts of it, in the part where it is again, and so on.
PARTS, LOOKS = 8, 4
# Rows that events may add, for each row of a trial.
MOST_ROWS = 3
# Rows that are looked through at a time for the next event.
BLOCK = 16
# An event so near to a row, as a share of the interval, is at it.
NEAR = 1e-3


@dataclass(frozen=True, eq=False)
class Runs:
    """What runs between samples: a model, or one with effects whose states stand behind, and values of its parameters."""

    system: SymbolicSystem
    values: np.ndarray


def with_kept(
    system: SymbolicSystem,
    balances: Sequence[str],
    data: BoundSet,
    filtered: Callable[[BoundSet], Sequence[np.ndarray]],
) -> BoundSet:
    """Trials with columns for what a model keeps, and a row without measurements at each event.

    Args:
        system: the equations, with what is kept among their inputs.
        balances: names of the inputs at balances.
        data: trials with the columns of the model's own inputs.
        filtered: states (n, nx) along each trial of such a set, as a filter shows them.

    Raises:
        ComponentError: if events come in quicker succession than samples, or end in no state.
    """
    kept = system.kept
    assert kept is not None
    first = np.array(kept.start(0.0, _values(system))).ravel()
    trials = tuple(_with_columns(trial, np.tile(first, (len(trial.time), 1)), kept) for trial in data.trials)
    found = replace(data, trials=trials)
    for _ in range(ROUNDS):
        before = found
        found = with_events(system, balances, data, before, filtered(before))
        if all(_same(one, other) for one, other in zip(found.trials, before.trials, strict=True)):
            break
    return found


def with_events(
    system: SymbolicSystem,
    balances: Sequence[str],
    data: BoundSet,
    before: BoundSet,
    states: Sequence[np.ndarray],
    runs: Runs | None = None,
) -> BoundSet:
    """The same from states (n, nx) at all rows of the trials that were found `before`, those of events included; `runs` is the model with
    effects if the states are of one."""
    functions = _functions(system, balances, runs or Runs(system, _values(system)))
    events = (
        _Events(system, balances, functions, trial, _at(trial.time, longer.time, along))
        for trial, longer, along in zip(data.trials, before.trials, states, strict=True)
    )
    return replace(data, trials=tuple(each.trial() for each in events))


def _values(system: SymbolicSystem) -> np.ndarray:
    return np.array([v.start or 0.0 for v in system.parameters])


def _at(time: np.ndarray, longer: np.ndarray, states: np.ndarray) -> np.ndarray:
    """States at the rows of a record among those of more rows."""
    return np.asarray(states[np.searchsorted(longer, time)])


def _same(one: BoundTrial, other: BoundTrial) -> bool:
    """Whether a trial's events come at the same times with the same values, within a share of a sample and of what varies."""
    if one.time.shape != other.time.shape:
        return False
    step, spread = np.ptp(one.time) / len(one.time), np.std(one.inputs, axis=0)
    moved = (one.inputs - other.inputs) / np.where(spread > 0, spread, 1.0)
    return bool(np.abs(one.time - other.time).max() < STAYS * step and np.sqrt(np.mean(moved**2, axis=0)).max() < STAYS)


def _with_columns(trial: BoundTrial, columns: np.ndarray, kept: KeptInputs) -> BoundTrial:
    return replace(trial, inputs=np.column_stack([trial.inputs, columns]), held=(*trial.held, *kept.names))


class _Events:
    """The events of one trial: between samples the model runs from the states of the last one, up to those of the next."""

    def __init__(
        self,
        system: SymbolicSystem,
        balances: Sequence[str],
        functions: tuple[ca.Function, ca.Function],
        record: BoundTrial,
        states: np.ndarray,
    ) -> None:
        assert system.kept is not None
        self.name, self.kept = system.name, system.kept
        self.record, self.states = record, states
        own = [v.name for v in system.inputs if v.name not in {*balances, *self.kept.names}]
        self.held = np.array([name in self.record.held for name in own], dtype=bool)
        self.values = _values(system)
        self.update, self.run = functions

    def trial(self) -> BoundTrial:
        """The trial with its events."""
        time, inputs, outputs = self.record.time, self.record.inputs, self.record.outputs
        now = self._settled(0, 1.0, self.states[0], np.array(self.kept.start(time[0], self.values)).ravel())
        rows = [(time[0], inputs[0], outputs[0], now)]
        nothing, most, k = np.full(outputs.shape[1], np.nan), (1 + MOST_ROWS) * len(time), 1
        while k < len(time):
            quiet = self._quiet(k, now)
            rows += [(time[i], inputs[i], outputs[i], now) for i in range(k, quiet)]
            if quiet == len(time):
                break
            k, done, x = quiet, 0.0, self.states[quiet - 1]
            while (event := self._next(k, done, x, now)) is not None:
                done, x = event
                now = self._settled(k, done, x, now)
                at, given = self._given(np.array([k]), np.array([done]))
                rows.append((float(at[0]), given[0], nothing, now))
                if len(rows) > most:
                    raise ComponentError(f"{self.name} has more than {MOST_ROWS} events between samples")
            now = self._settled(k, 1.0, self.states[k], now)
            rows.append((time[k], inputs[k], outputs[k], now))
            k += 1
        times, given, measured, kept = (np.array(part) for part in zip(*rows, strict=True))
        trial = replace(self.record, time=times, inputs=given, outputs=measured)
        return _with_columns(trial, kept, self.kept)

    def _quiet(self, k: int, now: np.ndarray) -> int:
        """The first row from k on at or before which what is kept changes; the number of rows if it never does."""
        count = len(self.record.time)
        for begin in range(k, count, BLOCK):
            rows = np.arange(begin, min(begin + BLOCK, count))
            moved = self._moves(rows, 1.0, self.states[rows], now)
            moved |= self._paths(rows, 0.0, self.states[rows - 1], now)[1].any(axis=1)
            if moved.any():
                return begin + int(np.argmax(moved))
        return count

    def _next(self, k: int, done: float, x: np.ndarray, now: np.ndarray) -> tuple[float, np.ndarray] | None:
        """Where in the interval before row k what is kept changes next, from states x (nx,) at a share of it on, and the states there;
        None if it is not before the row."""
        paths, changes = self._paths(np.array([k]), done, x[None, :], now)
        shares, points, moved = np.linspace(done, 1.0, PARTS + 1), np.vstack([x, paths[0]]), changes[0]
        for _ in range(LOOKS):
            if not moved.any():
                return None
            j = int(np.argmax(moved))
            part = np.linspace(0.0, 1.0, PARTS + 1)
            points = points[j] + part[:, None] * (points[j + 1] - points[j])
            shares = shares[j] + part * (shares[j + 1] - shares[j])
            moved = self._moves(np.full(PARTS, k), shares[1:], points[1:], now)
        return None if shares[-1] > 1.0 - NEAR else (float(shares[-1]), points[-1])

    def _paths(self, rows: np.ndarray, done: float, x: np.ndarray, now: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (n, np, nx) at the ends of parts of the intervals before some rows, from states x (n, nx) at a share of them on, if
        nothing changes, and whether something would (n, np)."""
        time, before = self._given(rows, done)
        end, after = self._given(rows, 1.0)
        after = np.where(self.held, before, after)
        given = np.tile(now[:, None], len(rows))
        found = self.run(time[None, :], (end - time)[None, :], x.T, before.T, after.T, given)
        states, kept = (np.array(part).T.reshape(len(rows), PARTS, -1) for part in found)
        return states, (kept != now).any(axis=2)

    def _settled(self, k: int, share: float, x: np.ndarray, now: np.ndarray) -> np.ndarray:
        for _ in range(MOST_UPDATES):
            after = np.asarray(self._updated(np.array([k]), share, x[None, :], now)[0])
            if np.array_equal(after, now):
                return now
            now = after
        raise ComponentError(f"an event of {self.name} at t = {self.record.time[k]:.4g} s comes to no end")

    def _moves(self, rows: np.ndarray, shares: np.ndarray | float, states: np.ndarray, now: np.ndarray) -> np.ndarray:
        return np.asarray((self._updated(rows, shares, states, now) != now).any(axis=1))

    def _updated(self, rows: np.ndarray, shares: np.ndarray | float, states: np.ndarray, now: np.ndarray) -> np.ndarray:
        """What is kept after an update (n, nm) with states (n, nx) at shares of the intervals before some rows, `now` (nm,) before."""
        time, inputs = self._given(rows, shares)
        return np.array(self.update(time[None, :], states.T, inputs.T, np.tile(now[:, None], len(rows)))).T

    def _given(self, rows: np.ndarray, shares: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Times and inputs at shares of the intervals before some rows; a held input changes at its row."""
        before, part = np.maximum(rows - 1, 0), np.broadcast_to(shares, rows.shape)
        time, inputs = self.record.time, self.record.inputs
        line = inputs[before] + part[:, None] * (inputs[rows] - inputs[before])
        given = np.where(self.held & (part[:, None] < 1.0), inputs[before], line)
        return time[before] + part * (time[rows] - time[before]), given


def _functions(system: SymbolicSystem, balances: Sequence[str], runs: Runs) -> tuple[ca.Function, ca.Function]:
    """What is kept after an update: of time, states, the model's own inputs and what is kept before, with nothing at balances; and a
    run from there with inputs in a line to others: states at the ends of its parts by steps of Runge and Kutta, and what would be
    kept there."""
    assert system.kept is not None
    names = [v.name for v in system.inputs]
    # What an equation that is solved by iteration gives is no SX.
    t, x, m = (ca.MX.sym(n, k) for n, k in (("t", 1), ("x", len(runs.system.states)), ("m", len(system.kept.names))))
    own = [name for name in names if name not in {*balances, *system.kept.names}]
    given = ca.MX.sym("u", len(own))
    by_name = dict(zip((*own, *system.kept.names), (*ca.vertsplit(given), *ca.vertsplit(m)), strict=True))
    u, inputs = (ca.vertcat(*(by_name.get(v.name, 0.0) for v in s.inputs)) for s in (system, runs.system))
    p, values = ca.DM(_values(system)), ca.DM(runs.values)
    before = x[: len(system.states)]
    known = [t, x, given, m]
    after = system.kept.update(t, before, u, system.history(t, u, p)[0], p)
    update = ca.Function("update", known, [ca.densify(after)])
    moved = runs.system.rhs(t, x, inputs, runs.system.history(t, inputs, values)[0], values)[0]
    rates = ca.Function("rates", known, [ca.densify(moved)])
    start, length, first, before, after, kept = (
        ca.MX.sym(name, size)
        for name, size in (("t", 1), ("h", 1), ("x", x.numel()), ("a", len(own)), ("b", len(own)), ("m", m.numel()))
    )

    def rate(share: float, states: Any) -> Any:
        return rates(start + share * length, states, before + share * (after - before), kept)

    states, ends, changes, part = first, [], [], 1.0 / PARTS
    for k in range(PARTS):
        begin, step = k * part, part * length
        one = rate(begin, states)
        two = rate(begin + 0.5 * part, states + 0.5 * step * one)
        three = rate(begin + 0.5 * part, states + 0.5 * step * two)
        four = rate(begin + part, states + step * three)
        states += step / 6 * (one + 2 * two + 2 * three + four)
        ends.append(states)
        share = begin + part
        changes.append(update(start + share * length, states, before + share * (after - before), kept))
    found = [ca.vertcat(*ends), ca.vertcat(*changes)]
    return update, ca.Function("run", [start, length, first, before, after, kept], found)


def event_parameters(system: SymbolicSystem) -> list[str]:
    """Parameters of which events depend and no equation does."""
    shown = _of_events_alone(system)[1]
    return [v.name for v, alone in zip(system.parameters, shown, strict=True) if alone and v.start]


def event_inputs(system: SymbolicSystem) -> list[str]:
    """Inputs of which events depend and no equation does, such as a set point that is read at ticks."""
    return [v.name for v, alone in zip(system.inputs, _of_events_alone(system)[0], strict=True) if alone]


def _of_events_alone(system: SymbolicSystem) -> tuple[list[bool], list[bool]]:
    """For each input and each parameter, whether events depend on it and no equation does."""
    if system.kept is None:
        return [False] * len(system.inputs), [False] * len(system.parameters)
    sizes = (1, len(system.states), len(system.inputs), system.n_delays, len(system.parameters))
    t, x, u, d, p = (ca.MX.sym(name, size) for name, size in zip("txudp", sizes, strict=True))
    equations, events = ca.vertcat(*system.rhs(t, x, u, d, p)), system.kept.update(t, x, u, d, p)

    def alone(of: Any) -> list[bool]:
        pairs = zip(ca.which_depends(events, of, 1), ca.which_depends(equations, of, 1), strict=True)
        return [here and not there for here, there in pairs]

    return alone(u), alone(p)


def with_value(system: SymbolicSystem, name: str, share: float) -> SymbolicSystem:
    """A system one of whose parameters is another by a share of itself."""
    changed = [replace(v, start=(v.start or 0.0) * (1.0 + share)) if v.name == name else v for v in system.parameters]
    return replace(system, parameters=tuple(changed))


def driven(system: SymbolicSystem, balances: Sequence[Balance]) -> list[str]:
    """Names of the inputs that a model is driven by: neither those at balances nor what it keeps."""
    names = () if system.kept is None else system.kept.names
    return [v.name for v in own_inputs(system, balances) if v.name not in names]
