"""Search over sets of effects: screen all, test whether noise alone would look like that, refit a few by free runs."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby, pairwise
from typing import TypeVar

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.errors import ComponentError, MisfitError
from orchestrator.diagnosis.calibration import NEAR_FLOOR, SIGNIFICANT, Stage
from orchestrator.diagnosis.candidates import Candidate, EffectSet, as_fmu, can_join
from orchestrator.diagnosis.confusion import DECISIVE, half_bic
from orchestrator.diagnosis.evidence import TOLERANCE, LearningData, Refit, fit_nominal
from orchestrator.diagnosis.first_values import elsewhere, first_values
from orchestrator.diagnosis.kinship import kin
from orchestrator.diagnosis.placed import placed
from orchestrator.diagnosis.response import Response
from orchestrator.diagnosis.screening import Explanation, Screened, Screener
from orchestrator.diagnosis.tangent import Tangent
from orchestrator.diagnosis.trace import Accepted, Trace
from orchestrator.diagnosis.work import Here, ScreenTask, Work, done_by
from orchestrator.models.estimation import Fit
from orchestrator.models.symbolic import SymbolicModel

MOST_EFFECTS = 3
MOST_ROUNDS = 5
# A larger set must score this much more, a chance of 1 in 20, to be refitted as a whole.
CLEARLY = 3.0
# Refitted in a round: those that explain the most of the correction residual, and the most of the free runs' error.
BY_RESIDUAL = 5
BY_FREE_RUNS = 3
# And of effects of one parameter, where no residual of the equations shows what free runs hide.
SIMPLE = 3
# All are fitted roughly, the best few to the end.
ROUGH = 1e-3
POLISHED = 3
# Sets that are extended in the next round.
BEAM = 2

Progress = Callable[[str], None]
Item = TypeVar("Item")
Found = TypeVar("Found")


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
        self.trace = Trace(len({c.label for c in candidates}))

    def run(self) -> list[Accepted]:
        """Return the path of accepted sets, growing by one effect each; `trace` keeps all that was tried.

        The path is empty if no single effect is worth naming. The last stage of `trace` tests the last set of the path.
        """
        base = fit_nominal(EffectSet(self.base, (), self.nominal.signals), self.nominal, self.learning)
        self.candidates = placed(self.candidates, Response(base, [t.smoother for t in self.learning.trials]))
        beam: list[Refit] = [base]
        screener, singles = None, list[Explanation]()
        for _ in range(MOST_ROUNDS):
            stage = self._stage(base, MOST_EFFECTS - len(base.ids))
            if len(base.ids) == MOST_EFFECTS or not self._worth_a_search(stage):
                break
            if not singles:
                screener = self._screener()
                singles = self._explain(screener)
                screened = [single.screened for single in singles]
            else:
                screened = self._extensions(screener, beam, singles)
            self.trace.screened += screened
            found = self._refit(screened, beam, stage, singles)
            noise = stage.colour.level**2
            found = sorted([*found, *self._pruned(found)], key=lambda r: half_bic(r, noise, self.trace.choices))
            self.trace.refitted += found
            bound = half_bic(base, noise, self.trace.choices)
            better = [r for r in found if half_bic(r, noise, self.trace.choices) < bound]
            best = next((r for r in better if r.is_present() and not self.trace.objection(r)), None)
            if best is None:
                break
            base, beam = best, [best, *(r for r in found if r.is_present() and r is not best)][:BEAM]
        return self._nested(base)

    def try_kin(self, best: Refit) -> None:
        """Refit what acts like an effect of a set and was not tried in its place, so that the odds are those of fits.

        So is a simpler effect that its card calls confusable, of which it may be no more than a special case.
        """
        tried = {r.labels for r in self.trace.refitted}
        alike = [(entry.effect, entry.other) for entry in kin(best, self.trace.stages) if entry.odds <= DECISIVE]
        for effect, other in dict.fromkeys([*alike, *self._simpler(best)]):
            others = [c for c in best.effects.candidates if c.label != effect.label]
            twin = can_join(others, other, self.slots)
            if twin is None or frozenset(c.label for c in (*others, twin)) in tried:
                continue
            self.progress(f"refitting {twin.label} in place of {effect.label}")
            chosen = (*others, twin)
            values = [best.values[np.array(best.effects.owners()) == best.effects.candidates.index(c)] for c in others]
            guess = EffectSet(self.base, [twin], self.nominal.signals).first_guess()
            stage = next(s for s in reversed(self.trace.stages) if s.tangent.base.labels <= {c.label for c in others})
            first = np.array([np.concatenate([*values, guess]), *first_values(stage, chosen)])
            found = self._attempted(chosen, first, best.fit.values[best.size :])
            self.trace.refitted += [] if found is None else [found]

    def _simpler(self, best: Refit) -> list[tuple[Candidate, Candidate]]:
        """Effects of a set, each with an effect of fewer parameters at the same site that its card calls confusable."""
        return [
            (effect, other)
            for effect in best.effects.candidates
            for other in self.candidates
            if other.site == effect.site
            and other.card.id in effect.card.confusable
            and len(other.card.parameters) < len(effect.card.parameters)
        ]

    @staticmethod
    def _worth_a_search(stage: Stage) -> bool:
        """Whether a fitted set leaves what noise would not, and enough of it.

        What a set leaves may be too little for a further effect, and yet show that another one is the right one; and what
        neither candidates nor flexible forces explain to first order may be an effect that has none.
        """
        return (stage.p_value <= SIGNIFICANT and stage.may_matter) or stage.is_structured

    def _pruned(self, found: Sequence[Refit]) -> list[Refit]:
        """Sets without the effects that the data do not show beside the others, as far as they were not tried."""
        tried = {r.labels for r in (*self.trace.refitted, *found)}
        smaller: dict[frozenset[str], Refit] = {}
        for r in sorted(found, key=lambda r: r.half_bic)[:POLISHED]:
            kept = r.without_absent()
            labels = frozenset(c.label for c, _ in kept)
            if kept and labels not in tried and labels not in smaller:
                values = np.concatenate([v for _, v in kept])
                fitted = self._attempted([c for c, _ in kept], values, r.fit.values[r.size :])
                if fitted is not None:
                    smaller[labels] = fitted
        return list(smaller.values())

    def test_of(self, found: Refit) -> Stage:
        """The test of what a set leaves, made now if the search did not need it."""
        known = [s for s in self.trace.stages if s.tangent.base.labels == found.labels]
        return known[-1] if known else self._stage(found, MOST_EFFECTS - len(found.ids))

    def _stage(self, base: Refit, further: int) -> Stage:
        """Test a fitted set on what it leaves."""
        self.progress(f"testing what {' + '.join(base.ids) or 'the model'} leaves")
        tangent = Tangent(base, self.nominal, self.learning)
        # Equations that are solved by iteration take too long to run for every candidate; an FMU's fits take longer still.
        first_order = tangent.response.is_formula or as_fmu(self.base) is not None
        blocks = tangent.blocks(self.candidates, self.slots, self._side_by_side) if first_order else []
        stages = self.trace.stages
        stage = Stage(tangent, blocks, further, len(stages), stages[0] if stages else None)
        stages.append(stage)
        return stage

    def _screener(self) -> Screener | None:
        """None if the equations have no residual, or none that can be simulated along the measurements."""
        try:
            return Screener(self.base, self.nominal, self.learning) if self.nominal.residual else None
        except MisfitError:
            return None

    def _explain(self, screener: Screener | None) -> list[Explanation]:
        """Screen every candidate alone; without a residual in the equations they go to the refit as they are."""
        groups = [list(group) for _, group in groupby(self.candidates, key=lambda c: (c.card.id, c.card.variant))]

        def one(group: list[Candidate]) -> list[Explanation]:
            self.progress(f"screening {group[0].card.id.replace('_', ' ')}")
            if screener is not None:
                try:
                    if self.work.callers is None:
                        return screener.explain(group)
                    task = ScreenTask(self.base, self.nominal.signals, self.learning, tuple(group))
                    return list(self.work.do(task))
                except MisfitError as error:
                    for candidate in group:
                        self.trace.fail([candidate], error)
            return [e for e in map(self._unscreened, group) if e is not None]

        return [explanation for part in self._side_by_side(one, groups) for explanation in part]

    def _unscreened(self, candidate: Candidate) -> Explanation | None:
        """A candidate as only free runs can judge it; None if not even its model can be built."""
        try:
            guess = EffectSet(self.base, [candidate], self.nominal.signals).first_guess()
        except MisfitError as error:
            self.trace.fail([candidate], error)
            return None
        return Explanation(Screened((candidate,), guess, np.nan), np.zeros((0, 0)), False)

    def _extensions(
        self, screener: Screener | None, beam: Sequence[Refit], singles: Sequence[Explanation]
    ) -> list[Screened]:
        """Every set that adds one candidate to a set of the beam; each set once, whatever its order.

        Gains count from the cost of the best set, so that extensions of a poor set do not crowd out those of a good one.
        """
        found: dict[frozenset[str], Screened] = {}
        for current in beam:
            inside = current.effects.candidates
            placed = [(can_join(inside, s.screened.candidates[0], self.slots), s) for s in singles]
            possible = [(candidate, single) for candidate, single in placed if candidate is not None]
            if screener is not None and current.effects.model.residual is not None:
                try:
                    extended = screener.extend(current, possible)
                except MisfitError:
                    continue  # a set whose residual cannot be simulated with its fitted values leads nowhere
            else:
                extended = [
                    Screened((*inside, c), np.concatenate([current.values, s.screened.values]), np.nan)
                    for c, s in possible
                ]
            for entry in extended:
                gain = 1.0 - (1.0 - entry.gain) * current.cost / beam[0].cost
                counted = Screened(entry.candidates, entry.values, gain)
                found.setdefault(frozenset(c.label for c in entry.candidates), counted)
        return list(found.values())

    def _refit(
        self, screened: Sequence[Screened], beam: Sequence[Refit], stage: Stage, singles: Sequence[Explanation]
    ) -> list[Refit]:
        """Refit the most promising sets, by the correction residual and by free runs.

        A pair or a triple that explains more than all its parts let expect is refitted as a whole.
        """
        judged = sorted((s for s in screened if s.gain > 0), key=lambda s: -s.gain)[:BY_RESIDUAL]
        inside = stage.tangent.base.labels
        blind = all(np.isnan(s.gain) for s in screened)
        wanted = {inside | {label} for label in stage.nominated(BY_FREE_RUNS, SIMPLE if blind else 0)}
        hidden = [s for s in screened if np.isnan(s.gain)] if not stage.blocks else []
        by_labels = {frozenset(c.label for c in s.candidates): s for s in screened}
        chosen = [*judged, *hidden, *(by_labels[labels] for labels in wanted if labels in by_labels)]
        unique = {frozenset(c.label for c in s.candidates): s for s in chosen}
        ordered = [unique[labels] for labels in sorted(unique, key=sorted)]

        whole = [s for s in self._whole_sets(stage, singles) if frozenset(c.label for c in s.candidates) not in unique]

        def fitted(entries: Sequence[Screened], nearer: Sequence[Refit]) -> list[Refit]:
            def one(entry: Screened) -> Refit | None:
                self.progress(f"refitting {' + '.join(c.label for c in entry.candidates)}")
                first = np.array([entry.values, *first_values(stage, entry.candidates, nearer)])
                return self._attempted(entry.candidates, first, beam[0].fit.values[beam[0].size :], ROUGH)

            return [r for r in self._side_by_side(one, entries) if r is not None]

        def closer(found: Refit) -> Refit:
            nuisances = found.fit.values[found.size :]
            better = self._attempted(found.effects.candidates, found.values, nuisances, earlier=found.fit)
            return found if better is None else better

        smaller = fitted(ordered, ())
        rough = sorted([*smaller, *fitted(whole, smaller)], key=lambda r: r.half_bic)
        polished = sorted(self._side_by_side(closer, rough[:POLISHED]), key=lambda r: r.half_bic)
        return [*(self._from_elsewhere(r, stage) for r in polished[:1]), *polished[1:], *rough[POLISHED:]]

    def _from_elsewhere(self, found: Refit, stage: Stage) -> Refit:
        """A fitted set, or the same from another point of a grid, if it leaves more than noise and that leaves less."""
        if found.cost <= NEAR_FLOOR:
            return found
        nuisances = found.fit.values[found.size :]
        starts = elsewhere(stage, found)
        tried = self._side_by_side(lambda row: self._attempted(found.effects.candidates, row, nuisances), starts)
        return min([found, *(r for r in tried if r is not None)], key=lambda r: r.fit.misfit)

    def _attempted(
        self,
        chosen: Sequence[Candidate],
        first: np.ndarray,
        nuisances: np.ndarray,
        tolerance: float = TOLERANCE,
        earlier: Fit | None = None,
    ) -> Refit | None:
        """Refit a set; None, and the reason in the trace, if it cannot be built, simulated or fitted."""
        try:
            return self._fitted(chosen, first, nuisances, tolerance, earlier)
        except MisfitError as error:
            self.trace.fail(chosen, error)
            return None

    def _fitted(
        self,
        chosen: Sequence[Candidate],
        first: np.ndarray,
        nuisances: np.ndarray,
        tolerance: float = TOLERANCE,
        earlier: Fit | None = None,
    ) -> Refit:
        signals = self.nominal.signals
        try:
            return done_by(self.work, self.base, chosen, signals, self.learning, first, nuisances, tolerance, earlier)
        except ValueError as error:  # bounds that exclude each other, numbers that overflow
            raise ComponentError(f"{' + '.join(c.label for c in chosen)} cannot be fitted: {error}") from error

    def _whole_sets(self, stage: Stage, singles: Sequence[Explanation]) -> list[Screened]:
        """The best sets of two and three further effects to first order, if they score clearly above smaller ones."""
        values = {s.screened.candidates[0].label: s.screened.values for s in singles}
        current, found = stage.tangent.base, list[Screened]()
        for smaller, larger in pairwise(stage.best):
            labels = [stage.blocks[k].candidate.label for k in larger.blocks]
            if larger.score < smaller.score + CLEARLY or not all(label in values for label in labels):
                continue
            chosen, first = list(current.effects.candidates), [current.values]
            for k, label in zip(larger.blocks, labels, strict=True):
                placed = can_join(chosen, stage.blocks[k].candidate, self.slots)
                if placed is not None:
                    chosen.append(placed)
                    first.append(values[label])
            found.append(Screened(tuple(chosen), np.concatenate(first), np.nan))
        return found

    def _side_by_side(self, work: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
        with ThreadPoolExecutor(self.work.callers or self.workers) as pool:
            return list(pool.map(work, items))

    def _nested(self, last: Refit) -> list[Accepted]:
        """The path to the last set, in which each step adds an effect to the one before as far as that was tried."""
        if not last.ids:
            return []
        nested = [last]
        while len(nested[0].ids) > 1:
            labels = nested[0].labels
            inside = [r for r in self.trace.refitted if len(r.ids) == len(labels) - 1 and r.labels < labels]
            if not inside:
                break
            nested.insert(0, min(inside, key=lambda r: r.half_bic))
        return [Accepted(r, self.trace.p_value(r)) for r in nested]
