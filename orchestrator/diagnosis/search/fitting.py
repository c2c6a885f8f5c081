"""How sets of effects are refitted by free runs: many roughly, a few to the end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from fmus.errors import ComponentError, MisfitError
from orchestrator.blackbox.source import Source
from orchestrator.diagnosis.fit.evidence import LearningData, Refit
from orchestrator.diagnosis.fit.start_values import StartValues
from orchestrator.diagnosis.fit.thresholds import TOLERANCE
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.thresholds import BEYOND_NOISE
from orchestrator.diagnosis.search.cutting import TooLong, is_worth_a_cut
from orchestrator.diagnosis.search.first_values import first_values
from orchestrator.diagnosis.search.screening import Screened
from orchestrator.diagnosis.search.stretches import Followed
from orchestrator.diagnosis.search.tasks import FollowTask, Wanted, done_by
from orchestrator.diagnosis.search.thresholds import POLISHED, ROUGH
from orchestrator.diagnosis.search.trace import Trace
from orchestrator.elapsed import counting
from orchestrator.library.cards import Candidate
from orchestrator.models.estimation import Fit
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.models.threads import threads
from orchestrator.work import Work

Progress = Callable[[str], None]
Item = TypeVar("Item")
Found = TypeVar("Found")


@dataclass(frozen=True, eq=False)
class Setting:
    """What a search works on, and with: a model without effects, its free slots, the learning trials, who does the work.

    `trace` keeps what was tried. With `may_cut`, trials that no run with contacts can follow to the end are `TooLong`.
    """

    base: Source
    nominal: SymbolicModel
    slots: tuple[str, ...]
    learning: LearningData
    work: Work
    workers: int
    progress: Progress
    trace: Trace
    may_cut: bool = False

    def side_by_side(self, work: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
        """Do work on items at the same time; results in the order of the items."""
        with threads(self.work.callers or self.workers) as workers:
            return workers.do(work, items)


class Fitter:
    """Refits sets of candidates; the reason why one cannot be built, simulated or fitted goes to the trace."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting

    def attempt(self, wanted: Wanted) -> Refit | None:
        """Refit a set; None if it cannot be."""
        try:
            return self._fitted(wanted)
        except MisfitError as error:
            self.setting.trace.fail(wanted.candidates, error)
            return None

    def _fitted(self, wanted: Wanted) -> Refit:
        setting = self.setting
        try:
            found = done_by(setting.work, setting.base, setting.nominal.signals, setting.learning, wanted)
        except ValueError as error:  # bounds that exclude each other, numbers that overflow
            raise ComponentError(
                f"{' + '.join(c.label for c in wanted.candidates)} cannot be fitted: {error}"
            ) from error
        setting.trace.operations.append(found.fit.operations)
        return found

    def refit(
        self, sets: Sequence[Screened], whole: Sequence[Screened], stage: Stage, nuisances: np.ndarray
    ) -> list[Refit]:
        """Refit sets, then sets that are taken as a `whole`, which may begin from the best of the former."""
        smaller = self._roughly(sets, (), stage, nuisances)
        rough = sorted([*smaller, *self._roughly(whole, smaller, stage, nuisances)], key=lambda r: r.half_bic)
        first = [*rough[:POLISHED], *lost_contacts(rough)]
        rest = [r for r in rough if not any(r is each for each in first)]
        polished = sorted(self._polished(first), key=lambda r: r.half_bic)
        return [*polished, *rest]

    def _roughly(
        self, sets: Sequence[Screened], nearer: Sequence[Refit], stage: Stage, nuisances: np.ndarray
    ) -> list[Refit]:
        base = stage.tangent.base
        near = StartValues.of(base.model, base.fit)

        refitting = counting(self.setting.progress, "refitting", len(sets))

        def one(entry: Screened) -> Refit | None:
            refitting(" and ".join(c.label for c in entry.candidates))
            first = np.array([entry.values, *entry.others, *first_values(stage, entry.candidates, nearer)])
            return self.attempt(Wanted(entry.candidates, first, nuisances, ROUGH, near=near))

        rough = self.setting.side_by_side(one, sets)
        found = [(r, entry.values) for r, entry in zip(rough, sets, strict=True) if r is not None]
        if any(r.cost <= BEYOND_NOISE**2 for r, _ in found):
            return [r for r, _ in found]
        return self.setting.side_by_side(lambda each: self.from_first_stretch(*each), found)

    def from_first_stretch(self, found: Refit, first: np.ndarray) -> Refit:
        """A fitted set, or the same from first values (k,) over stretches of growing length, if it follows the trials
        to their end.

        Along whole trials a large effect makes another motion of slightly other values, and a fit ends at the nearest
        of many minima: over a first stretch there is but one. Sets with contacts are followed `in_stretches`, from
        their fit.
        """
        if self.setting.nominal.residual is None or found.effects.contacts:
            return found
        self.setting.progress(f"following {' + '.join(found.ids)}")
        values = np.r_[np.clip(first, *found.effects.bounds()), found.fit.values[found.size :]]
        followed = self._over_stretches(replace(found, fit=replace(found.fit, values=values)))
        if followed is None or followed.samples < self.setting.learning.longest:
            return found
        return self._closer_if_better(found, followed.fit, ROUGH)

    def closer(self, found: Refit) -> Refit:
        """A fitted set, fitted further from where it is, to the end."""
        better = self._closer(found, found.fit)
        return found if better is None else better

    def _closer(self, found: Refit, earlier: Fit, tolerance: float = TOLERANCE) -> Refit | None:
        """A set fitted from where an earlier fit of it is; None if it cannot be."""
        values = earlier.values
        wanted = Wanted(found.effects.candidates, values[: found.size], values[found.size :], tolerance, earlier)
        return self.attempt(wanted)

    def _closer_if_better(self, found: Refit, earlier: Fit, tolerance: float = TOLERANCE) -> Refit:
        """A set fitted from where an earlier fit of it is, or as it was found if that leaves less."""
        again = self._closer(found, earlier, tolerance)
        return found if again is None or again.fit.misfit > found.fit.misfit else again

    def _polished(self, rough: Sequence[Refit]) -> list[Refit]:
        """Sets fitted to the end, but for those that went astray, which stay rough; smaller sets first."""
        followed = list[Refit]()
        for r in sorted(rough, key=lambda r: len(r.ids)):
            followed.append(r if _is_astray(r, followed) else self.in_stretches(r))

        def finished(r: Refit) -> Refit:
            done = not any(r is each for each in rough)
            return r if done or _is_astray(r, followed) else self.closer(r)

        return self.setting.side_by_side(finished, followed)

    def in_stretches(self, found: Refit) -> Refit:
        """A set with contacts, fitted to the end over stretches of growing length if it leaves much more than noise and
        that less.

        Raises:
            TooLong: if it is lost on the way, and yet follows the trials for twice as long as the model does without effects.
        """
        if found.cost <= BEYOND_NOISE**2 or not found.effects.contacts:
            return found
        learning = self.setting.learning
        followed = self._over_stretches(found)
        if followed is None:
            return found
        if self.setting.may_cut and followed.samples < learning.longest:
            without = self._over_stretches(self.setting.trace.stages[0].tangent.base)
            if is_worth_a_cut(followed.samples, 0 if without is None else without.samples):
                raise TooLong(followed.stretch * learning.step)
        return self._closer_if_better(found, followed.fit)

    def _over_stretches(self, found: Refit) -> Followed | None:
        setting, chosen = self.setting, found.effects.candidates
        task = FollowTask(setting.base, setting.nominal.signals, setting.learning, chosen, found.fit)
        followed: Followed | None = setting.work.do(task)
        setting.trace.operations.append(0.0 if followed is None else followed.operations)
        return followed

    def simplified(
        self, found: Refit, cost: Callable[[Refit], float], redundant: Callable[[Refit, Refit], bool]
    ) -> Refit:
        """A fitted set, or what it is without one of its effects after another, as long as that costs less or the effect is
        `redundant`, as that tells from what is left, fitted roughly, and the whole.

        An effect may have helped a fit on its way that is none at the end of it, such as a lag that a clock makes up for;
        without it the same fit from the start may have gone astray.
        """
        if len(found.ids) < 2:
            return found
        tried = self.setting.side_by_side(lambda c: self.without(found, c, ROUGH), found.effects.candidates)
        smaller = sorted((r for r in tried if r is not None), key=cost)
        if smaller and cost(smaller[0]) < cost(found):
            return self.simplified(self.closer(smaller[0]), cost, redundant)
        without = next((r for r in smaller if redundant(r, found)), None)
        return found if without is None else self.simplified(self.closer(without), cost, redundant)

    def without(self, found: Refit, effect: Candidate, tolerance: float = TOLERANCE) -> Refit | None:
        """The other effects of a set, fitted from where they are in it."""
        rest = [c for c in found.effects.candidates if c.label != effect.label]
        first, near = found.values[_of_others(found, effect)], StartValues.of(found.model, found.fit)
        nuisances = found.fit.values[found.size :]
        return self.attempt(Wanted(rest, first, nuisances, tolerance, near=near, settled=True))

    def pruned(self, found: Sequence[Refit]) -> list[Refit]:
        """Sets without the effects that the data do not show beside the others, as far as they were not tried.

        One that was tried and is less likely than with those effects has gone astray, and is fitted again from their values.
        """
        known = sorted((*self.setting.trace.refitted, *found), key=lambda r: -r.half_bic)
        tried = {r.labels: r.half_bic for r in known}
        smaller: dict[frozenset[str], Wanted] = {}
        for r in sorted(found, key=lambda r: r.half_bic)[:POLISHED]:
            kept = r.without_absent()
            labels = frozenset(c.label for c, _ in kept)
            if kept and labels != r.labels and tried.get(labels, np.inf) > r.half_bic:
                values = np.concatenate([v for _, v in kept])
                begun = StartValues.of(r.model, r.fit)
                smaller.setdefault(
                    labels, Wanted([c for c, _ in kept], values, r.fit.values[r.size :], near=begun, settled=True)
                )
        fitted = self.setting.side_by_side(self.attempt, list(smaller.values()))
        return [r for r in fitted if r is not None]


def lost_contacts(rough: Sequence[Refit]) -> list[Refit]:
    """The smallest of the sets with contacts, the likeliest of several, if all sets leave much more than noise and none
    of the first has any.

    Runs that lose a rattling play part from the measurement whatever its size is: what it leaves says nothing of it.
    """
    if any(r.cost <= BEYOND_NOISE**2 for r in rough) or any(r.effects.contacts for r in rough[:POLISHED]):
        return []
    return sorted((r for r in rough if r.effects.contacts), key=lambda r: len(r.ids))[:1]


def _is_astray(found: Refit, others: Sequence[Refit]) -> bool:
    """Whether a set with contacts leaves much more than noise, and one of the others, which it holds, does not."""
    enough = BEYOND_NOISE**2
    return (
        found.effects.contacts
        and found.cost > enough
        and any(r.cost <= enough and r.labels < found.labels for r in others)
    )


def _of_others(found: Refit, effect: Candidate) -> np.ndarray:
    """Which parameters (k,) of a set are not those of one of its effects."""
    return np.array([found.effects.candidates[k].label != effect.label for k in found.effects.owners()])
