"""Find formulas of a missing force where no card of the library fits: proposed by regression, fitted and judged like effects.

At each balance the vocabulary's terms and their sums are searched on the whitened innovations; the best few are fitted by the
likelihood that judges effects of the library, and nothing is proposed that does not beat the model without it beyond doubt.
"""

import math
import re
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.errors import ComponentError
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.decide import Judge
from orchestrator.greybox.diagnose import Outcome
from orchestrator.greybox.evidence import all_candidates
from orchestrator.greybox.laws import laws
from orchestrator.greybox.search import FittedSet, begun, fit_set, wrong_together
from orchestrator.laws.regression import BeamSearch, all_columns, finer_columns, table_of
from orchestrator.laws.response import responses
from orchestrator.laws.terms import Term, joined, law_of, modulators_of_several, terms_at, with_other_held
from orchestrator.laws.vocabulary import factors
from orchestrator.laws.wide_places import further_of, wide_places

# Grids of shapes become finer by these steps, in doublings.
ZOOM = (0.5, 0.25)

# Fits are equally likely within this, in nats.
TIE = 0.5

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Limits:
    """Limits of the search: so many `fitted` sums of one, two and three terms are fitted,
    unless `seconds` of the processor are over, the best `ended` of them to the end; up to `shown` laws are proposed.

    A law is proposed if it takes away `explained` of the missing force's power and improves predictions by `improvement`. The
    price of having looked at many formulas is the logarithm of their number, in nats, for each term.
    """

    fitted: tuple[int, ...] = (4, 4, 2)
    ended: int = 2
    seconds: float = 60.0
    shown: int = 4
    explained: float = 0.2
    improvement: float = 0.1


@dataclass(frozen=True, eq=False)
class Guess:
    """A sum of terms at a place, with its score by regression."""

    terms: tuple[Term, ...]
    candidate: Candidate
    score: float


@dataclass(frozen=True, eq=False)
class FoundLaw:
    """A fitted law: its terms, its candidate, the set with it, and the library's effects `beside` it in that set."""

    terms: tuple[Term, ...]
    candidate: Candidate
    fitted: FittedSet
    beside: tuple[Candidate, ...]

    @property
    def constants(self) -> int:
        """Number of fitted constants, of effects beside it, too."""
        return len(self.fitted.fit.theta)

    @property
    def names(self) -> set[str]:
        """Its terms, by name."""
        return {term.id for term in self.terms}

    def extends(self, other: "FoundLaw") -> bool:
        """Whether it has all that another law has, be it with a moment or a time in it that says when."""
        same = self.candidate.place.site == other.candidate.place.site
        timed = [term for term in self.terms if term.modulator in factors("by_time") and term.modulator.shapes]
        names = self.names | {replace(term, modulator=None).id for term in timed}
        return same and {c.family for c in self.beside} >= {c.family for c in other.beside} and names >= other.names


def find_laws(
    outcome: Outcome,
    limits: Limits | None = None,
    progress: Progress = lambda message: None,
    *,
    named: bool = True,
) -> tuple[FoundLaw, ...]:
    """Laws that explain what the library leaves, the one to be shown first first; none where nothing is beyond doubt.

    They are looked for in place of the library's best set and, if that set is `named`, beside it.

    Args:
        outcome: the search for effects of the library.
        limits: limits of this search, `Limits()` by default.
        progress: called with one line at each place.
        named: whether the library's best set was named.
    """
    limits = limits or Limits()
    began = time.process_time()
    best = outcome.decision.chosen
    abouts = [outcome.nominal, *([best] if best.candidates and named else [])]
    found: list[FoundLaw] = []
    looked_at = 0
    with threadpool_limits(limits=1, user_api="blas"), np.errstate(all="ignore"):
        for k, about in enumerate(abouts):
            until = began + limits.seconds * (k + 1) / len(abouts)
            guesses, count = guessed(outcome, about, progress)
            found += _fitted(outcome, about, guesses, limits, until, progress)
            if about.candidates:  # what is seen from near the record may be all that is missing
                alone = replace(limits, fitted=limits.fitted[:1])
                found += _fitted(outcome, outcome.nominal, guesses, alone, until, progress)
            looked_at += count
        return _judged(outcome, abouts, found, looked_at, limits, progress)


def guessed(outcome: Outcome, about: FittedSet, progress: Progress) -> tuple[list[Guess], int]:
    """Sums of terms at all balances, best first, and the number of terms that were looked at.

    Args:
        outcome: the search for effects of the library.
        about: the fitted set whose innovations are explained.
        progress: called with one line at each place.
    """
    found: list[Guess] = []
    looked_at = 0
    for place in wide_places(outcome.case, about.fit):
        progress(f"searching for a formula of what acts at {place.site}")
        terms = terms_at(place, further_of(place))
        answers = responses(about.fit, place)
        table = table_of(about.fit, answers, all_columns(terms, place))
        looked_at += len(table.columns)
        sums = BeamSearch(table).run()
        for reach in ZOOM:
            table = table_of(about.fit, answers, finer_columns(table, sums, reach))
            sums = BeamSearch(table).run()
        for each in sums:
            parts = [(table.columns[c].term, table.columns[c].candidate) for c in each.columns]
            found.append(Guess(tuple(term for term, _ in parts), joined(parts, place), each.score))
    return sorted(found, key=lambda guess: -guess.score), looked_at


def _fitted(
    outcome: Outcome, about: FittedSet, guesses: Sequence[Guess], limits: Limits, until: float, progress: Progress
) -> list[FoundLaw]:
    """The best guesses of each size, fitted roughly while there is time."""
    chosen = [g for k, count in enumerate(limits.fitted, 1) for g in [g for g in guesses if len(g.terms) == k][:count]]
    found: list[FoundLaw] = []
    for guess in sorted(chosen, key=lambda g: -g.score):
        if guess.score < 0 or (found and time.process_time() > until):
            continue
        law = guess.candidate.law
        progress(f"fitting {law.written or law.expression} at {guess.candidate.place.site}")
        beside = about.candidates
        starts = begun(outcome.setting, (*beside, guess.candidate), about.fit.noise)
        if rough := [each for each in starts if np.isfinite(each.loss)]:
            likelier = min(rough, key=lambda each: each.loss)
            found.append(FoundLaw(guess.terms, guess.candidate, likelier, beside))
    return found


def _judged(
    outcome: Outcome,
    abouts: Sequence[FittedSet],
    found: Sequence[FoundLaw],
    looked_at: int,
    limits: Limits,
    progress: Progress,
) -> tuple[FoundLaw, ...]:
    """Laws beyond doubt: the simplest that nothing beats first, then those that explain the record as well."""
    own = outcome.setting.thresholds
    dear = replace(own, nats=own.nats + float(np.log(max(looked_at, 1))))
    progress("judging formulas")
    # A formula has to beat other values of the model's own parameters, too.
    given = [*abouts, *_with_other_values(outcome, abouts)]
    judges = [Judge(about, dear, outcome.scale, outcome.decision.windows) for about in given]
    promising = _promising(found, limits)
    promising += _with_less_beside(outcome, promising)
    promising += [one for law in promising for one in _with_shared_constants(outcome, law)]
    ended = _foretelling([_to_the_end(outcome, law) for law in promising], judges[0])
    ranked = sorted(ended, key=lambda law: law.fitted.loss)
    if not ranked:
        return ()
    alike = [law for law in ranked if law is ranked[0] or not judges[0].beyond_doubt(ranked[0].fitted, law.fitted)]
    first, *others = sorted(alike, key=lambda law: (law.constants, len(law.beside), law.fitted.loss))
    others = [law for law in others if not law.extends(first)]
    known = {law.id for law in laws()}
    if all(term.library in known for term in first.terms):
        return ()  # the library has such laws, and its own search has judged them
    if all(_better(first, judge, limits) for judge in judges):
        return (first, *others[: limits.shown - 1])
    return ()


def _with_other_values(outcome: Outcome, abouts: Sequence[FittedSet]) -> list[FittedSet]:
    """The same sets with all parameters of the model as wrong beside them, each by a few percent."""
    wrong = wrong_together(all_candidates(outcome.case, outcome.nominal), outcome.setting.thresholds.most_parameters)
    found = []
    for about in abouts:
        beside = [c for c in wrong if all(c.is_apart_from(own) for own in about.candidates)]
        if beside:
            try:
                found.append(fit_set(outcome.setting, (*about.candidates, *beside), about.fit.noise))
            except (ComponentError, np.linalg.LinAlgError):
                continue
    return found


def _promising(found: Sequence[FoundLaw], limits: Limits) -> list[FoundLaw]:
    """The likeliest of each number of constants, beside effects of the library and without them: rough fits are compared with
    their like only."""
    ranked = sorted(found, key=lambda law: law.fitted.loss)
    groups: dict[tuple[bool, int], list[FoundLaw]] = {}
    for law in ranked:
        groups.setdefault((bool(law.beside), law.constants), []).append(law)
    return [law for group in groups.values() for law in group[: limits.ended]]


def _with_less_beside(outcome: Outcome, promising: Sequence[FoundLaw]) -> list[FoundLaw]:
    """The likeliest law beside effects of the library without each of them, and without all: they may have stood for the law."""
    helped = [law for law in promising if law.beside]
    if not helped:
        return []
    law = min(helped, key=lambda each: each.fitted.loss)
    own = law.candidate
    values = {p.name: law.fitted.value(own, p.name)[0] for p in (*own.gains, *own.fitted_shapes)}
    without_one = [tuple(c for c in law.beside if c is not left) for left in law.beside]
    found = []
    for beside in [(), *(each for each in without_one if each)]:
        with suppress(ComponentError, np.linalg.LinAlgError):
            fitted = fit_set(outcome.setting, (*beside, own.begun_with(values)), law.fitted.fit.noise)
            found.append(replace(law, candidate=fitted.candidates[-1], fitted=fitted, beside=beside))
    return [each for each in found if np.isfinite(each.fitted.loss)]


def _with_shared_constants(outcome: Outcome, law: FoundLaw) -> list[FoundLaw]:
    """A law whose terms have a modulator in common with the same constants in each, such as one time of fading for two losses."""
    if not modulators_of_several(law.terms):
        return []
    own, place = law.candidate, law.candidate.place
    shared = law_of(law.terms, place, shared=True)
    values = {p.name: law.fitted.value(own, p.name)[0] for p in own.law.parameters}
    first = {re.sub(r"\d+$", "", name): value for name, value in reversed(values.items())}
    candidate = Candidate(
        shared, place, {p.name: values.get(p.name) or first[p.name] for p in shared.parameters if not p.gain}
    )
    try:
        fitted = fit_set(outcome.setting, (*law.beside, candidate), law.fitted.fit.noise)
    except (ComponentError, np.linalg.LinAlgError):
        return []
    return [replace(law, candidate=fitted.candidates[-1], fitted=fitted)] if np.isfinite(fitted.loss) else []


def _foretelling(found: Sequence[FoundLaw], judge: Judge) -> list[FoundLaw]:
    """Laws but for those that a law with fewer constants outdoes in predictions."""
    worse = 1 + judge.limits.worse
    errors = [judge.error(law.fitted) for law in found]

    def outdone(law: FoundLaw, error: float) -> bool:
        pairs = zip(found, errors, strict=True)
        return any(other.constants < law.constants and error > worse * least for other, least in pairs)

    return [law for law, error in zip(found, errors, strict=True) if not outdone(law, error)]


def _better(law: FoundLaw, judge: Judge, limits: Limits) -> bool:
    """Whether a law makes the record more probable beyond doubt, takes away what is missing, and predicts better, or no worse with
    fewer constants.

    Other values of the model's parameters are beaten by clearly better predictions of fewer constants, too: a loop of filter and
    model that is a little wrong everywhere makes the record probable, and yet does not foretell it.
    """
    about = judge.nominal
    if judge.defeats(law.fitted, about):
        return True
    if not judge.beyond_doubt(law.fitted, about) or judge.explained(law.fitted) < limits.explained:
        return False
    simpler = law.fitted.counted < about.counted
    return judge.best_ratio(law.fitted, about) < (1 + judge.limits.worse if simpler else 1 - limits.improvement)


def _to_the_end(outcome: Outcome, law: FoundLaw) -> FoundLaw:
    """A law whose values are fitted to the end, with the likeliest of each shape that is held.

    How steep dry friction is at rest hardly shows in what regression sees, and in a record without reversals not at all.
    """
    fit, candidate = law.fitted.fit, law.fitted.candidates[-1]
    found = FittedSet(law.fitted.candidates, outcome.setting.fitter.end(fit))
    values = {p.name: found.value(candidate, p.name)[0] for p in (*candidate.gains, *candidate.fitted_shapes)}
    fitted = [found]
    for other in with_other_held(candidate.begun_with(values)):
        with suppress(ComponentError, np.linalg.LinAlgError):
            rival = -max(each.fit.log_likelihood for each in fitted)
            candidates = (*law.fitted.candidates[:-1], other)
            fitted.append(fit_set(outcome.setting, candidates, found.fit.noise, rival=rival))
    least = min(each.loss for each in fitted)
    # Where the record cannot tell, what is sharpest, as dry friction and what happens at a moment are.
    found = min((each for each in fitted if each.loss <= least + TIE), key=_width)
    return replace(law, candidate=found.candidates[-1], fitted=found)


def _width(fitted: FittedSet) -> float:
    """The product of the shapes of a set's law that are held, all of them widths or references."""
    law = fitted.candidates[-1]
    return math.prod(abs(law.shapes[p.name]) for p in law.law.parameters if not (p.gain or p.fitted))
