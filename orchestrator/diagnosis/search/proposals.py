"""What to refit: the sets that explain the most of the correction residual, and of the free runs' error."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby, pairwise

import numpy as np

from fmus.errors import MisfitError
from orchestrator.diagnosis.decide.nested import holds
from orchestrator.diagnosis.fit.candidates import EffectSet, can_join
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.search.fitting import Setting
from orchestrator.diagnosis.search.screening import Explanation, Screened, Screener, beside
from orchestrator.diagnosis.search.tasks import ScreenTask
from orchestrator.diagnosis.search.thresholds import BY_FREE_RUNS, CLEARLY, CLEARLY_LESS
from orchestrator.elapsed import counting
from orchestrator.library.cards import Candidate


class Proposer:
    """Proposes sets of candidates to refit, each candidate screened once, when it is first needed."""

    def __init__(self, setting: Setting, candidates: Sequence[Candidate]) -> None:
        self.setting, self.candidates = setting, tuple(candidates)
        self._screener: Screener | None = None
        self._singles: list[Explanation] = []

    def screened(self, beam: Sequence[Refit]) -> list[Screened]:
        """All candidates alone, the first time; then every set that adds one candidate to a set of the beam."""
        if self._singles:
            return self._extensions(beam)
        self._screener = self._made_screener()
        self._singles = self._explained()
        return [single.screened for single in self._singles]

    def chosen(
        self, screened: Sequence[Screened], stage: Stage, beam: Sequence[Refit], by_residual: int
    ) -> tuple[list[Screened], list[Screened]]:
        """The most promising sets, `by_residual` of the correction, by free runs and put together; and others to be refitted
        as a whole.

        Those are pairs and triples that explain more than all their parts let expect.
        """
        judged = sorted((s for s in screened if s.gain > 0), key=lambda s: -s.gain)[:by_residual]
        inside = stage.tangent.base.labels
        blind = all(np.isnan(s.gain) for s in screened)  # no residual of the equations shows what free runs hide
        wanted = {inside | {label} for label in stage.nominated(BY_FREE_RUNS, simple=blind and not inside)}
        hidden = [s for s in screened if np.isnan(s.gain)] if not stage.blocks else []
        by_labels = {frozenset(c.label for c in s.candidates): s for s in screened}
        found = [*judged, *hidden, *(by_labels[labels] for labels in wanted if labels in by_labels)]
        found += unions(beam, self.setting.slots)
        unique = {frozenset(c.label for c in s.candidates): s for s in found}
        ordered = [unique[labels] for labels in sorted(unique, key=sorted)]
        return ordered, [s for s in self._whole_sets(stage) if frozenset(c.label for c in s.candidates) not in unique]

    def _made_screener(self) -> Screener | None:
        """None if the equations have no residual, or none that can be simulated along the measurements."""
        setting = self.setting
        try:
            return Screener(setting.base, setting.nominal, setting.learning) if setting.nominal.residual else None
        except MisfitError:
            return None

    def _explained(self) -> list[Explanation]:
        """Screen every candidate alone; without a residual in the equations they go to the refit as they are."""
        groups = [list(group) for _, group in groupby(self.candidates, key=lambda c: (c.card.id, c.card.variant))]
        screening = counting(self.setting.progress, "screening", len(groups))

        def one(group: list[Candidate]) -> list[Explanation]:
            screening(group[0].card.id)
            return self._of_card(group)

        return [explanation for part in self.setting.side_by_side(one, groups) for explanation in part]

    def _of_card(self, group: list[Candidate]) -> list[Explanation]:
        setting = self.setting
        if self._screener is not None:
            try:
                if setting.work.callers is None:
                    return self._screener.explain(group)
                task = ScreenTask(setting.base, setting.nominal.signals, setting.learning, tuple(group))
                return list(setting.work.do(task))
            except MisfitError as error:
                for candidate in group:
                    setting.trace.fail([candidate], error)
        return [e for e in map(self._unscreened, group) if e is not None]

    def _unscreened(self, candidate: Candidate) -> Explanation | None:
        """A candidate as only free runs can judge it; None if not even its model can be built."""
        try:
            guess = EffectSet(self.setting.base, [candidate], self.setting.nominal.signals).first_guess()
        except MisfitError as error:
            self.setting.trace.fail([candidate], error)
            return None
        return Explanation(Screened((candidate,), guess, np.nan), np.zeros((0, 0)), False)

    def _extensions(self, beam: Sequence[Refit]) -> list[Screened]:
        """Every set that adds one candidate to a set of the beam; each set once, whatever its order.

        Gains count from the cost of the best set, so that extensions of a poor set do not crowd out those of a good one; a
        candidate beside another set has to leave clearly less than beside the best, else the same is fitted twice.
        """
        found: dict[frozenset[str], Screened] = {}
        beside_best: dict[str, float] = {}
        for current in beam:
            for entry in self._extended(current):
                left, added = (1.0 - entry.gain) * current.cost / beam[0].cost, entry.candidates[-1].label
                if current is beam[0]:
                    beside_best[added] = left
                elif left > CLEARLY_LESS * beside_best.get(added, np.inf):
                    continue
                counted = replace(entry, gain=1.0 - left)
                found.setdefault(frozenset(c.label for c in entry.candidates), counted)
        return list(found.values())

    def _extended(self, current: Refit) -> list[Screened]:
        inside = current.effects.candidates
        placed = [(can_join(inside, s.screened.candidates[0], self.setting.slots), s) for s in self._singles]
        possible = [(c, single) for c, single in placed if c is not None and not _repeats(c, inside)]
        if self._screener is None or current.effects.model.residual is None:
            return [self._unjudged(current, c, single.screened) for c, single in possible]
        try:
            return self._screener.extend(current, possible)
        except MisfitError:
            return []  # a set whose residual cannot be simulated with its fitted values leads nowhere

    def _unjudged(self, current: Refit, candidate: Candidate, single: Screened) -> Screened:
        """A set and a further candidate of which only free runs tell what it explains, from its values alone."""
        chosen, others = (*current.effects.candidates, candidate), tuple(beside(current, row) for row in single.others)
        return Screened(chosen, beside(current, single.values), np.nan, others)

    def _whole_sets(self, stage: Stage) -> list[Screened]:
        """The best sets of two and three further effects to first order, if they score clearly above smaller ones.

        And the best pair that hides behind its parts, if it scores clearly above the best single effect.
        """
        values = {s.screened.candidates[0].label: s.screened.values for s in self._singles}
        current, found, steps = stage.tangent.base, list[Screened](), list(pairwise(stage.best))
        hidden = stage.hidden_pair
        if steps and hidden is not None and all(hidden.blocks != larger.blocks for _, larger in steps):
            steps.append((stage.best[0], hidden))
        for smaller, larger in steps:
            labels = [stage.blocks[k].candidate.label for k in larger.blocks]
            if larger.score < smaller.score + CLEARLY or not all(label in values for label in labels):
                continue
            chosen, first = list(current.effects.candidates), [current.values]
            for k, label in zip(larger.blocks, labels, strict=True):
                placed = can_join(chosen, stage.blocks[k].candidate, self.setting.slots)
                if placed is not None:
                    chosen.append(placed)
                    first.append(values[label])
            found.append(Screened(tuple(chosen), np.concatenate(first), np.nan))
        return found


def unions(beam: Sequence[Refit], slots: Sequence[str]) -> list[Screened]:
    """The first of fitted sets with what another one has beside it, if that is one effect more.

    Of two effects that explain much alone, neither shows along the run that has the other where slopes say little.
    """
    best, found = beam[0], list[Screened]()
    for other in beam[1:]:
        placed = list(best.effects.candidates)
        values = [best.values]
        for k, candidate in enumerate(other.effects.candidates):
            if candidate.label in best.labels:
                continue
            twin = can_join(placed, candidate, slots)
            if twin is None or _repeats(twin, placed):
                break
            placed.append(twin)
            values.append(other.values[np.array(other.effects.owners()) == k])
        if len(placed) == len(best.effects.candidates) + 1:
            found.append(Screened(tuple(placed), np.concatenate(values), np.nan))
    return found


def _repeats(candidate: Candidate, others: Sequence[Candidate]) -> bool:
    """Whether one of the others is at the same site a law that holds the candidate's, or one that it holds."""
    cards = [other.card for other in others if other.site == candidate.site]
    return any(holds(card, candidate.card) or holds(candidate.card, card) for card in cards)
