"""Fit parameters, process noise and sensor noise together: the likelihood of a stochastic grey box."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fmus.errors import ComponentError
from orchestrator.greybox.filtering import Filtered, GreyBox, Trial
from orchestrator.models.threads import on_idle_threads

# A round that gains less in log likelihood changes no decision.
ENOUGH = 0.05
# Steps in a sample interval are short enough if halving them changes the log likelihood by no more, or by 1e-4 of it.
CLOSE = 0.3
ROUNDS, STEPS = 20, 4
# Rounds of a rough fit.
ROUGHLY = 3
MOST_SUBSTEPS = 16
# Times that the model is put in lines for the noise.
LOOKS = 3
# Logarithms of noise: differences for slopes, and the longest step.
DIFFERENCE, FARTHEST = 0.05, 2.0
LOG_RANGE = np.log(1e8)
# Forces that are tried in place of those that seem to be there, as a share of their size.
CALMER = 0.1
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
    """Normal priors and limits of the free parameters, (ntheta,) each; a std of infinity is none."""

    mean: np.ndarray
    std: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def cost(self, theta: np.ndarray) -> float:
        """Minus the logarithm of the prior, up to a constant."""
        return 0.5 * float(np.sum(((theta - self.mean) / self.std) ** 2))


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted grey box: `theta` (ntheta,), `noise` of each trial, the log likelihood with priors, and the runs."""

    box: GreyBox
    trials: tuple[Trial, ...]
    theta: np.ndarray
    noise: tuple[Noise, ...]
    log_likelihood: float
    priors: Priors
    substeps: int
    runs: tuple[Filtered, ...]

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
        self._enough: int | None = None

    def fit(
        self,
        box: GreyBox,
        theta: np.ndarray,
        priors: Priors,
        noise: Sequence[Noise] | None = None,
        *,
        rounds: int = ROUNDS,
    ) -> Fit:
        """Fit from first values: parameters and noise in turn, then with calmer forces if there is more than one round.

        Args:
            box: the model with its effects, filtered along trials.
            theta: first values (k,) of the free parameters.
            priors: their bounds and spreads.
            noise: first values of the noise of each trial, by default those that the fitter was made with.
            rounds: of parameters and noise, at most.

        Raises:
            ComponentError: if the model fails from the first values on.
        """
        noise = self.start if noise is None else tuple(noise)
        substeps = self._substeps(box, theta, noise)
        work = Work(box, self.trials, priors, substeps)
        value = work.value(theta, noise)
        for _ in range(rounds):
            before = value
            theta, value = self._parameters(work, theta, noise, value)
            noise, value = self._noise(work, theta, noise, value)
            if before - value < ENOUGH or not len(theta):
                break
        if rounds > 1:
            theta, noise, value = self._calmed(work, theta, noise, value)
        runs = work.runs(theta, noise, slopes=True)
        return Fit(box, self.trials, theta, noise, -value, priors, substeps, tuple(runs))

    def without_disturbance(self, box: GreyBox, fit: Fit) -> tuple[float, float]:
        """Log likelihood of a fit's model if nothing but sensors' noise is left, and by which factor that is larger then.

        The noise is estimated again; the factor is the largest over signals and trials.
        """
        total, louder = -fit.priors.cost(fit.theta), 1.0
        for trial, own in zip(self.trials, fit.noise, strict=True):
            work = Work(box, [trial], fit.priors, fit.substeps)
            tiny = self.start[0].intensity * SILENT
            best, found = np.inf, own.sensors
            for sensors in (own.sensors, self._rough(box, trial, fit)):
                logs = np.log(sensors)

                def objective(at: np.ndarray, work: Work = work, tiny: np.ndarray = tiny) -> float:
                    return work.value(fit.theta, [Noise(tiny, np.exp(at))])

                low = np.log(self.least_noise)
                reached, value = _descended(objective, logs, low, low + 2 * LOG_RANGE, 2 * STEPS)
                if value < best:
                    best, found = value, np.exp(reached)
            total -= best - fit.priors.cost(fit.theta)
            louder = max(louder, float(np.max(found / own.sensors)))
        return total, louder

    def _rough(self, box: GreyBox, trial: Trial, fit: Fit) -> np.ndarray:
        """Errors (ny,) of a run that nothing disturbs."""
        run = box.run(trial, fit.theta, self.start[0].intensity * SILENT, self.start[0].sensors, substeps=fit.substeps)
        return np.maximum(np.sqrt(np.mean(run.innovation**2, axis=0)), self.least_noise)

    def _substeps(self, box: GreyBox, theta: np.ndarray, noise: Sequence[Noise]) -> int:
        """Steps in a sample interval at which halving them hardly changes the likelihood."""
        priors = Priors(theta, np.full(len(theta), np.inf), theta, theta)
        # What was enough for the first set, the model as given, is a good guess for the others.
        count = max(1, (self._enough or 1) // 2)
        before = Work(box, self.trials, priors, count).value(theta, noise)
        while count < MOST_SUBSTEPS:
            after = Work(box, self.trials, priors, 2 * count).value(theta, noise)
            if np.isfinite(before) and abs(after - before) < CLOSE + 1e-4 * abs(after):
                self._enough = self._enough or count
                return count
            count, before = 2 * count, after
        return count

    def _parameters(
        self, work: "Work", theta: np.ndarray, noise: Sequence[Noise], value: float
    ) -> tuple[np.ndarray, float]:
        """Levenberg's and Marquardt's steps on the whitened innovations, accepted by the likelihood."""
        if not len(theta):
            return theta, value
        damping = 1e-4
        for _ in range(STEPS):
            gradient, curvature = work.normal(theta, noise)
            held_low = (theta <= work.priors.low) & (gradient > 0)
            free = ~(held_low | ((theta >= work.priors.high) & (gradient < 0)))
            if not free.any():
                break
            gained = 0.0
            for _ in range(8):
                step = np.zeros(len(theta))
                matrix = curvature[np.ix_(free, free)]
                scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
                scaled = matrix / scale[:, None] / scale + damping * np.eye(len(scale))
                step[free] = -np.linalg.solve(scaled, gradient[free] / scale) / scale
                proposed = np.clip(theta + step, work.priors.low, work.priors.high)
                after = work.value(proposed, noise)
                if after < value:
                    gained, theta, value = value - after, proposed, after
                    damping = max(damping / 10, 1e-8)
                    break
                damping *= 10
            if gained < ENOUGH:
                break
        return theta, value

    def _calmed(
        self, work: "Work", theta: np.ndarray, noise: tuple[Noise, ...], value: float
    ) -> tuple[np.ndarray, tuple[Noise, ...], float]:
        """Parameters fitted with calmer forces, and the noise that they leave, as long as that is likelier.

        With much noise the record says little of parameters, and with wrong parameters there is much noise: steps of either in
        turn end far from the best of both.
        """
        while len(theta):
            calmer = [Noise(own.intensity * CALMER, own.sensors) for own in noise]
            other, reached = self._parameters(work, theta, calmer, work.value(theta, calmer))
            less, reached = self._noise(work, other, calmer, reached)
            if not reached < value - ENOUGH:
                break
            theta, noise, value = other, less, reached
        return theta, noise, value

    def _noise(
        self, work: "Work", theta: np.ndarray, noise: Sequence[Noise], value: float
    ) -> tuple[tuple[Noise, ...], float]:
        """The noise of each trial, by Newton's steps on its logarithms, each of them limited."""
        price = work.priors.cost(theta)

        def of(each: tuple[Trial, Noise, Noise]) -> tuple[Noise, float]:
            trial, own, start = each
            return self._noise_of(Work(work.box, [trial], work.priors, work.substeps), theta, own, start)

        found = on_idle_threads(of, list(zip(self.trials, noise, self.start, strict=True)))
        return tuple(best for best, _ in found), price + sum(cost - price for _, cost in found)

    def _noise_of(self, work: "Work", theta: np.ndarray, noise: Noise, start: Noise) -> tuple[Noise, float]:
        nb, centre = len(noise.intensity), start.logs
        low, high = centre - LOG_RANGE, centre + LOG_RANGE
        low[nb:] = np.log(self.least_noise)
        at = np.clip(noise.logs, low, high)

        def looked(at: np.ndarray) -> tuple[float, Callable[[np.ndarray], float]]:
            lines = work.in_lines(theta, Noise.of(at, nb))
            return lines(Noise.of(at, nb)), lambda other: lines(Noise.of(other, nb))

        value, objective = looked(at)
        for _ in range(LOOKS if np.isfinite(value) else 0):
            found, _ = _descended(objective, at, low, high, 2 * STEPS)
            reached, again = looked(found)
            while reached >= value and np.abs(found - at).max() > DIFFERENCE:  # too far for lines
                found = at + (found - at) / 4
                reached, again = looked(found)
            if reached >= value:
                break
            gained, at, value, objective = value - reached, found, reached, again
            if gained < ENOUGH:
                break
        return Noise.of(at, nb), value + work.priors.cost(theta)


def _descended(
    objective: Callable[[np.ndarray], float], at: np.ndarray, low: np.ndarray, high: np.ndarray, steps: int
) -> tuple[np.ndarray, float]:
    """Where Newton's limited steps lead within bounds, and the value there; the curvature is found once, then again if they fail."""
    at = np.clip(at, low, high)
    value, curvature, fresh = objective(at), np.zeros((0, 0)), False
    for _ in range(steps):
        if not curvature.size:
            gradient, curvature, fresh = *_derivatives(objective, at, value), True
        else:
            gradient, fresh = _slopes(objective, at), False
        held = ((at <= low) & (gradient > 0)) | ((at >= high) & (gradient < 0))
        step = _limited_newton(gradient, curvature, ~held)
        gained = 0.0
        for _ in range(4):
            proposed = np.clip(at + step, low, high)
            after = objective(proposed)
            if after < value:
                gained, at, value = value - after, proposed, after
                break
            step = step / 4
        if gained < ENOUGH:
            if fresh:
                break
            curvature = np.zeros((0, 0))
    return at, value


def _slopes(function: Callable[[np.ndarray], float], at: np.ndarray) -> np.ndarray:
    """Gradient by central differences."""
    unit = DIFFERENCE * np.eye(len(at))
    return np.array([function(at + e) - function(at - e) for e in unit]) / (2 * DIFFERENCE)


def _derivatives(function: Callable[[np.ndarray], float], at: np.ndarray, here: float) -> tuple[np.ndarray, np.ndarray]:
    """Gradient and Hessian by differences."""
    n, h = len(at), DIFFERENCE
    unit = h * np.eye(n)
    above = np.array([function(at + e) for e in unit])
    below = np.array([function(at - e) for e in unit])
    hessian = np.diag((above - 2 * here + below) / h**2)
    for i in range(n):
        for j in range(i):
            both = function(at + unit[i] + unit[j])
            hessian[i, j] = hessian[j, i] = (both - above[i] - above[j] + here) / h**2
    return (above - below) / (2 * h), hessian


def _limited_newton(gradient: np.ndarray, hessian: np.ndarray, free: np.ndarray) -> np.ndarray:
    """A step downhill along the free directions, of at most `FARTHEST` in any of them."""
    step = np.zeros(len(gradient))
    if not free.any() or not np.isfinite(hessian).all():
        return step
    values, vectors = np.linalg.eigh(hessian[np.ix_(free, free)])
    along = vectors.T @ gradient[free]
    step[free] = -vectors @ (along / np.maximum(np.abs(values), 1e-3 * np.abs(values).max() + 1e-9))
    return step * min(1.0, FARTHEST / max(float(np.abs(step).max()), 1e-300))


class Work:
    """Values and slopes of the objective of one grey box: minus the log likelihood, with priors."""

    def __init__(self, box: GreyBox, trials: Sequence[Trial], priors: Priors, substeps: int) -> None:
        self.box, self.trials, self.priors, self.substeps = box, trials, priors, substeps

    def runs(self, theta: np.ndarray, noise: Sequence[Noise], *, slopes: bool = False) -> list[Filtered]:
        def run(each: tuple[Trial, Noise]) -> Filtered:
            trial, own = each
            return self.box.run(trial, theta, own.intensity, own.sensors, substeps=self.substeps, slopes=slopes)

        return on_idle_threads(run, list(zip(self.trials, noise, strict=True)))

    def value(self, theta: np.ndarray, noise: Sequence[Noise]) -> float:
        """Infinite where the model fails."""
        try:
            total = -sum(run.log_likelihood for run in self.runs(theta, noise)) + self.priors.cost(theta)
        except ComponentError:
            return np.inf
        return total if np.isfinite(total) else np.inf

    def in_lines(self, theta: np.ndarray, noise: Noise) -> Callable[[Noise], float]:
        """Minus the log likelihood of the only trial, without priors, with other noise by lines about this one: exact there.

        Infinite where the model fails.
        """
        try:
            [trial] = self.trials
            lines = self.box.in_lines(trial, theta, noise.intensity, noise.sensors, substeps=self.substeps)
        except ComponentError:
            return lambda other: np.inf
        return lambda other: -lines.log_likelihood(other.intensity, other.sensors)

    def normal(self, theta: np.ndarray, noise: Sequence[Noise]) -> tuple[np.ndarray, np.ndarray]:
        """Gradient and Gauss-Newton's curvature at frozen gains."""
        gradient = (theta - self.priors.mean) / self.priors.std**2
        curvature = np.diag(1.0 / self.priors.std**2)
        for run in self.runs(theta, noise, slopes=True):
            weight = np.where(run.variance > 0, 1.0 / np.where(run.variance > 0, run.variance, 1.0), 0.0)
            rows = run.slope.reshape(run.slope.shape[0] * run.slope.shape[1], len(theta))
            weighted = rows * weight.ravel()[:, None]
            gradient = gradient + weighted.T @ run.innovation.ravel()
            curvature = curvature + weighted.T @ rows
        return gradient, curvature
