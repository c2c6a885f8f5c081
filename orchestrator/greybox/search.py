"""Search for the sets of candidates that explain learning trials best: screened by regression, fitted by likelihood.

Sets are proposed by best subsets about the model as given, then about the best set so far, until nothing better is found.
Each set that was fitted keeps its loss by stretch of the record, which is what decisions compare.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from fmus.errors import ComponentError
from fmus.symbolic.balances import Balance
from fmus.symbolic.system import SymbolicSystem
from orchestrator.elapsed import counting
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.explained import leaves_nothing
from orchestrator.greybox.extended import extend
from orchestrator.greybox.filtering import GreyBox, Trial
from orchestrator.greybox.fit import Fit, Fitter, Noise, Priors, Work
from orchestrator.greybox.periodic import frequency_of_its_own
from orchestrator.greybox.prepare import first_noise
from orchestrator.greybox.proposals import Proposals
from orchestrator.greybox.screen import normal_equations, stretches_of
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.models.threads import on_idle_threads

Progress = Callable[[str], None]
Key = frozenset[tuple[str, str]]
# By what steps are divided, in turn, where candidates leave the range of numbers.
SHORTER = (1, 4, 16)
# So many sets are begun or ended before it is asked whether there is work left.
TOGETHER = 8
Item = TypeVar("Item")
NOTHING: Mapping[str, float] = {}


def key_of(candidates: Sequence[Candidate]) -> Key:
    """Effects and sites of a set, whatever the grid variants."""
    return frozenset(c.family for c in candidates)


@dataclass(frozen=True, eq=False)
class FittedSet:
    """A set of candidates with its fit, and the number of parameters of its model that were fitted before."""

    candidates: tuple[Candidate, ...]
    fit: Fit
    before: int = 0

    @property
    def key(self) -> Key:
        """Effects and sites, whatever the grid variants."""
        return key_of(self.candidates)

    @property
    def loss(self) -> float:
        """Minus the log likelihood, with half the logarithm of the number of samples for each parameter (Schwarz 1978)."""
        return self.cost + self.counted * self.price

    @cached_property
    def cost(self) -> float:
        """Minus the log likelihood."""
        return -sum(run.log_likelihood for run in self.fit.runs)

    @cached_property
    def losses(self) -> np.ndarray:
        """Minus log likelihoods by stretch of the record, (ns,)."""
        square = normal_equations(self.fit).square
        return 0.5 * square + _log_variances(self.fit, len(square))

    @property
    def counted(self) -> int:
        """Number of parameters, but for those that only smooth a corner."""
        return self.before + len(self.fit.theta) - sum(p.smooths for c in self.candidates for p in c.fitted_shapes)

    @cached_property
    def price(self) -> float:
        """What a parameter has to bring, in nats."""
        return 0.5 * float(np.log(sum(int(np.count_nonzero(run.variance > 0)) for run in self.fit.runs)))

    @property
    def size(self) -> int:
        """Number of effects."""
        return len(self.candidates)

    @property
    def added(self) -> int:
        """Number of effects that are more than another value of the model's own parameters."""
        return sum(c.id != "parameter_error" for c in self.candidates)

    def value(self, candidate: Candidate, parameter: str) -> tuple[float, float]:
        """Value and standard deviation of a parameter; a deviation of 0 is a held one."""
        if own := [state for state, size in candidate.law.unknown_starts.items() if size == parameter]:
            return self._size([candidate.state_symbol(state) for state in own])
        names = self.fit.box.theta
        symbol = next(candidate.symbol(p) for p in candidate.law.parameters if p.name == parameter)
        if symbol not in names:
            return candidate.shapes[parameter], 0.0
        place = names.index(symbol)
        return float(self.fit.theta[place]), float(self.deviations[place])

    def _size(self, states: Sequence[str]) -> tuple[float, float]:
        """Root mean square over trials of the length of some states at the end, and its standard deviation by trials' scatter."""
        places = [[v.name for v in self.fit.box.system.states].index(name) for name in states]
        squares = np.array([np.sum(run.mean[-1, places] ** 2) for run in self.fit.runs])
        size = float(np.sqrt(squares.mean()))
        spread = float(np.std(np.sqrt(squares), ddof=1) / np.sqrt(len(squares))) if len(squares) > 1 else 0.0
        return size, spread

    def evidence(self, candidate: Candidate) -> float:
        """By how many nats the record would be less probable without an effect, by curvature; without end for one without gains."""
        places = [self.fit.box.theta.index(candidate.symbol(p)) for p in candidate.gains]
        nats = 0.5 * (self.fit.theta[places] / np.maximum(self.deviations[places], 1e-300)) ** 2
        return float(np.sum(nats)) if places else np.inf

    @cached_property
    def deviations(self) -> np.ndarray:
        """Standard deviations of the free parameters by the sandwich over blocks, at least the curvature's."""
        return _deviations(self.fit)


@dataclass(frozen=True, eq=False)
class Setting:
    """What a search works with: the model with balance inputs, learning trials, and inputs that are held between samples."""

    base: SymbolicSystem
    balances: tuple[Balance, ...]
    signals: tuple[str, ...]
    trials: tuple[Trial, ...]
    fitter: Fitter
    thresholds: Thresholds
    held: tuple[str, ...] = ()


class Search:
    """Fits sets of candidates, each once."""

    def __init__(
        self,
        setting: Setting,
        candidates: Sequence[Candidate],
        nominal: FittedSet,
        progress: Progress,
        seen: Callable[[FittedSet], None] = lambda best: None,
    ) -> None:
        """`seen` is called with the best set of the first round, and may stop the search by an exception."""
        self.setting, self.candidates, self.progress, self.seen = setting, tuple(candidates), progress, seen
        self.fitted: dict[Key, FittedSet] = {nominal.key: nominal}
        self.nominal = nominal
        self._extended: set[Key] = set()
        self._fitted_from: set[tuple[Key, Key]] = set()
        self._proposed: tuple[FittedSet, Proposals] | None = None
        self._work: list[list[int]] = []
        self._most_work = setting.thresholds.most_work
        self.was_cut = False

    def run(self) -> list[FittedSet]:
        """All sets that were fitted, best first."""
        limits = self.setting.thresholds
        self._try(self._proposals(self.nominal).more(limits.largest_set), limits.shortlist)
        self._try_wrong_together(self.nominal)
        for number in range(limits.rounds):
            best = self.best
            self.progress(f"best so far: {', '.join(c.label for c in best.candidates) or 'nothing missing'}")
            if number == 0:
                self.seen(best)
            self._try_without(best)
            self._try_fewer(best)
            if leaves_nothing(self.setting.fitter, self.best.fit, limits.quiet):
                self._try_alike(self.best)
                break
            self._try_whole(best)
            for one in sorted(self.fitted.values(), key=lambda s: s.loss)[: limits.extended]:
                self._extend(one)
            if self.best is best:
                self._try_alike(best)
                if self.best is best:
                    break
            if self._is_over():
                break
        return self.sets

    def _is_over(self) -> bool:
        """Whether the runs so far took all the work that a search may take. Not a matter of time: the answer is the same on a slow
        machine."""
        over = sum(map(sum, self._work)) > self._most_work
        self.was_cut |= over
        return over

    def _extend(self, one: FittedSet) -> None:
        """Fit sets with one effect more."""
        limits = self.setting.thresholds
        if one.added < limits.most_effects and one.key not in self._extended:
            self._extended.add(one.key)
            self._try(self._proposals(one).more(1), limits.additions)
            self._try_wrong_together(one)
            self._try_periodic(one)

    @property
    def sets(self) -> list[FittedSet]:
        """All sets that were fitted so far, best first."""
        return sorted(self.fitted.values(), key=lambda s: s.loss)

    def widen(self, candidates: Sequence[Candidate], chosen: FittedSet) -> list[FittedSet]:
        """Search on among more candidates, beside the set that was `chosen` first and beside all parameters wrong; what was fitted
        stays. It may take as much work as the first search."""
        self.candidates, self._extended, self._proposed = tuple(candidates), set(), None
        self._most_work = sum(map(sum, self._work)) + self.setting.thresholds.most_work
        self._extend(chosen)
        self._try_whole(chosen)
        together = wrong_together(self.candidates, self.setting.thresholds.most_parameters)
        if (calibrated := self.fitted.get(key_of(together))) is not None:
            self._extend(calibrated)
        return self.run()

    def fit_larger(self, chosen: FittedSet) -> bool:
        """Fit sets again that hold a set which was fitted anew, and are less probable than it now, which they cannot be.

        They ended elsewhere, so the best of them begin at its values. False if there are none.
        """
        limits = self.setting.thresholds
        most = chosen.cost + limits.nats
        behind = [s for s in self.sets if chosen.key < s.key and s.cost > most][: limits.shortlist]
        for one in behind:
            more = tuple(c for c in one.candidates if c.family not in chosen.key)
            self._fit_again((*chosen.candidates, *more), chosen)
        return bool(behind)

    @property
    def best(self) -> FittedSet:
        """The set with the least cross-validated loss."""
        return min(self.fitted.values(), key=lambda s: s.loss)

    def _proposals(self, about: FittedSet) -> Proposals:
        """What linear regression about a fitted set proposes.

        Laws with states of their own may be too fast for steps as long as the samples; steps become shorter then, and at last
        these laws are left out.
        """
        if self._proposed is None or self._proposed[0] is not about:
            self._proposed = about, self._by_regression(about)
        return self._proposed[1]

    def _by_regression(self, about: FittedSet) -> Proposals:
        for shorter in SHORTER:
            try:
                return self._linear(about, self.candidates, shorter)
            except ComponentError as error:
                failed = error
        self.progress(f"laws with states of their own are left out: {failed}")
        return self._linear(about, [c for c in self.candidates if not c.law.states], 1)

    def _linear(self, about: FittedSet, offered: Sequence[Candidate], shorter: int) -> Proposals:
        mine = about.candidates
        others = [c for c in offered if c.gains and all(c.is_apart_from(own) for own in mine)]
        columns = [(c, p) for c in (*mine, *others) for p in c.gains]
        names = [c.symbol(p) for c, p in columns]
        box = _box(self.setting, (*mine, *others), names, self.setting.held)
        known = about.fit.values
        theta = np.array([known.get(name, 0.0) for name in names])
        endless = np.full(len(names), np.inf)
        priors = Priors(theta, endless, -endless, endless)
        # Shapes that were fitted hold for the members of the set.
        shaped = [c.symbol(p) for c in mine for p in c.fitted_shapes]
        box.compiled.parameters[[box_index(box, s) for s in shaped]] = [known[s] for s in shaped]
        work = Work(box, [t.in_steps(shorter * t.parts) for t in about.fit.trials], priors)
        runs = work.runs(theta, about.fit.noise, slopes=True)
        linear = replace(about.fit, box=box, theta=theta, priors=priors, runs=tuple(runs))
        limits = (c.limits(p) for c, p in columns)
        return Proposals(
            mine,
            normal_equations(linear),
            tuple(c for c, _ in columns),
            theta,
            tuple(int(low == 0.0) - int(high == 0.0) for low, high in limits),
            tuple(c.spread(p) for c, p in columns),
            self.setting.thresholds.hopeless,
        )

    def _try(self, sets: Sequence[tuple[Candidate, ...]], count: int) -> None:
        """Fit the first few sets that are new, among all and among those of forces alone.

        A wrong gain of a sensor or a wrong parameter stands for nearly anything near the first values of a model that is far
        off, and hid the friction of a joint.
        """
        fresh: dict[Key, tuple[Candidate, ...]] = {}
        for candidates in sets:
            key = key_of(candidates)
            if key not in self.fitted:
                fresh.setdefault(key, candidates)
        everything = list(fresh.values())
        forces = [c for c in everything if all(own.place.adds for own in c)]
        self._fit_all([*self._first(everything, count), *self._first(forces, count)])

    def _first(self, sets: Sequence[tuple[Candidate, ...]], count: int) -> list[tuple[Candidate, ...]]:
        """The first few, with the best of each size among them: a law that is far from a line at zero ranks low by regression,
        and single effects are few."""
        chosen = list(sets[:count])
        for size in {len(c) for c in sets}:
            most = self.setting.thresholds.singles if size == 1 else 2
            chosen += [c for c in sets if len(c) == size][:most]
        return chosen

    def _try_without(self, best: FittedSet) -> None:
        """Fit every subset of a set that may be likelier, so that each member has to earn its place."""
        hopeless = self.setting.thresholds.hopeless
        self._fit_all(
            [
                (*best.candidates[:k], *best.candidates[k + 1 :])
                for k, own in enumerate(best.candidates)
                if best.evidence(own) <= hopeless + best.price * len(own.gains)
            ]
        )

    def _try_fewer(self, best: FittedSet) -> None:
        """Fit sets of fewer parameters that explain as much by regression about the best one, whose members may all be left out.

        Members that came one after the other may stand for one that was not looked at when the first of them came.
        """
        limits = self.setting.thresholds
        if best.candidates:
            largest = min(limits.largest_set, best.size)
            found = [each for each in self._proposals(best).anew(largest) if _parameters(each) < best.counted]
            self._try(found, limits.additions)

    def _try_wrong_together(self, about: FittedSet) -> None:
        """Fit a set with all parameters of the model as wrong."""
        together = wrong_together(self.candidates, self.setting.thresholds.most_parameters)
        if len(together) > 1:
            self._fit((*(c for c in about.candidates if c.id != "parameter_error"), *together))

    def _try_periodic(self, about: FittedSet) -> None:
        """Fit a set with a periodic force beside it where what disturbs a balance has a frequency of its own."""
        for candidate in (c for c in self.candidates if c.law.unknown_starts and c.family not in about.key):
            assert candidate.place.balance is not None
            by_chance = self.setting.thresholds.by_chance
            if hertz := frequency_of_its_own(about.fit, candidate.place.balance.state, by_chance):
                self._fit((*about.candidates, candidate.begun_with({"frequency": hertz})))

    def _try_whole(self, about: FittedSet) -> None:
        """Fit a set with each law that acts in some share beside it, from the whole of it: regression about none of it may not see it."""
        if about.added >= self.setting.thresholds.most_effects:
            return
        in_shares = {c.family: c for c in self.candidates if c.shares}.values()
        beside = [c for c in in_shares if all(c.is_apart_from(own) for own in about.candidates)]
        self._fit_all([(*about.candidates, c.begun_with(c.shares)) for c in beside])

    def _try_alike(self, best: FittedSet) -> None:
        """Fit sets in which a law gives way to one elsewhere that does the same to a linear plant, from the values that were found.

        All such places together are tried, too: sensors of one kind are late alike.
        """
        for k, own in enumerate(best.candidates):
            others = tuple(c for j, c in enumerate(best.candidates) if j != k)
            found = own.begun_with({p.name: best.value(own, p.name)[0] for p in own.law.parameters})
            alike = {c.family: c for c in self.candidates if c.id in own.law.alike}.values()
            twins = [c.begun_with(found.shapes) for c in alike]
            if twins and others:
                self._fit_again((found,))
            together = [tuple(twins)] if 1 < len(twins) <= self.setting.thresholds.most_effects else []
            for like in [*((twin,) for twin in twins), *together]:
                beside = tuple(c for c in others if all(twin.is_apart_from(c) for twin in like))
                self._fit_again(like)
                if beside:
                    self._fit_again((*beside, *like))

    def fit(self, candidates: tuple[Candidate, ...], about: FittedSet | None = None) -> FittedSet | None:
        """The set with these candidates, fitted, from the values of the set `about` too if there is one; None if that fails."""
        self._fit(candidates, asked=True)
        if (left := self.fitted.get(key_of(candidates))) is not None and not left.fit.ended:
            with suppress(ComponentError, np.linalg.LinAlgError):
                self.fitted[left.key] = FittedSet(left.candidates, self.setting.fitter.end(left.fit))
        if about is not None and (pair := (key_of(candidates), about.key)) not in self._fitted_from:
            self._fitted_from.add(pair)
            self._fit_again(candidates, about)
        return self.fitted.get(key_of(candidates))

    def simpler(self, candidate: Candidate) -> list[Candidate]:
        """Laws at the same place that a law becomes at a limit of its parameters."""
        same = [c for c in self.candidates if c.place.site == candidate.place.site and c.name in candidate.law.contains]
        return list({c.id: c for c in same}.values())

    def _fit_again(self, candidates: tuple[Candidate, ...], about: FittedSet | None = None) -> None:
        """Fit a set from the values of another one, or from none and noise of its own; the likelier fit stays."""
        for found in self._begun(candidates, about):
            self._work.append(found.fit.box.work)
            self._keep(self._ended(lambda words: None, self.best, found))

    def _fit_all(self, sets: Sequence[tuple[Candidate, ...]], *, asked: bool = False) -> None:
        """Fit new sets, those of one size side by side: larger ones begin at the values of smaller ones.

        All begin before the first one is ended, so that each is ended only as far as it may still reach the likeliest. Unless the
        decision has `asked` for them, they are left once the search has taken its work.
        """
        fresh = {key: each for each in sets if (key := key_of(each)) not in self.fitted}
        trying = counting(self.progress, "trying", len(fresh))
        started: list[FittedSet] = []
        for size in sorted({len(each) for each in fresh.values()}):
            same = [each for each in fresh.values() if len(each) == size]
            for some in self._while_work_is_left(same, asked):
                for found in on_idle_threads(partial(self._begun_from_nearest, trying), some):
                    started += found
                    self._work += [each.fit.box.work for each in found]
                    self._keep(found)
        end = partial(self._ended, counting(self.progress, "fitting", len(started)), self.best)
        for begun_sets in self._while_work_is_left(started, asked):
            for found in on_idle_threads(end, begun_sets):
                self._keep(found)

    def _while_work_is_left(self, items: Sequence[Item], asked: bool) -> Iterator[Sequence[Item]]:
        """A few at a time, as many whatever the number of workers; all of them if they are asked for."""
        for first in range(0, len(items), TOGETHER):
            if not asked and self._is_over():
                return
            yield items[first : first + TOGETHER]

    def _keep(self, found: Sequence[FittedSet]) -> None:
        """Sets that are likelier than what was fitted before in their place."""
        for each in found:
            known = self.fitted.get(each.key)
            if known is None or each.loss <= known.loss:
                self.fitted[each.key] = each

    def _fit(self, candidates: tuple[Candidate, ...], *, asked: bool = False) -> None:
        self._fit_all([candidates], asked=asked)

    def _begun_from_nearest(self, trying: Callable[[str], None], candidates: tuple[Candidate, ...]) -> list[FittedSet]:
        trying(_in_words(candidates))
        return self._begun(candidates, self._nearest(key_of(candidates)))

    def _begun(self, candidates: tuple[Candidate, ...], about: FittedSet | None) -> list[FittedSet]:
        """A set with values to go on from, from each of its starts; none if all fail."""
        noise, known = (None, NOTHING) if about is None else (about.fit.noise, about.fit.values)
        return [found for found in begun(self.setting, candidates, noise, known) if _is_possible(found)]

    def _ended(self, ending: Callable[[str], None], best: FittedSet, found: FittedSet) -> list[FittedSet]:
        """A set that has begun, ended or left far behind the best one; none if that fails."""
        ending(_in_words(found.candidates))
        rival = best.loss - found.counted * best.price
        with suppress(ComponentError, np.linalg.LinAlgError):
            found = FittedSet(found.candidates, self.setting.fitter.end(found.fit, rival))
            return [found] if _is_possible(found) else []
        return []

    def _nearest(self, key: Key) -> FittedSet:
        """The likeliest set that a new one contains: it knows best how noisy the sensors are."""
        return min((s for own, s in self.fitted.items() if own < key), key=lambda s: s.loss)


def _in_words(candidates: Sequence[Candidate]) -> str:
    """What is tried, short enough for a line."""
    sites: dict[str, list[str]] = {}
    for candidate in candidates:
        sites.setdefault(candidate.id, []).append(candidate.place.site)
    parts = [f"{id} at {' and '.join(own) if len(own) < 3 else f'{len(own)} places'}" for id, own in sites.items()]
    return " and ".join(parts) or "the model as it is"


def _is_possible(found: FittedSet) -> bool:
    """Whether a fit is one at all, and what begins at some position begins in the record."""
    return bool(np.isfinite(found.loss)) and all(_within(found, c) for c in found.candidates)


def _within(found: FittedSet, candidate: Candidate) -> bool:
    """Whether what begins at some position begins within the range of the record: beyond it, the law is a simpler one."""
    centre, half = candidate.place.range
    centres = [p.name for p in candidate.fitted_shapes if p.kind.startswith("centre")]
    return all(abs(found.value(candidate, name)[0] - centre) < half for name in centres)


def wrong_together(candidates: Sequence[Candidate], most: int) -> tuple[Candidate, ...]:
    """All parameters of a model as wrong at once, empty if they are more than `most`.

    Data sheets err by a few percent in everything, and no two or three wrong parameters stand for that; a sensor with a wrong
    gain and an output with a memory did.
    """
    wrong = {c.place.site: c for c in candidates if c.id == "parameter_error"}
    return tuple(wrong.values()) if len(wrong) <= most else ()


def box_index(box: GreyBox, name: str) -> int:
    """Place of a parameter among all of a system."""
    return [v.name for v in box.system.parameters].index(name)


def fit_set(
    setting: Setting,
    candidates: Sequence[Candidate],
    noise: Sequence[Noise] | None,
    known: Mapping[str, float] = NOTHING,
    rival: float = np.inf,
) -> FittedSet:
    """Fit a set: gains from zero or what they begin with, shapes from their grid.

    Laws that act in some share are fitted from none, about which regression screens them, and from the whole; the likelier is kept.

    Args:
        noise: what the fit begins with, of each trial; None for what is likeliest with the first values.
        known: values that some parameters begin with, by their names in the extended system.
        rival: minus the log likelihood of another set; a fit that promises to stay far behind it is left.

    Raises:
        ComponentError: if the model fails from the first values on.
    """
    found: list[FittedSet] = []
    for each in begun(setting, candidates, noise, known):
        with suppress(ComponentError, np.linalg.LinAlgError):
            found.append(FittedSet(each.candidates, setting.fitter.end(each.fit, rival)))
    if not found:
        raise ComponentError(f"{setting.base.name} fails with {_in_words(candidates)}")
    return min(found, key=lambda each: each.loss if np.isfinite(each.loss) else np.inf)


def begun(
    setting: Setting,
    candidates: Sequence[Candidate],
    noise: Sequence[Noise] | None,
    known: Mapping[str, float] = NOTHING,
) -> list[FittedSet]:
    """Sets with values to go on from, of each start that does not fail; arguments as of `fit_set`."""
    starts = [tuple(candidates)]
    if any(c.shares.keys() - c.shapes.keys() for c in candidates):
        starts.append(tuple(c.begun_with({**c.shares, **c.shapes}) for c in candidates))
    found = []
    for each in starts:
        with suppress(ComponentError, np.linalg.LinAlgError):
            found.append(_begun_from(setting, each, noise, known))
    return found


def _begun_from(
    setting: Setting,
    everyone: tuple[Candidate, ...],
    noise: Sequence[Noise] | None,
    known: Mapping[str, float],
) -> FittedSet:
    free = [(c, p) for c in everyone for p in (*c.gains, *c.fitted_shapes)]
    names = [c.symbol(p) for c, p in free]
    box = _box(setting, everyone, names, setting.held)
    start = np.array([c.shapes.get(p.name, 0.0) for c, p in free])
    spread = np.array([c.spread(p) for c, p in free])
    low, high = np.array([c.limits(p) for c, p in free]).reshape(-1, 2).T
    smooths, tails = np.array([(p.smooths, p.prior > 0) for _, p in free], dtype=bool).reshape(-1, 2).T
    priors = Priors(start, spread, low, high, smooths, tails)
    first = np.array([known.get(name, value) for name, value in zip(names, start, strict=True)])
    if noise is None:
        noise = [first_noise(box, [trial], setting.balances, first) for trial in setting.trials]
    held = np.array([not p.gain for _, p in free], dtype=bool)
    if held.any():  # gains first, since a shape does nothing while its gain is zero
        fixed = 1e-9 * np.where(priors.by_logs, 1.0, np.maximum(np.abs(first), 1e-9))
        tight = replace(priors, mean=first, std=np.where(held, fixed, spread))
        first = setting.fitter.begin(box, first, tight, noise).theta
    return FittedSet(everyone, setting.fitter.begin(box, first, priors, noise))


def refitted(setting: Setting, found: FittedSet, held: Sequence[str]) -> FittedSet:
    """A set fitted again from the values that were found: in another setting, or with other inputs held between samples.

    Args:
        setting: the trials and thresholds.
        found: a fitted set.
        held: names of the inputs that are held between samples.

    Raises:
        ComponentError: if the model fails from these values on.
    """
    fit = found.fit
    box = _box(setting, found.candidates, fit.box.theta, held)
    return FittedSet(found.candidates, setting.fitter.fit(box, fit.theta, fit.priors, fit.noise))


def _box(setting: Setting, candidates: Sequence[Candidate], theta: Sequence[str], held: Sequence[str]) -> GreyBox:
    extended = extend(setting.base, setting.balances, setting.signals, candidates)
    starts = extended.begin, extended.unsure
    return GreyBox(extended.system, extended.outputs, extended.balances, theta, held, *starts)


def _parameters(candidates: Sequence[Candidate]) -> int:
    """Number of parameters that count, as in `FittedSet.counted`."""
    return sum(len(c.gains) + sum(not p.smooths for p in c.fitted_shapes) for c in candidates)


def _log_variances(fit: Fit, count: int) -> np.ndarray:
    blocks = stretches_of([len(t.time) for t in fit.trials])
    found = np.zeros(count)
    for (_, _, logs), block in zip(fit.whitened(), blocks, strict=True):
        np.add.at(found, block, logs.sum(axis=1))
    return found


def _deviations(fit: Fit) -> np.ndarray:
    m = len(fit.theta)
    if not m:
        return np.zeros(0)
    normal = normal_equations(fit)
    whole = normal.matrix.sum(axis=0) + np.diag(fit.priors.weights(fit.theta) / fit.priors.slopes(fit.theta) ** 2)
    scale = np.sqrt(np.maximum(np.diag(whole), 1e-300))
    inverse = np.linalg.pinv(whole / scale[:, None] / scale, rcond=1e-10) / scale[:, None] / scale
    blocks = len(normal.square)
    spread = normal.vector - normal.vector.mean(axis=0)
    middle = spread.T @ spread * blocks / max(blocks - m, 1)
    sandwich = inverse @ middle @ inverse
    return np.sqrt(np.maximum(np.diag(sandwich), np.diag(inverse)))
