"""The force that a model lacks along measured trials, with how well the measurement shows it.

The force on each correction input (see `correction`) is an unknown smooth function of time, a Gaussian process of the
Matern 3/2 kind; it joins the model's states, and a Kalman smoother finds both from noisy measurements. What the force
can be like, its size and how fast it changes, is what makes the measurements most probable; second differences of
encoders serve as a first guess alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from fmus.errors import MisfitError
from orchestrator.models.correction import PREFIX
from orchestrator.models.exponential import exponentials
from orchestrator.models.kalman import LinearSystem, States, filtered, smoothed
from orchestrator.models.linearised import Along, Equations
from orchestrator.models.minimise import minimise
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

# Size, duration and noise are learned from so many samples of so many trials, where most happens; more hardly change them.
SAMPLES, TRIALS = 400, 2
# A model that is linear in its states is right after one pass; the others converge as Newton's method does.
PASSES = 2
# Their logarithms are changed by so much to see a slope, until a step would gain less than this in log likelihood.
CHANGE, ENOUGH = 1e-3, 0.01
# What a first state without bounds may be off by, in its unit.
UNKNOWN = 1e3
# Size and duration lie within these factors of the first guess, a duration is at least so many samples, and
# measurements are that much noisier than they are said to be.
REACH, SHORTEST, NOISIER = np.log(1e4), 5, (0.5, 100.0)


@dataclass(frozen=True, eq=False)
class Force:
    """The missing force on each output along a trial: `mean` and `std` (n, k) in `units`, at `time` (n,) s.

    Errors of neighbours are alike over about `duration` (k,) s, in which the force changes; so many samples are one
    datum. `size` (k,) is how large it is, in its unit, `noise` (k,) by which factor the measurements are noisier than
    they are said to be. `states` (n, nx) and `states_std` are the model's states in the order of its system.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    time: np.ndarray
    mean: np.ndarray
    std: np.ndarray
    size: np.ndarray
    duration: np.ndarray
    noise: np.ndarray
    states: np.ndarray
    states_std: np.ndarray


def missing_forces(
    model: SymbolicModel, trials: Sequence[SmoothedTrial], parameters: np.ndarray | None = None
) -> tuple[Force, ...]:
    """The force that makes the model follow each trial, with its standard deviation; size and duration are those of all trials.

    The deviation holds what noise of outputs and measured inputs leaves open, not errors of a model's parameters: these are
    part of what is missing. Next to a jump of the force it is too small, since the force is taken to be smooth.

    Args:
        parameters: all of the model's, in its order; its own if they are left out.

    Raises:
        MisfitError: if the model has no correction inputs for its signals, its equations do not show what they act on,
            or numbers overflow along a trial.
    """
    values = model.compiled.parameters if parameters is None else parameters
    try:
        # Two threads make the small factorisations about 100 times slower; what leaves the finite numbers is refused below.
        with threadpool_limits(limits=1, user_api="blas"), np.errstate(over="ignore", invalid="ignore"):
            followers = [_Follower(model, trial, values) for trial in trials]
            character = _character(followers)
            found = tuple(each.force(character) for each in followers)
    except (np.linalg.LinAlgError, FloatingPointError) as error:
        raise MisfitError(f"{model.name}: the missing force cannot be told from these trials: {error}") from error
    if not all(np.isfinite(each.mean).all() and np.isfinite(each.std).all() for each in found):
        raise MisfitError(
            f"{model.name}: the missing force along these trials leaves the finite numbers; cut them shorter"
        )
    return found


def knows_its_forces(model: SymbolicModel) -> bool:
    """Whether a model has correction inputs for all of its signals, and equations that show what they act on."""
    names = [v.name for v in model.system.inputs]
    shown = all(PREFIX + name in names for name in model.signals)
    return shown and model.residual is not None and not model.system.n_delays


class _Follower:
    """A trial and the model linearised along it."""

    def __init__(self, model: SymbolicModel, trial: SmoothedTrial, parameters: np.ndarray) -> None:
        self.model, self.trial, self._parameters = model, trial, parameters
        if not knows_its_forces(model):
            raise MisfitError(
                f"{model.name} does not show which force it lacks on {', '.join(model.signals)}; expected a model with an "
                f"input {PREFIX}{model.signals[0]}, equations in closed form and no delays"
            )
        names = [v.name for v in model.system.inputs]
        self._places = [names.index(PREFIX + name) for name in model.signals]
        self._count = len(model.system.states)
        self._equations = Equations(model, parameters)
        self._kept: tuple[Along, np.ndarray, np.ndarray] | None = None
        record = model.record(trial, parameters)
        reach = 0.5 * (record.start_high - record.start_low)
        self._start, self._start_std = record.start, np.where(np.isfinite(reach), reach, UNKNOWN)
        self._substeps = model.substeps(record, parameters, trial.noise)
        path = self._path()
        self._linear = self._linearised(path, np.zeros((len(trial.time), len(model.signals))))
        crude = self._crude()
        self.first_guess = self._first_guess(crude)
        # Where most happens: a record may begin at rest.
        starts = range(0, max(len(crude) - SAMPLES, 0) + 1, max(SAMPLES // 2, 1))
        self._begin = max(starts, key=lambda k: float(np.sum(np.var(crude[k : k + SAMPLES], axis=0))))
        self._part = self._linear.part(self._begin, self._begin + SAMPLES)
        self._start_of_part = path[self._begin] if self._begin else record.start

    def log_likelihood(self, character: np.ndarray) -> float:
        """Of samples where much happens, for logarithms of sizes, durations and factors of noise (3 k,)."""
        samples = slice(self._begin, self._begin + SAMPLES)
        system = self._system(self._part, character, self.trial.time[samples], self._start_of_part)
        return filtered(system, self.trial.measured[samples]).log_likelihood

    def force(self, character: np.ndarray) -> Force:
        """The smoothed force, linearised again along what was found."""
        linear, k = self._linear, len(self._places)
        for _ in range(PASSES):
            system = self._system(linear, character, self.trial.time, self._start)
            found = smoothed(system, self.trial.measured)
            linear = self._linearised(found.means[:, : self._count], found.means[:, self._count : self._count + k])
        return self._shown(found, character)

    def _shown(self, found: States, character: np.ndarray) -> Force:
        nx, k = self._count, len(self._places)
        deviations = np.sqrt(np.maximum(np.diagonal(found.covariances, axis1=1, axis2=2), 0.0))
        inputs = self.model.system.inputs
        return Force(
            self.model.signals,
            tuple(inputs[place].unit for place in self._places),
            self.trial.time,
            found.means[:, nx : nx + k],
            deviations[:, nx : nx + k],
            np.exp(character[:k]),
            np.exp(character[k : 2 * k]),
            np.exp(character[2 * k :]),
            found.means[:, :nx],
            deviations[:, :nx],
        )

    def _path(self) -> np.ndarray:
        """States (n, nx) as the smoothed measurements show them; those that nothing shows are simulated along them."""
        model, trial = self.model, self.trial
        assert model.residual is not None
        names = [v.name for v in model.system.states]
        hidden = [v.name for v in model.residual.system.states]
        parameters = self._parameters
        path = np.empty((len(trial.time), len(names)))
        for signal, position in model.residual.positions.items():
            j = model.signals.index(signal)
            scale, offset = (float(part(parameters)) for part in (position.scale, position.offset))
            path[:, names.index(position.state)] = (trial.values[:, j] - offset) / scale
            if position.speed is not None:
                path[:, names.index(position.speed)] = trial.speeds[:, j] / scale
        if hidden:
            places = [names.index(name) for name in hidden]
            start = model.record(trial, self._parameters).start[places]
            path[:, places] = model.hidden.run(trial.time, model.residual_inputs(trial), parameters, start).outputs
        return path

    def _crude(self) -> np.ndarray:
        """The force (n, k) by second differences, smoothed."""
        model, trial = self.model, self.trial
        names = [v.name for v in model.system.states]
        assert model.residual is not None
        hidden = [names.index(v.name) for v in model.residual.system.states]
        compiled = model.compiled_residual
        start = model.record(trial, self._parameters).start[hidden]
        return trial.smoother(compiled.run(trial.time, model.residual_inputs(trial), self._parameters, start).outputs)

    def _first_guess(self, crude: np.ndarray) -> np.ndarray:
        """Logarithms of sizes and durations, from the crude force and the band of the signals, and of noise as it is
        said to be."""
        edge = len(crude) // 20
        size = np.maximum(crude[edge : len(crude) - edge].std(axis=0), 1e-9)
        duration = np.full(len(size), 0.5 / self.trial.smoother.cutoff_hz)
        return np.log(np.concatenate([size, duration, np.ones(len(size))]))

    @property
    def shortest(self) -> float:
        """s: what changes faster is noise."""
        return SHORTEST * self.trial.smoother.step

    def _linearised(self, states: np.ndarray, forces: np.ndarray) -> Along:
        inputs = self.trial.quiet_inputs.copy()
        inputs[:, self._places] = forces
        return self._equations.along(self.trial.time, states, inputs, self._places, self._substeps)

    def _system(self, linear: Along, character: np.ndarray, time: np.ndarray, start: np.ndarray) -> LinearSystem:
        """The model and its force as one system: states, then the force and its rate."""
        nx, k, n = self._count, len(self._places), len(time)
        size, duration, noise = np.exp(character.reshape(3, k))
        rate = np.sqrt(3.0) / duration
        m, steps = nx + 2 * k, np.diff(time)
        step = self._step(linear, duration, steps)
        lasting = np.diag(np.concatenate([np.zeros(nx), size**2, (rate * size) ** 2]))
        # What a stationary process forgets in a step is what is new in it.
        disturbance = lasting - step @ lasting @ np.transpose(step, (0, 2, 1))
        disturbance[:, :nx, :], disturbance[:, :, :nx] = 0.0, 0.0
        disturbance[:, :nx, :nx] = self._shaken(linear, steps)
        covariance = lasting + np.diag(np.concatenate([self._start_std**2, np.zeros(2 * k)]))
        reference = np.zeros((n, m))
        reference[:, : nx + k] = linear.reference
        reached = np.zeros((n - 1, m))
        reached[:, :nx] = linear.reached
        reached[:, nx:] = (step[:, nx:, nx:] @ reference[:-1, nx:, None])[:, :, 0]
        show = np.zeros((n, len(self.model.signals), m))
        show[:, :, : nx + k] = linear.show
        return LinearSystem(
            step,
            reached - (step @ reference[:-1, :, None])[:, :, 0],
            disturbance,
            show,
            linear.shown - (show @ reference[:, :, None])[:, :, 0],
            (self.trial.noise * noise) ** 2,
            np.concatenate([start, np.zeros(2 * k)]),
            covariance,
        )

    def _step(self, linear: Along, duration: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """What becomes of states, force and its rate in each step, (n - 1, m, m).

        It depends on durations alone, and takes most of the time; a search for sizes and noises asks for it again and again.
        """
        if self._kept is not None and self._kept[0] is linear and np.array_equal(self._kept[1], duration):
            return self._kept[2]
        nx, k, rate = self._count, len(self._places), np.sqrt(3.0) / duration
        m = nx + 2 * k
        force, speed = np.arange(nx, nx + k), np.arange(nx + k, m)
        flow = np.zeros((len(steps), m, m))
        flow[:, :nx, : nx + k] = linear.flow
        flow[:, force, speed], flow[:, speed, force], flow[:, speed, speed] = 1.0, -(rate**2), -2.0 * rate
        step = exponentials(flow * steps[:, None, None])
        self._kept = linear, duration, step
        return step

    def _shaken(self, linear: Along, steps: np.ndarray) -> np.ndarray:
        """Covariance of the states that noise of measured inputs makes in a step, and rounding."""
        shaken = np.tile(1e-18 * np.eye(self._count), (len(steps), 1, 1))
        if self.trial.input_noise is not None:
            push = linear.push * self.trial.input_noise * steps[:, None, None]
            shaken += push @ np.transpose(push, (0, 2, 1))
        return shaken


def _character(followers: Sequence[_Follower]) -> np.ndarray:
    """Logarithms of sizes, durations and factors of noise (3 k,) that make the first samples of the trials most probable."""
    chosen = followers[:TRIALS]
    guess = np.median([each.first_guess for each in chosen], axis=0)
    k = len(guess) // 3
    low, high = guess - REACH, guess + REACH / 2
    low[k : 2 * k] = np.log(max(each.shortest for each in chosen))
    low[2 * k :], high[2 * k :] = np.log(NOISIER[0]), np.log(NOISIER[1])
    guess = np.clip(guess, low, high)

    def value(character: np.ndarray) -> float:
        return -sum(each.log_likelihood(character) for each in chosen)

    def objective(character: np.ndarray) -> tuple[float, np.ndarray]:
        here, slopes = value(character), np.empty(len(character))
        for i in (
            *range(k),
            *range(2 * k, 3 * k),
            *range(k, 2 * k),
        ):  # durations last: the others share what is kept for one
            slopes[i] = (value(character + CHANGE * (np.arange(3 * k) == i)) - here) / CHANGE
        return here, slopes

    return minimise(objective, guess, low, high, promise=ENOUGH).point
