"""Search over sets of effects: screen many on the correction residual, refit a few by free runs."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError
from orchestrator.diagnosis.candidates import Candidate, EffectSet, can_join
from orchestrator.diagnosis.evidence import LearningData, Refit, Screened, refit, residual_size, screen
from orchestrator.models.symbolic import SymbolicModel

MOST_EFFECTS = 3
# Refitted in a round: those that explain the most of the residual, and at least this share of it.
REFITTED = 5
LEAST_GAIN = 0.005
# Sets that are extended in the next round.
BEAM = 2
# An error this close to the floor leaves nothing to explain.
NEAR_FLOOR = 1.25
# An effect must take this share off the mean square error of the smaller set to be worth its parameters.
WORTHWHILE = 0.2

Progress = Callable[[str], None]


@dataclass
class Trace:
    """Everything that was tried: screened sets and refitted sets."""

    screened: list[Screened] = field(default_factory=list)
    refitted: list[Refit] = field(default_factory=list)


@dataclass(frozen=True)
class Searcher:
    """The setting of a search: base model, candidates, learning data, and how to work."""

    base: ModelicaModel
    nominal: SymbolicModel
    slots: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    learning: LearningData
    workers: int
    progress: Progress

    def run(self, nominal_cost: float) -> tuple[list[Refit], Trace]:
        """Return the path of accepted sets, growing by one effect each, and all that was tried.

        The path is empty if no single effect is worth naming.
        """
        trace, path = Trace(), list[Refit]()
        size = residual_size(self.nominal, self.learning) if self.nominal.residual is not None else None
        beam: list[Refit] = []
        cost = nominal_cost
        for count in range(1, MOST_EFFECTS + 1):
            if cost < NEAR_FLOOR**2:
                break
            sets = self._extensions([r.effects.candidates for r in beam] or [()])
            screened = self._screen(sets, size, count)
            trace.screened += screened
            found = sorted(self._refit(screened, count), key=lambda r: r.cost)
            trace.refitted += found
            best = next((r for r in found if r.is_meaningful()), None)
            if best is None or best.cost > (1 - WORTHWHILE) * cost:
                break
            path.append(best)
            beam, cost = found[:BEAM], best.cost
        return self._nested(path, trace), trace

    def _extensions(self, bases: Sequence[tuple[Candidate, ...]]) -> list[tuple[Candidate, ...]]:
        """Every set that adds one candidate to a base; each set once, whatever its order."""
        found: dict[frozenset[str], tuple[Candidate, ...]] = {}
        for base in bases:
            for other in self.candidates:
                placed = can_join(base, other, self.slots)
                if placed is not None:
                    extended = (*base, placed)
                    found.setdefault(frozenset(c.label for c in extended), extended)
        return list(found.values())

    def _screen(self, sets: Sequence[tuple[Candidate, ...]], size: np.ndarray | None, count: int) -> list[Screened]:
        if size is None:  # no correction residual in the equations: everything is refitted
            return [Screened(s, EffectSet(self.base, s, self.nominal.signals).first_guess(), 0.0) for s in sets]

        def one(candidates: tuple[Candidate, ...]) -> Screened:
            self.progress(f"screening {' + '.join(c.label for c in candidates)}")
            effects = EffectSet(self.base, candidates, self.nominal.signals)
            try:
                return screen(effects, self.learning, size)
            except ComponentError:
                return Screened(candidates, effects.first_guess(), 0.0)

        with ThreadPoolExecutor(self.workers) as pool:
            return sorted(pool.map(one, sets), key=lambda s: -s.gain)

    def _refit(self, screened: Sequence[Screened], count: int) -> list[Refit]:
        passing = [s for s in screened if s.gain > LEAST_GAIN or self.nominal.residual is None]
        chosen = passing[:REFITTED] if self.nominal.residual is not None else passing

        def one(entry: Screened) -> Refit | None:
            self.progress(f"refitting {' + '.join(c.label for c in entry.candidates)}")
            try:
                return refit(EffectSet(self.base, entry.candidates, self.nominal.signals), self.learning, entry.values)
            except ComponentError:
                return None  # a set that cannot even be simulated explains nothing

        with ThreadPoolExecutor(self.workers) as pool:
            return [r for r in pool.map(one, chosen) if r is not None]

    def _nested(self, path: list[Refit], trace: Trace) -> list[Refit]:
        """The path to the last set in which each step adds an effect to the one before."""
        if not path:
            return path
        nested = [path[-1]]
        while len(nested[0].effects.candidates) > 1:
            labels = {c.label for c in nested[0].effects.candidates}
            count = len(labels) - 1
            inside = [
                r
                for r in trace.refitted
                if len(r.effects.candidates) == count and {c.label for c in r.effects.candidates} < labels
            ]
            if not inside:
                break
            nested.insert(0, min(inside, key=lambda r: r.cost))
        return nested
