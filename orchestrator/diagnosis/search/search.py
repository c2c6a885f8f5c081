"""Search over sets of effects: screen all, test whether noise alone would look like that, refit a few by free runs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from orchestrator.blackbox.source import Source
from orchestrator.diagnosis.decide.confusion import half_bic, near_in_either
from orchestrator.diagnosis.decide.nested import holds, starts
from orchestrator.diagnosis.decide.thresholds import DECISIVE
from orchestrator.diagnosis.fit.candidates import EffectSet, can_join
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, fit_nominal
from orchestrator.diagnosis.fit.extensible import extensible
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.carried_noise import NoiseOfSignals
from orchestrator.diagnosis.linear.collinearity import collinear_effects
from orchestrator.diagnosis.linear.input_noise import carries_noise, explained_by_noise
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.linear.tangent import Tangent
from orchestrator.diagnosis.linear.thresholds import BEYOND_NOISE, MOST_EFFECTS, SIGNIFICANT
from orchestrator.diagnosis.noise.metric import concatenate
from orchestrator.diagnosis.search.first_values import first_values
from orchestrator.diagnosis.search.fitting import Fitter, Progress, Setting
from orchestrator.diagnosis.search.other_paths import leaves_another, other_path
from orchestrator.diagnosis.search.proposals import Proposer
from orchestrator.diagnosis.search.ranges_of_levels import with_ranges_of_levels
from orchestrator.diagnosis.search.tasks import Wanted
from orchestrator.diagnosis.search.thresholds import (
    BEAM,
    BY_RESIDUAL,
    LOST,
    MOST_ROUNDS,
    MOST_WORK,
    OTHER_PATHS,
    ROUGH,
    STILL_PAYS,
    UNITED,
)
from orchestrator.diagnosis.search.trace import Accepted, Trace
from orchestrator.library.cards import Candidate
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.work import Here, Work

__all__ = ["Progress", "Searcher"]


class Searcher:
    """Searches for sets of candidates that explain the learning trials of one model."""

    def __init__(
        self,
        base: Source,
        nominal: SymbolicModel,
        slots: Sequence[str],
        candidates: Sequence[Candidate],
        learning: LearningData,
        workers: int,
        progress: Progress,
        work: Work | None = None,
        noise: NoiseOfSignals | None = None,
        may_cut: bool = False,
    ) -> None:
        self.base, self.nominal, self.slots = base, nominal, tuple(slots)
        self.candidates, self.learning, self.progress = tuple(candidates), learning, progress
        self.trace = Trace(len({c.label for c in candidates}))
        self.noise = noise
        work = Here() if work is None else work
        self.setting = Setting(base, nominal, self.slots, learning, work, workers, progress, self.trace, may_cut)
        self.fitter = Fitter(self.setting)

    def run(self) -> list[Accepted]:
        """Return the path of accepted sets, growing by one effect each; `trace` keeps all that was tried.

        The path is empty if no single effect is worth naming.
        """
        base = self._without_effects()
        self.candidates = with_ranges_of_levels(
            self.candidates, Response(base, [t.smoother for t in self.learning.trials])
        )
        proposer = Proposer(self.setting, self.candidates)
        base = self._path(proposer, base)
        for _ in range(OTHER_PATHS):
            other = self._other_path(base)
            if other is None or self._is_over():
                break
            base = self._path(proposer, other, base)
        return self._nested(base)

    def _path(self, proposer: Proposer, base: Refit, known: Refit | None = None) -> Refit:
        """The last of the sets that grow from one, or the best `known` set if none of them is better."""
        beam, bound, before = [base], base if known is None else known, np.inf
        for _ in range(MOST_ROUNDS):
            stage = self._stage(base, MOST_EFFECTS - len(base.ids))
            if (
                len(base.ids) == MOST_EFFECTS
                or not self._worth_a_search(stage)
                or self._is_over(pays=base.cost < STILL_PAYS * before)
            ):
                break
            found = self._round(proposer, beam, stage)
            best = self._best(found, bound, stage)
            if best is None:
                break
            before, learning, base = base.cost, self.learning, self._in_its_metric(best, stage)
            if self.learning is not learning:
                base = self._kept(self.simplified(base, stage.colour.level**2))
            bound = base
            fitted = {r.labels: r for r in self.trace.refitted}
            others = [fitted.get(r.labels, r) for r in found if r.is_present() and r.labels != base.labels]
            beam = [base, *others][:UNITED]
        return bound

    def _is_over(self, pays: bool = False) -> bool:
        """Whether the fits took so much work that only a path goes on whose last effect `pays`. Not a matter of time: the answer is
        the same on a slow machine."""
        over = sum(self.trace.operations) > MOST_WORK and not pays
        self.trace.was_cut |= over
        return over

    def _other_path(self, base: Refit) -> Refit | None:
        """A set from which another path leads on, if the last set of this one leaves what another effect would."""
        noise = self.test_of(base).colour.level ** 2
        if not base.ids or not leaves_another(self.trace.stages[0].tangent.base, base, noise):
            return None
        tested = {s.tangent.base.labels for s in self.trace.stages}
        found = other_path(base, self.trace.refitted, tested, noise, self.trace.choices)
        if found is None or found.in_disguise is None:
            return None if found is None else found.refit
        return self.fitter.without(found.refit, found.in_disguise)

    def _round(self, proposer: Proposer, beam: Sequence[Refit], stage: Stage) -> list[Refit]:
        """Refit the most promising sets, and those of them without what does not show; the likeliest first."""
        screened = proposer.screened(beam[:BEAM])
        self.trace.screened += screened
        lost = not beam[0].ids and self._is_lost(stage)
        chosen = proposer.chosen(screened, stage, beam, len(screened) if lost else BY_RESIDUAL)
        found = self.fitter.refit(*chosen, stage, beam[0].fit.values[beam[0].size :])
        noise = stage.colour.level**2
        found = sorted([*found, *self.fitter.pruned(found)], key=lambda r: half_bic(r, noise, self.trace.choices))
        likeliest = {r.labels: r for r in reversed(found)}
        found = [r for r in found if r is likeliest[r.labels]]
        self.trace.refitted += found
        return found

    def _is_lost(self, stage: Stage) -> bool:
        """Whether free runs of the model as given have so little to do with the record that slopes along them say nothing."""
        tangent, measured = stage.tangent, [t.measured - t.measured.mean(axis=0) for t in self.learning.trials]
        spread = np.linalg.norm(concatenate(self.learning.metrics, measured))
        return float(np.linalg.norm(tangent.recorded_error[: tangent.data_rows])) > LOST * float(spread)

    def _best(self, found: Sequence[Refit], base: Refit, stage: Stage) -> Refit | None:
        """The likeliest set that is better than the tested one, and against which nothing speaks, nor against what it
        is at last: without an effect that it does not need, cogging may be a hardening spring in disguise."""
        noise = stage.colour.level**2
        bound = half_bic(base, noise, self.trace.choices)
        for r in found:
            if half_bic(r, noise, self.trace.choices) >= bound or not r.is_present() or self.trace.objection(r):
                continue
            best = self._kept(self.simplified(r, noise))
            if best.is_present() and not self.trace.objection(best):
                return best
        return None

    def _kept(self, found: Refit) -> Refit:
        """A fitted set, which is in the trace from now on."""
        if not any(found is known for known in self.trace.refitted):
            self.trace.refitted.append(found)
        return found

    def _in_its_metric(self, best: Refit, stage: Stage) -> Refit:
        """The best set, or a rival of it, fitted in the metric of noise as that set carries it, if that is another one.

        Rivals are fitted in it, too. Sets that are too far behind to be rivals keep their distance. A set that leaves much
        more than noise says little of how the machine carries it.
        """
        if self.noise is None or best.cost > BEYOND_NOISE**2:
            return best
        learning = self.noise.carried_by(best, self.learning)
        if learning is self.learning:
            return best
        self.progress(f"fitting in the metric of noise as {' + '.join(best.ids)} carries it")
        noise, choices, refitted = stage.colour.level**2, self.trace.choices, self.trace.refitted
        self.learning = learning
        self.setting = self.fitter.setting = replace(self.setting, learning=learning)
        same = self.fitter.closer(best)
        apart = same.cost - best.cost
        near = near_in_either(best, same, refitted, noise, choices)
        again = self.setting.side_by_side(self.fitter.closer, [refitted[k] for k in near])
        for k, r in enumerate(refitted):
            if r.labels == best.labels:
                refitted[k] = same
            elif k in near:
                refitted[k] = again[near.index(k)]
            else:
                refitted[k] = replace(r, fit=replace(r.fit, cost=r.cost + apart))
        able = [r for r in again if r.is_present() and not r.pressed()]
        return min([same, *able], key=lambda r: half_bic(r, noise, choices))

    def simplified(self, found: Refit, noise: float) -> Refit:
        """A set without the effects that are none: that do not pay, or that take away `noise` (its power) of the inputs."""
        choices = self.trace.choices

        def redundant(smaller: Refit, larger: Refit) -> bool:
            if not carries_noise(self.learning) or smaller.cost - larger.cost >= noise:
                return False
            tangent = Tangent(self.fitter.closer(smaller), self.nominal, self.learning)
            charge = half_bic(larger, 1.0, choices) - half_bic(smaller, 1.0, choices)
            charge -= 0.5 * (larger.fit.misfit - smaller.fit.misfit)
            return explained_by_noise(tangent, larger, noise, charge)

        return self.fitter.simplified(found, lambda r: half_bic(r, noise, choices), redundant)

    def try_collinear(self, best: Refit) -> None:
        """Refit what acts like an effect of a set and was not tried in its place, so that the odds are those of fits.

        So is a simpler effect that its card calls confusable, of which it may be no more than a special case, and a law
        that holds it.
        """
        tried = {r.labels: r for r in sorted(self.trace.refitted, key=lambda r: -r.fit.misfit)}
        alike = [
            (entry.effect, entry.other)
            for entry in collinear_effects(best, self.trace.stages)
            if entry.odds <= DECISIVE
        ]
        wanted = list[Wanted]()
        for effect, other in dict.fromkeys([*alike, *self._simpler(best), *self._larger(best)]):
            others = [c for c in best.effects.candidates if c.label != effect.label]
            twin = can_join(others, other, self.slots)
            known = None if twin is None else tried.get(frozenset(c.label for c in (*others, twin)))
            # A law that holds another one explains no less, and one that it holds may explain as much: or a fit went
            # astray.
            nested = holds(other.card, effect.card) or holds(effect.card, other.card)
            astray = known is not None and nested and known.fit.misfit > best.fit.misfit
            if twin is None or (known is not None and not astray):
                continue
            self.progress(f"refitting {twin.label} in place of {effect.label}")
            chosen = (*others, twin)
            values = [best.values[np.array(best.effects.owners()) == best.effects.candidates.index(c)] for c in others]
            guesses = self._guesses(best, effect, twin)
            stage = next(s for s in reversed(self.trace.stages) if s.tangent.base.labels <= {c.label for c in others})
            first = np.array([*(np.concatenate([*values, row]) for row in guesses), *first_values(stage, chosen)])
            wanted.append(Wanted(chosen, first, best.fit.values[best.size :]))
        found = self.setting.side_by_side(self.fitter.attempt, wanted)
        self.trace.refitted += [r for r in found if r is not None]

    def _guesses(self, best: Refit, effect: Candidate, twin: Candidate) -> list[np.ndarray]:
        """First values of an effect in the place of another one: its card's, or about those of a law that it holds, or what
        it has of a law that holds it."""
        alone = EffectSet(self.base, [twin], self.nominal.signals)
        rows = zip(best.effects.owners(), best.effects.variables, best.values, strict=True)
        own = best.effects.candidates.index(effect)
        known = {v.name.removeprefix(f"{effect.slot}."): float(x) for k, v, x in rows if k == own}
        if holds(twin.card, effect.card):
            return list(starts(alone, known))
        if holds(effect.card, twin.card):
            names = [v.name.removeprefix(f"{twin.slot}.") for v in alone.variables]
            return [np.array([known.get(name, x) for name, x in zip(names, alone.first_guess(), strict=True)])]
        return [alone.first_guess()]

    def _larger(self, best: Refit) -> list[tuple[Candidate, Candidate]]:
        """Effects of a set, each with one at the same site whose law holds its own."""
        pairs = [(effect, other) for effect in best.effects.candidates for other in self.candidates]
        return [(e, other) for e, other in pairs if other.site == e.site and holds(other.card, e.card)]

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

    def test_of(self, found: Refit) -> Stage:
        """The test of what a set leaves, made now if the search did not need it."""
        known = [s for s in self.trace.stages if s.tangent.base.labels == found.labels]
        return known[-1] if known else self._stage(found, MOST_EFFECTS - len(found.ids))

    def without(self, found: Refit, effect: Candidate) -> Refit | None:
        """A set without one of its effects, fitted roughly to the same trials; None if that cannot be."""
        if len(found.ids) > 1:
            return self.fitter.without(found, effect, ROUGH)
        return self._without_effects()

    def _without_effects(self) -> Refit:
        """The model as given, fitted to the trials in the metric that the search goes by now."""
        return fit_nominal(EffectSet(self.base, (), self.nominal.signals), self.nominal, self.learning)

    def _stage(self, base: Refit, further: int) -> Stage:
        """Test a fitted set on what it leaves."""
        self.progress(f"testing what {' + '.join(base.ids) or 'the model'} leaves")
        tangent = Tangent(base, self.nominal, self.learning)
        # Equations that are solved by iteration take too long to run for every candidate; an FMU's fits take longer still.
        first_order = tangent.response.is_formula or extensible(self.base).runs_are_slow
        blocks = tangent.blocks(self.candidates, self.slots, self.setting.side_by_side) if first_order else []
        stages = self.trace.stages
        stage = Stage(tangent, blocks, further, len(stages), stages[0] if stages else None)
        stages.append(stage)
        return stage

    def _nested(self, last: Refit) -> list[Accepted]:
        """The path to the last set, in which each step adds an effect to the one before as far as that was tried.

        The referee may stop at any step, so that none is another law in disguise.
        """
        if not last.ids:
            return []
        nested = [last]
        while len(nested[0].ids) > 1:
            labels = nested[0].labels
            inside = [r for r in self.trace.refitted if len(r.ids) == len(labels) - 1 and r.labels < labels]
            inside = [r for r in inside if not r.pressed()]
            if not inside:
                break
            nested.insert(0, min(inside, key=lambda r: r.half_bic))
        return [Accepted(r, self.trace.p_value(r)) for r in nested]
