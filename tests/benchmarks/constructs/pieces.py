"""Integrate a model by SciPy from event to event, apart from the C code of FMUs: Modelica's event iteration once more, in Python."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from fmus.symbolic.system import Relations, SymbolicSystem

RELATIVE, ABSOLUTE = 1e-9, 1e-12
# A relation changes only this far beyond zero, in units of 1 + the size of what is compared.
BAND = 1e-13
MOST_EVENTS = 2_000
# So often all relations that have to change do so at once, then one by one.
TOGETHER = 10
# Of the time that has passed: instants closer to each other are one.
ROUNDING = 1e-12
# Doublings of a thousandth of that until a relation that changes has changed for sure.
FINEST = 30

Solution = Callable[[float], np.ndarray]
Margin = Callable[[float, np.ndarray], float]


MOST_EVALUATIONS = 500_000


class NoEnd(Exception):
    """Relations contradict each other, events follow each other without end, or the steps are too many."""


@dataclass
class Pieces:
    """A model without inputs between its events, and where these are."""

    system: SymbolicSystem
    parameters: Sequence[float]
    events: list[float] = field(default_factory=list)
    evaluations: int = 0

    def run(self, times: np.ndarray, start: np.ndarray) -> dict[str, np.ndarray]:
        """States and algebraic variables at some times; where an event lies at one of them, those after it.

        Raises:
            NoEnd: if it does not come to an end.
        """
        relations = self.system.relations
        time, x = float(times[0]), np.array(start, dtype=float)
        self.c = np.zeros(0)
        if relations is not None:
            memory = () if relations.memory is None else np.array(relations.memory.start(time, self.parameters)).ravel()
            self.c = np.concatenate([np.zeros(len(relations.names)), memory])
            x = self._settled(relations, time, x, fresh=True)
        rows = [self._row(time, x)]
        longest = float(np.max(np.diff(times)))

        def crossing(time: float, x: np.ndarray) -> float:
            return float(np.min(self._margins(time, x)))

        crossing.terminal, crossing.direction = True, -1  # type: ignore[attr-defined]
        while len(rows) < len(times):
            end, until = float(times[-1]), self._until(time, float(times[-1]))
            wanted = times[len(rows) :]
            wanted = wanted[wanted < until * (1 - ROUNDING)]
            solved = solve_ivp(
                lambda t, state: self._parts(t, state)[0],
                (time, until),
                x,
                "Radau",
                t_eval=[*wanted, until],
                dense_output=True,
                events=crossing if relations is not None and relations.n_indicators else None,
                rtol=RELATIVE,
                atol=ABSOLUTE,
                max_step=longest,
            )
            if solved.status < 0:
                raise NoEnd(solved.message)
            at_event = solved.status == 1
            reached = len(solved.t) - (0 if at_event else 1)
            between = zip(solved.t[:reached], np.transpose(solved.y)[:reached], strict=True)
            rows += [self._row(t, state) for t, state in between]
            time, x = until, np.transpose(solved.y)[-1] if len(solved.y) else x
            if at_event:
                time, x = self._beyond(float(solved.t_events[0][0]), solved.sol, crossing)
            if relations is not None and (at_event or until < end):
                x = self._settled(relations, time, x, fresh=False)
                self.events.append(time)
            if len(self.events) > MOST_EVENTS:
                raise NoEnd(f"events without end at t = {time:g} s")
            while len(rows) < len(times) and times[len(rows)] <= time * (1 + ROUNDING):
                rows.append(self._row(time, x))
        names = [v.name for v in (*self.system.states, *self.system.algebraics)]
        return dict(zip(names, np.array(rows).T, strict=True))

    @staticmethod
    def _beyond(time: float, solution: Solution, crossing: Margin) -> tuple[float, np.ndarray]:
        """The first instant, within rounding, at which a relation has changed for sure, and the states there."""
        for power in range(FINEST):
            later = time + ROUNDING * max(abs(time), 1e-3) * (2.0**power - 1) * 1e-3
            if crossing(later, solution(later)) <= 0:
                return later, solution(later)
        raise NoEnd(f"a relation is touched at t = {time:g} s, no more")

    def _parts(self, time: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.evaluations += 1
        if self.evaluations > MOST_EVALUATIONS:
            raise NoEnd(f"too many steps up to t = {time:g} s")
        if self.system.relations is None:
            found = self.system.rhs(time, x, [], [], self.parameters)
        else:
            found = self.system.relations.rhs(time, x, [], [], self.parameters, self.c)
        return np.array(found[0]).ravel(), np.array(found[1]).ravel()

    def _row(self, time: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x, self._parts(time, x)[1]])

    def _margins(self, time: float, x: np.ndarray) -> np.ndarray:
        """How far each relation keeps its side; negative once it has changed."""
        relations = self.system.relations
        assert relations is not None
        g, size = (np.array(v).ravel() for v in relations.indicators(time, x, [], [], self.parameters, self.c))
        holds = self.c[: len(g)] > 0
        return np.where(holds, g, -g) + BAND * (1 + size)

    def _until(self, time: float, end: float) -> float:
        """The next time event, or the end."""
        relations = self.system.relations
        if relations is None:
            return end
        due = list(np.array(relations.times(self.parameters)[0]).ravel())
        if relations.memory is not None:
            due += list(np.array(relations.memory.due(self.c[len(relations.names) :])).ravel())
        return min([end, *(float(t) for t in due if t > time * (1 + ROUNDING) + 1e-300)])

    def _settled(self, relations: Relations, time: float, x: np.ndarray, *, fresh: bool) -> np.ndarray:
        """Let relations take sides and memories their values, until nothing changes; the states afterwards."""
        n = relations.n_indicators
        instants, rising = (np.array(part).ravel() for part in relations.times(self.parameters))
        passed = time * (1 + ROUNDING) >= instants
        self.c[n : len(relations.names)] = np.where(rising > 0, passed, ~passed)
        chance, turns = np.random.default_rng(0), 0
        for _ in range(100 + 20 * len(self.c)):
            before, turns = self.c.copy(), turns + 1
            margins = self._margins(time, x)
            wrong = margins <= 0
            if fresh and n:
                g = np.array(relations.indicators(time, x, [], [], self.parameters, before)[0]).ravel()
                wrong = ((g > 0) | ((g == 0) & np.array(relations.holds_at_zero, dtype=bool))) != (self.c[:n] > 0)
            wrong &= ~np.isnan(margins)
            open_ = np.isnan(margins) & ~wrong.any()  # no solution with these sides
            if (wrong | open_).any():
                if open_.any():
                    wrong = np.arange(n) == chance.choice(np.flatnonzero(open_))
                elif turns > TOGETHER:  # turning all of them leads round in a circle
                    wrong = np.arange(n) == chance.choice(np.flatnonzero(wrong))
                self.c[:n][wrong] = 1 - self.c[:n][wrong]
                continue
            turns = 0
            if relations.memory is None:
                return x
            memory, after = relations.memory.update(time, x, [], [], self.parameters, self.c)
            self.c[len(relations.names) :] = np.array(memory).ravel()
            if np.array_equal(before, self.c) and np.array_equal(x, np.array(after).ravel()):
                return x
            x = np.array(after).ravel()
        raise NoEnd(f"each side makes the other true at t = {time:g} s")
