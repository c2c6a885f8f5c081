"""Fit parameters, process noise and sensor noise together: the likelihood of a stochastic grey box."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag

from fmus.errors import ComponentError
from orchestrator.greybox.filtering import Filtered, GreyBox, InLines, Trial
from orchestrator.models.threads import on_idle_threads

# A step that gains less in log likelihood changes no decision.
ENOUGH = 0.05
# Steps in a sample interval are short enough if halving them changes the log likelihood by no more, or by 1e-4 of it.
CLOSE = 0.3
# Steps at frozen gains, those on the noise, and those on both together, at most.
STEPS, MOST_STEPS = 4, 40
# Steps in an interval are made shorter where that moves a state by more than this share of its standard deviation.
MOVED = 0.01
MOST_STEPS_BETWEEN = 16
# How often a step that leads uphill is made shorter.
SHORTER = 6
# Times that the model is put in lines for the noise.
LOOKS = 3
# Logarithms of noise: differences for slopes, and the longest step.
DIFFERENCE, FARTHEST = 0.05, 2.0
LOG_RANGE = np.log(1e8)
# Forces from which noise is looked for once more, as a share of those that were found: what forces explain, noisy sensors may, too.
CALMER = 0.1
# Differences of parameters for slopes, in standard deviations by curvature.
APART = 0.01
# A fit is left where it lies so many nats behind a rival, and so many times what its next step promises.
FAR_BEHIND, PROMISES = 30.0, 10.0
# Process noise of this share of the first guess is none.
SILENT = 1e-9


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of one trial: intensity of the white force on each balance (nb,), its unit times root second, and std of each
    sensor (ny,). Trials have their own, since what a model leaves out grows with how a trial moves the machine."""

    intensity: np.ndarray
    sensors: np.ndarray

    @property
    def logs(self) -> np.ndarray:
        """Logarithms, forces first."""
        return np.log(np.concatenate([self.intensity, self.sensors]))

    @staticmethod
    def of(logs: np.ndarray, balances: int) -> "Noise":
        """From logarithms."""
        values = np.exp(logs)
        return Noise(values[:balances], values[balances:])


@dataclass(frozen=True, eq=False)
class Priors:
    """Priors and limits of the free parameters, (ntheta,) each; a std of infinity is none.

    Of those `by_logs` steps change the logarithm, which `std` is of, too: half the speed at which friction is smooth is as far as
    twice that, and zero is no value. Priors are normal but for those with `tails`, which have Cauchy's, as curved at the mean: a
    parameter is off by a few percent, or somebody forgot the rotor.
    """

    mean: np.ndarray
    std: np.ndarray
    low: np.ndarray
    high: np.ndarray
    by_logs: np.ndarray = field(default_factory=lambda: np.zeros(1, dtype=bool))
    tails: np.ndarray = field(default_factory=lambda: np.zeros(1, dtype=bool))

    def inner(self, theta: np.ndarray) -> np.ndarray:
        """Values as steps change them."""
        return np.where(self.by_logs, np.log(np.maximum(theta, 1e-300)), theta)

    def outer(self, inner: np.ndarray) -> np.ndarray:
        """The values themselves."""
        return np.where(self.by_logs, np.exp(np.where(self.by_logs, inner, 0.0)), inner)

    def slopes(self, theta: np.ndarray) -> np.ndarray:
        """Of the values, by what steps change."""
        return np.where(self.by_logs, theta, 1.0)

    def cost(self, theta: np.ndarray) -> float:
        """Minus the logarithm of the prior, up to a constant."""
        half = 0.5 * ((self.inner(theta) - self.inner(self.mean)) / self.std) ** 2
        return float(np.sum(np.where(self.tails, np.log1p(half), half)))

    def weights(self, theta: np.ndarray) -> np.ndarray:
        """Precision of the normal priors that have the same gradient here, by what steps change."""
        precise = 1.0 / self.std**2
        half = 0.5 * (self.inner(theta) - self.inner(self.mean)) ** 2 * precise
        return precise / np.where(self.tails, 1.0 + half, 1.0)


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted grey box: the trials with their integration steps, `theta` (ntheta,), `noise` of each trial, the log likelihood
    with priors, and the runs.

    One that is not `ended` was left on the way, far behind a rival.
    """

    box: GreyBox
    trials: tuple[Trial, ...]
    theta: np.ndarray
    noise: tuple[Noise, ...]
    log_likelihood: float
    priors: Priors
    runs: tuple[Filtered, ...]
    ended: bool = True

    @property
    def values(self) -> dict[str, float]:
        """The free parameters by their names in the extended system."""
        return dict(zip(self.box.theta, map(float, self.theta), strict=True))

    def whitened(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Of each trial: whitened innovations (n, ny), their slopes (n, ny, ntheta), half the log variances (n, ny)."""
        found = []
        for run in self.runs:
            seen = run.variance > 0
            std = np.sqrt(np.where(seen, run.variance, 1.0))
            found.append((run.innovation / std, run.slope / std[:, :, None], np.where(seen, np.log(std), 0.0)))
        return found


class Fitter:
    """Fits grey boxes to one set of trials."""

    def __init__(self, trials: Sequence[Trial], start: Sequence[Noise], least_noise: np.ndarray) -> None:
        self.trials, self.start, self.least_noise = tuple(trials), tuple(start), least_noise
        self._enough: tuple[Trial, ...] | None = None

    def fit(self, box: GreyBox, theta: np.ndarray, priors: Priors, noise: Sequence[Noise] | None = None) -> Fit:
        """Fit from first values, as `begin` and then `end` do.

        Raises:
            ComponentError: if the model fails from the first values on.
        """
        return self.end(self.begin(box, theta, priors, noise))

    def begin(self, box: GreyBox, theta: np.ndarray, priors: Priors, noise: Sequence[Noise] | None = None) -> Fit:
        """A fit with values to go on from: a few steps on the parameters, then some on the noise.

        Args:
            box: the model with its effects, filtered along trials.
            theta: first values (k,) of the free parameters.
            priors: their bounds and spreads.
            noise: first values of the noise of each trial, by default those that the fitter was made with.

        Raises:
            ComponentError: if the model fails from the first values on.
        """
        noise = self.start if noise is None else tuple(noise)
        work = Work(box, self._in_steps(box, theta, noise, self._first_steps()), priors)
        theta, value = self._parameters(work, theta, noise, work.value(theta, noise))
        noise, value = self._noise(work, theta, noise, value)
        return work.fit(theta, noise, value, ended=not len(theta))

    def end(self, begun: Fit, rival: float = np.inf) -> Fit:
        """A fit that has begun, ended: parameters and noise together.

        Args:
            begun: values to go on from.
            rival: minus the log likelihood of another model; a fit that promises to stay far behind it is left.

        Raises:
            ComponentError: if the model fails from these values on.
        """
        if not len(begun.theta):
            return begun
        theta, noise, value = begun.theta, begun.noise, -begun.log_likelihood
        work = Work(begun.box, begun.trials, begun.priors)
        if any(t.parts.max() > 1 for t in begun.trials):  # values that were found may do with longer steps
            work = Work(begun.box, self._in_steps(begun.box, theta, noise, self._first_steps()), begun.priors)
            value = work.value(theta, noise)
        while True:
            theta, noise, value, ended = self._together(work, theta, noise, value, rival)
            quieter, reached = self._noise(work, theta, self._of_sensors(work, theta, noise), np.inf)
            if reached < value - ENOUGH:
                theta, noise, value, ended = self._together(work, theta, quieter, reached, rival)
            # Values that were found may ask for shorter steps than the first ones.
            enough = self._in_steps(begun.box, theta, noise, work.trials) if ended else work.trials
            if enough is work.trials:
                return work.fit(theta, noise, value, ended=ended)
            work = Work(begun.box, enough, begun.priors)

    def noise_with(self, box: GreyBox, theta: np.ndarray, priors: Priors) -> Fit:
        """A fit of the noise alone, with parameters as they are.

        Raises:
            ComponentError: if the model fails with these values.
        """
        work = Work(box, self._in_steps(box, theta, self.start, self._first_steps()), priors)
        noise, value = self._noise(work, theta, self.start, work.value(theta, self.start))
        quieter, reached = self._noise(work, theta, self._of_sensors(work, theta, noise), np.inf)
        if reached < value - ENOUGH:
            noise, value = quieter, reached
        return work.fit(theta, noise, value, ended=True)

    def without_disturbance(self, box: GreyBox, fit: Fit) -> tuple[float, float]:
        """Log likelihood of a fit's model if nothing but sensors' noise is left, and by which factor that is larger then.

        The noise is estimated again; the factor is the largest over signals and trials. A model that leaves the finite numbers
        where nothing corrects it explains nothing that way.
        """
        total, louder = -fit.priors.cost(fit.theta), 1.0
        tiny = self.start[0].intensity * SILENT
        for trial, own in zip(fit.trials, fit.noise, strict=True):
            work = Work(box, [trial], fit.priors)
            low = np.concatenate([np.log(tiny), np.log(self.least_noise)])
            high = np.concatenate([np.log(tiny), np.log(self.least_noise) + 2 * LOG_RANGE])
            try:
                starts = (own.sensors, self._rough(box, trial, fit))
            except ComponentError:
                return -np.inf, np.inf
            found = [self._noise_of(work, fit.theta, Noise(tiny, sensors), low, high) for sensors in starts]
            best, value = min(found, key=lambda each: each[1])
            total -= value - fit.priors.cost(fit.theta)
            louder = max(louder, float(np.max(best.sensors / own.sensors)))
        return total, louder

    def _rough(self, box: GreyBox, trial: Trial, fit: Fit) -> np.ndarray:
        """Errors (ny,) of a run that nothing disturbs."""
        run = box.run(trial, fit.theta, self.start[0].intensity * SILENT, self.start[0].sensors)
        return np.maximum(np.sqrt(np.mean(run.innovation**2, axis=0)), self.least_noise)

    def _of_sensors(self, work: "Work", theta: np.ndarray, noise: Sequence[Noise]) -> list[Noise]:
        """Noise in which sensors explain the errors of runs that hardly anything disturbs; that of a trial whose run fails stays."""

        def one(trial: Trial, own: Noise) -> Noise:
            try:
                run = work.box.run(trial, theta, own.intensity * SILENT, own.sensors)
            except ComponentError:
                return own
            errors = np.sqrt(np.nanmean(np.where(run.variance > 0, run.innovation, np.nan) ** 2, axis=0))
            return Noise(own.intensity * CALMER, np.fmax(errors, own.sensors))

        return [one(trial, own) for trial, own in zip(work.trials, noise, strict=True)]

    def _first_steps(self) -> tuple[Trial, ...]:
        """Trials with steps to begin with: what was enough for the first set, the model as given, is a good guess for the others."""
        if self._enough is None:
            return self.trials
        return tuple(t.in_steps(np.maximum(t.parts // 2, 1)) for t in self._enough)

    def _in_steps(
        self, box: GreyBox, theta: np.ndarray, noise: Sequence[Noise], trials: tuple[Trial, ...]
    ) -> tuple[Trial, ...]:
        """Trials with steps at which halving all of them hardly changes the likelihood, shorter ones only where a state asks for
        them: where friction turns, not along the whole record. The same trials if theirs are short enough."""
        priors = Priors(theta, np.full(len(theta), np.inf), theta, theta)
        before = Work(box, trials, priors).value(theta, noise)
        while True:
            after = Work(box, [t.in_steps(2 * t.parts) for t in trials], priors).value(theta, noise)
            if np.isfinite(before) and abs(after - before) < CLOSE + 1e-4 * abs(after):
                break
            shorter = self._in_shorter_steps(box, theta, noise, trials)
            if all(np.array_equal(one.parts, other.parts) for one, other in zip(shorter, trials, strict=True)):
                break
            trials, before = shorter, Work(box, shorter, priors).value(theta, noise)
        self._enough = self._enough or trials
        return trials

    def _in_shorter_steps(
        self, box: GreyBox, theta: np.ndarray, noise: Sequence[Noise], trials: tuple[Trial, ...]
    ) -> tuple[Trial, ...]:
        """Trials with steps of half the length where that moves a state, and beside it; everywhere if it does so nowhere or runs fail."""
        try:
            off = [box.off_by_steps(t, theta, n.intensity, n.sensors) for t, n in zip(trials, noise, strict=True)]
        except ComponentError:
            off = [np.full(len(t.time), np.inf) for t in trials]
        moved = [np.convolve(own > MOVED, np.ones(3), "same") > 0 for own in off]
        everywhere = not any(own.any() for own in moved)
        return tuple(
            t.in_steps(np.minimum(np.where(own | everywhere, 2, 1) * t.parts, MOST_STEPS_BETWEEN))
            for own, t in zip(moved, trials, strict=True)
        )

    def _parameters(
        self, work: "Work", theta: np.ndarray, noise: Sequence[Noise], value: float
    ) -> tuple[np.ndarray, float]:
        """Gauss's and Newton's steps on the whitened innovations, accepted by the likelihood."""
        outer = work.priors.outer
        low, high = work.priors.inner(work.priors.low), work.priors.inner(work.priors.high)
        at = work.priors.inner(theta)
        for _ in range(STEPS if len(theta) else 0):
            gradient, curvature = work.normal(outer(at), noise)
            step = _newton(gradient, curvature, ~_held(at, gradient, low, high))
            before = value
            at, value = _along(lambda at: work.value(outer(at), noise), at, value, step, gradient, low, high)
            if before - value < ENOUGH:
                break
        return outer(at), value

    def _together(
        self, work: "Work", theta: np.ndarray, noise: tuple[Noise, ...], value: float, rival: float
    ) -> tuple[np.ndarray, tuple[Noise, ...], float, bool]:
        """Quasi-Newton's steps on parameters and logarithms of the noise together, which begin with the curvature at frozen gains.

        With much noise the record says little of parameters, and with wrong parameters there is much noise: steps of either in turn
        end far from the best of both. Slopes at frozen gains lack how gains change, which a wrong model's innovations go with, so
        slopes are found by differences (Broyden, Fletcher, Goldfarb, Shanno; damped as by Powell, Nocedal and Wright 2006, 18.3).
        """
        k, nb = len(theta), len(noise[0].intensity)
        size = nb + len(noise[0].sensors)
        lowest = [np.concatenate([own.logs[:nb] - LOG_RANGE, np.log(self.least_noise)]) for own in self.start]
        inner, outer = work.priors.inner, work.priors.outer
        low = np.concatenate([inner(work.priors.low), *lowest])
        high = np.concatenate([inner(work.priors.high), *(own.logs + LOG_RANGE for own in self.start)])

        def parts(at: np.ndarray) -> tuple[np.ndarray, tuple[Noise, ...]]:
            return outer(at[:k]), tuple(Noise.of(logs, nb) for logs in at[k:].reshape(-1, size))

        def objective(at: np.ndarray) -> float:
            return work.value(*parts(at))

        at = np.clip(np.concatenate([inner(theta), *(own.logs for own in noise)]), low, high)
        value = objective(at)
        curvature = np.zeros(0)
        fresh, small, ended = True, 0, True
        last: tuple[np.ndarray, np.ndarray] | None = None
        for _ in range(MOST_STEPS):
            theta, noise = parts(at)
            _, at_frozen_gains = work.normal(theta, noise)
            if fresh:
                curvature, last = block_diag(at_frozen_gains, *work.noise_curvatures(theta, noise)), None
            apart = APART * _widths(np.diag(at_frozen_gains), theta, work.priors)
            gradient = np.concatenate([work.slopes(theta, noise, value, apart), *work.noise_slopes(theta, noise)])
            if last is not None:
                curvature = _updated(curvature, at - last[0], gradient - last[1])
            last, before = (at, gradient), value
            step = _newton(gradient, curvature, ~_held(at, gradient, low, high))
            step *= min(1.0, FARTHEST / max(float(np.abs(step[k:]).max(initial=0.0)), 1e-300))
            promised = -gradient @ step / 2
            ended = value - rival < FAR_BEHIND + PROMISES * promised
            if promised < ENOUGH / 2 or not ended:
                break
            at, value = _along(objective, at, value, step, gradient, low, high)
            gained = before - value
            if gained == 0.0 and fresh:
                break
            fresh, small = gained == 0.0, small + 1 if gained < ENOUGH else 0
            if small > 1 and not fresh:
                break
        return *parts(at), value, ended

    def _noise(
        self, work: "Work", theta: np.ndarray, noise: Sequence[Noise], value: float
    ) -> tuple[tuple[Noise, ...], float]:
        """The noise of each trial, by Newton's steps on its logarithms, each of them limited."""
        price = work.priors.cost(theta)

        def of(each: tuple[Trial, Noise, Noise]) -> tuple[Noise, float]:
            trial, own, start = each
            low, high = start.logs - LOG_RANGE, start.logs + LOG_RANGE
            low[len(start.intensity) :] = np.log(self.least_noise)
            return self._noise_of(Work(work.box, [trial], work.priors), theta, own, low, high)

        found = on_idle_threads(of, list(zip(work.trials, noise, self.start, strict=True)))
        return tuple(best for best, _ in found), price + sum(cost - price for _, cost in found)

    def _noise_of(
        self, work: "Work", theta: np.ndarray, noise: Noise, low: np.ndarray, high: np.ndarray
    ) -> tuple[Noise, float]:
        """The noise of one trial within bounds of its logarithms, in a few looks at the model in lines."""
        nb, at = len(noise.intensity), np.clip(noise.logs, low, high)
        lines = work.in_lines(theta, Noise.of(at, nb))
        value = lines.value(at)
        for _ in range(LOOKS if np.isfinite(value) else 0):
            found = _descended(lines, at, low, high)
            again = work.in_lines(theta, Noise.of(found, nb))
            reached = again.value(found)
            while reached >= value and np.abs(found - at).max() > DIFFERENCE:  # too far for lines
                found = at + (found - at) / 4
                again = work.in_lines(theta, Noise.of(found, nb))
                reached = again.value(found)
            if reached >= value:
                break
            gained, at, value, lines = value - reached, found, reached, again
            if gained < ENOUGH:
                break
        return Noise.of(at, nb), value + work.priors.cost(theta)


def _descended(lines: "Lines", at: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Where Quasi-Newton's limited steps lead within bounds."""
    at = np.clip(at, low, high)
    value, gradient, information = lines.slopes(at)
    curvature, fresh, small = _positive(information), True, 0
    for _ in range(2 * STEPS):
        step = _newton(gradient, curvature, ~_held(at, gradient, low, high))
        step *= min(1.0, FARTHEST / max(float(np.abs(step).max(initial=0.0)), 1e-300))
        if -gradient @ step < ENOUGH:
            break
        before, last, highest = at, gradient, value
        at, value = _along(lines.value, at, value, step, gradient, low, high)
        if value == highest:  # no way down by this curvature
            if fresh:
                break
            curvature, fresh = _positive(information), True
            continue
        small = small + 1 if highest - value < ENOUGH else 0
        if small > 1:
            break
        value, gradient, information = lines.slopes(at)
        curvature, fresh = _updated(curvature, at - before, gradient - last), False
    return at


def _held(at: np.ndarray, gradient: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """What lies at a bound and would leave it."""
    return ((at <= low) & (gradient > 0)) | ((at >= high) & (gradient < 0))


def _newton(gradient: np.ndarray, curvature: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Newton's step along the free directions, each in its own scale."""
    step = np.zeros(len(gradient))
    if free.any():
        scale = np.sqrt(np.maximum(np.diag(curvature)[free], 1e-300))
        values, vectors = np.linalg.eigh(curvature[np.ix_(free, free)] / scale[:, None] / scale)
        step[free] = -vectors @ (vectors.T @ (gradient[free] / scale) / np.maximum(np.abs(values), 1e-6)) / scale
    return step


def _along(
    objective: Callable[[np.ndarray], float],
    at: np.ndarray,
    value: float,
    step: np.ndarray,
    gradient: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Where a step leads within bounds, made shorter until it leads downhill; where it began if it never does."""
    slope, share = float(gradient @ step), 1.0
    for _ in range(SHORTER):
        if not -share * slope >= ENOUGH / 2:
            break
        proposed = np.clip(at + share * step, low, high)
        after = objective(proposed)
        if after < value + 1e-4 * share * slope:
            return proposed, after
        lowest = -slope * share**2 / (2 * (after - value - slope * share)) if np.isfinite(after) else 0.0
        share = float(np.clip(lowest, 0.1 * share, 0.5 * share))
    return at, value


def _widths(curvature: np.ndarray, at: np.ndarray, priors: Priors) -> np.ndarray:
    """Standard deviations by curvature, no wider than priors or, without one, than the values are large."""
    most = np.where(np.isfinite(priors.std), priors.std, np.maximum(np.abs(at), 1e-3))
    return np.minimum(1.0 / np.sqrt(np.maximum(curvature, 1e-300)), most)


def _positive(curvature: np.ndarray) -> np.ndarray:
    """A curvature whose eigenvalues are positive, none of them a thousand times smaller than another."""
    values, vectors = np.linalg.eigh(curvature)
    values = np.maximum(np.abs(values), 1e-3 * np.abs(values).max(initial=0.0) + 1e-9)
    return vectors * values @ vectors.T


def _updated(curvature: np.ndarray, moved: np.ndarray, changed: np.ndarray) -> np.ndarray:
    """The curvature after a step, of which the gradient's change is known; it stays positive."""
    bent = curvature @ moved
    size, along = float(moved @ bent), float(moved @ changed)
    if size <= 0.0:
        return curvature
    share = 1.0 if along >= 0.2 * size else 0.8 * size / (size - along)
    mixed = share * changed + (1 - share) * bent
    return curvature - np.outer(bent, bent) / size + np.outer(mixed, mixed) / (moved @ mixed)


class Work:
    """Values and slopes of the objective of one grey box: minus the log likelihood, with priors."""

    def __init__(self, box: GreyBox, trials: Sequence[Trial], priors: Priors) -> None:
        self.box, self.trials, self.priors = box, tuple(trials), priors

    def fit(self, theta: np.ndarray, noise: Sequence[Noise], value: float, *, ended: bool) -> Fit:
        """What was found, with its runs."""
        runs = self.runs(theta, noise, slopes=True)
        return Fit(self.box, self.trials, theta, tuple(noise), -value, self.priors, tuple(runs), ended)

    def runs(self, theta: np.ndarray, noise: Sequence[Noise], *, slopes: bool = False) -> list[Filtered]:
        def run(each: tuple[Trial, Noise]) -> Filtered:
            trial, own = each
            return self.box.run(trial, theta, own.intensity, own.sensors, slopes=slopes)

        return on_idle_threads(run, list(zip(self.trials, noise, strict=True)))

    def value(self, theta: np.ndarray, noise: Sequence[Noise]) -> float:
        """Infinite where the model fails."""
        try:
            total = -sum(run.log_likelihood for run in self.runs(theta, noise)) + self.priors.cost(theta)
        except ComponentError:
            return np.inf
        return total if np.isfinite(total) else np.inf

    def in_lines(self, theta: np.ndarray, noise: Noise) -> "Lines":
        """The only trial's model in lines about a run with this noise."""
        [trial] = self.trials
        with suppress(ComponentError):
            model = self.box.in_lines(trial, theta, noise.intensity, noise.sensors)
            return Lines(model, len(noise.intensity))
        return Lines(None, len(noise.intensity))

    def normal(self, theta: np.ndarray, noise: Sequence[Noise]) -> tuple[np.ndarray, np.ndarray]:
        """Gradient and Gauss-Newton's curvature at frozen gains, by what steps change."""
        priors, slopes = self.priors, self.priors.slopes(theta)
        weights = priors.weights(theta)
        gradient = (priors.inner(theta) - priors.inner(priors.mean)) * weights
        curvature = np.diag(weights)
        for run in self.runs(theta, noise, slopes=True):
            weight = np.where(run.variance > 0, 1.0 / np.where(run.variance > 0, run.variance, 1.0), 0.0)
            rows = slopes * run.slope.reshape(run.slope.shape[0] * run.slope.shape[1], len(theta))
            weighted = rows * weight.ravel()[:, None]
            gradient = gradient + weighted.T @ run.innovation.ravel()
            curvature = curvature + weighted.T @ rows
        return gradient, curvature

    def slopes(self, theta: np.ndarray, noise: Sequence[Noise], value: float, apart: np.ndarray) -> np.ndarray:
        """Gradient by what steps change (ntheta,), by differences of `apart` from the `value` here; 0 where the model fails."""
        inner, outer = self.priors.inner(theta), self.priors.outer
        signed = np.where(inner + apart <= self.priors.inner(self.priors.high), apart, -apart)
        values = on_idle_threads(lambda more: self.value(outer(inner + more), noise), list(np.diag(signed)))
        found = (np.array(values) - value) / signed
        return np.where(np.isfinite(found), found, 0.0)

    def noise_slopes(self, theta: np.ndarray, noise: Sequence[Noise]) -> list[np.ndarray]:
        """Gradient by the logarithms of each trial's noise."""
        return on_idle_threads(lambda each: self._alone(theta, *each).slopes(each[1].logs)[1], self._each(noise))

    def noise_curvatures(self, theta: np.ndarray, noise: Sequence[Noise]) -> list[np.ndarray]:
        """Curvature by the logarithms of each trial's noise, made positive."""
        return on_idle_threads(lambda each: self._alone(theta, *each).curvature(each[1].logs), self._each(noise))

    def _each(self, noise: Sequence[Noise]) -> list[tuple[Trial, Noise]]:
        return list(zip(self.trials, noise, strict=True))

    def _alone(self, theta: np.ndarray, trial: Trial, own: Noise) -> "Lines":
        return Work(self.box, [trial], self.priors).in_lines(theta, own)


@dataclass(frozen=True, eq=False)
class Lines:
    """Minus the log likelihood of one trial, without priors, by logarithms of the noise: a model in lines, exact where it was
    linearised; infinite without one, where the model failed."""

    model: InLines | None
    balances: int

    def value(self, logs: np.ndarray) -> float:
        """With other noise."""
        noise = Noise.of(logs, self.balances)
        return np.inf if self.model is None else -self.model.log_likelihood(noise.intensity, noise.sensors)

    def slopes(self, logs: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Its value, its gradient and the information; the latter are 0 where it is infinite."""
        noise = Noise.of(logs, self.balances)
        if self.model is None:
            return np.inf, np.zeros(len(logs)), np.zeros((len(logs), len(logs)))
        value, gradient, information = self.model.slopes(noise.intensity, noise.sensors)
        return -value, -gradient, information

    def curvature(self, logs: np.ndarray) -> np.ndarray:
        """Second derivatives by differences of slopes, made positive."""
        here = self.slopes(logs)[1]
        hessian = np.array([self.slopes(logs + e)[1] - here for e in DIFFERENCE * np.eye(len(logs))]) / DIFFERENCE
        return _positive((hessian + hessian.T) / 2)
