"""Search over sets of effects: screen many on the correction residual, refit a few by free runs."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import groupby
from typing import TypeVar

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError
from orchestrator.diagnosis.candidates import Candidate, EffectSet, can_join
from orchestrator.diagnosis.evidence import LearningData, Refit
from orchestrator.diagnosis.screening import Explanation, Screened, Screener
from orchestrator.diagnosis.work import Here, ScreenTask, Work, done_by
from orchestrator.models.symbolic import SymbolicModel

MOST_EFFECTS = 3
# Refitted in a round: those that explain the most of the residual, and at least this share of it.
REFITTED = 6
LEAST_GAIN = 0.005
# Sets that are extended in the next round.
BEAM = 2
# An error this close to the floor leaves nothing to explain.
NEAR_FLOOR = 1.25
# An effect must take this share off the mean square error of the smaller set to be worth its parameters.
WORTHWHILE = 0.2
# An error this small a share of the nominal one is for the model's own parameters to explain, not for further effects.
NEGLIGIBLE = 0.005

Progress = Callable[[str], None]
Item = TypeVar("Item")
Found = TypeVar("Found")


@dataclass
class Trace:
    """Everything that was tried: screened sets and refitted sets."""

    screened: list[Screened] = field(default_factory=list)
    refitted: list[Refit] = field(default_factory=list)


class Searcher:
    """Searches for sets of candidates that explain the learning trials of one model."""

    def __init__(
        self,
        base: ModelicaModel,
        nominal: SymbolicModel,
        slots: Sequence[str],
        candidates: Sequence[Candidate],
        learning: LearningData,
        workers: int,
        progress: Progress,
        work: Work | None = None,
    ) -> None:
        self.work: Work = Here() if work is None else work
        self.base, self.nominal, self.slots = base, nominal, tuple(slots)
        self.candidates, self.learning = tuple(candidates), learning
        self.workers, self.progress = workers, progress
        self.trace = Trace()

    def run(self, nominal_cost: float) -> list[Refit]:
        """Return the path of accepted sets, growing by one effect each; `trace` keeps all that was tried.

        The path is empty if no single effect is worth naming.
        """
        path: list[Refit] = []
        beam: list[Refit] = []
        cost, screener, singles = nominal_cost, None, list[Explanation]()
        while len(path) < MOST_EFFECTS and cost > max(NEAR_FLOOR**2, NEGLIGIBLE**2 * nominal_cost):
            if not singles:
                screener = Screener(self.base, self.nominal, self.learning) if self.nominal.residual else None
                singles = self._explain(screener)
                screened = [single.screened for single in singles]
            else:
                screened = self._extensions(screener, beam, singles)
            self.trace.screened += screened
            found = sorted(self._refit(screened), key=lambda r: r.half_bic)
            self.trace.refitted += found
            best = next((r for r in found if r.matters(cost)), None)
            if best is None or best.cost > (1 - WORTHWHILE) * cost:
                break
            path.append(best)
            beam, cost = [r for r in found if r.is_present()][:BEAM], best.cost
        return self._nested(path)

    def _explain(self, screener: Screener | None) -> list[Explanation]:
        """Screen every candidate alone; without a residual in the equations they go to the refit as they are."""
        groups = [list(group) for _, group in groupby(self.candidates, key=lambda c: (c.card.id, c.card.variant))]

        def one(group: list[Candidate]) -> list[Explanation]:
            self.progress(f"screening {group[0].card.id.replace('_', ' ')}")
            try:
                if screener is not None:
                    if self.work.callers is None:
                        return screener.explain(group)
                    task = ScreenTask(self.base, self.nominal.signals, self.learning, tuple(group))
                    return list(self.work.do(task))
            except ComponentError:
                return []  # a candidate that cannot even be simulated explains nothing
            return [self._unscreened(candidate) for candidate in group]

        return [explanation for part in self._side_by_side(one, groups) for explanation in part]

    def _unscreened(self, candidate: Candidate) -> Explanation:
        guess = EffectSet(self.base, [candidate], self.nominal.signals).first_guess()
        return Explanation(Screened((candidate,), guess, np.nan), np.zeros((0, 0)), False)

    def _extensions(
        self, screener: Screener | None, beam: Sequence[Refit], singles: Sequence[Explanation]
    ) -> list[Screened]:
        """Every set that adds one candidate to a set of the beam; each set once, whatever its order."""
        found: dict[frozenset[str], Screened] = {}
        for current in beam:
            inside = current.effects.candidates
            placed = [(can_join(inside, s.screened.candidates[0], self.slots), s) for s in singles]
            possible = [(candidate, single) for candidate, single in placed if candidate is not None]
            if screener is not None and current.effects.model.residual is not None:
                try:
                    extended = screener.extend(current, possible)
                except ComponentError:
                    continue  # a set whose residual cannot be simulated with its fitted values leads nowhere
            else:
                extended = [
                    Screened((*inside, c), np.concatenate([current.fit.values, s.screened.values]), np.nan)
                    for c, s in possible
                ]
            for entry in extended:
                found.setdefault(frozenset(c.label for c in entry.candidates), entry)
        return list(found.values())

    def _refit(self, screened: Sequence[Screened]) -> list[Refit]:
        """Refit the most promising sets; those that screening cannot judge (gain NaN) all go in."""
        unjudged = [s for s in screened if np.isnan(s.gain)]
        passing = sorted((s for s in screened if s.gain > LEAST_GAIN), key=lambda s: -s.gain)

        def one(entry: Screened) -> Refit | None:
            self.progress(f"refitting {' + '.join(c.label for c in entry.candidates)}")
            try:
                return done_by(
                    self.work, self.base, entry.candidates, self.nominal.signals, self.learning, entry.values
                )
            except ComponentError:
                return None

        return [r for r in self._side_by_side(one, [*unjudged, *passing[:REFITTED]]) if r is not None]

    def _side_by_side(self, work: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
        with ThreadPoolExecutor(self.work.callers or self.workers) as pool:
            return list(pool.map(work, items))

    def _nested(self, path: list[Refit]) -> list[Refit]:
        """The path to the last set in which each step adds an effect to the one before."""
        nested = path[-1:]
        while nested and len(nested[0].effects.candidates) > 1:
            labels = {c.label for c in nested[0].effects.candidates}
            inside = [
                r
                for r in self.trace.refitted
                if len(r.effects.candidates) == len(labels) - 1 and {c.label for c in r.effects.candidates} < labels
            ]
            if not inside:
                break
            nested.insert(0, min(inside, key=lambda r: r.half_bic))
        return nested
