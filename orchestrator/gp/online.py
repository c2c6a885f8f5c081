"""A posterior that learns datum by datum in constant memory, and keeps the information of more data than it has room for."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtrsv

from fmus.errors import MisfitError
from orchestrator.gp.compressed import Compressed
from orchestrator.gp.covariance import Latents, known, least_noise, least_share, mean, variances
from orchestrator.gp.observations import Observation, Rows
from orchestrator.gp.posterior import Posterior
from orchestrator.gp.removal import remove

Array = NDArray[Any]
# Standard deviations beyond which a datum is wild. It is far out, since kernels are guesses, and data that contradict
# each other are learned as they are; what learns in a loop, with fitted kernels, takes less.
GATE = 50.0
_ROUNDING = 1e-12
# Nats; a datum that says less has said nothing.
_NOTHING = 1e-12


class Learner:
    """The joint posterior of all data learned: exact up to `budget` of them, then projected on as many rows (see `Compressed`).

    With `compresses=False` a full learner forgets the least informative datum instead and stays exact for those kept; if it
    `forgets_oldest`, the oldest: for functions that change with time, of which old data say what is no longer so.

    A datum that is off by more than `gate` standard deviations of what is expected of it is taken as noisy as it shows
    itself: its noise grows until it is off by `gate`, so that one wild value moves nothing, and many that agree are
    learned in the end. `doubted` counts them.

    Everything is allocated at once. The factor is kept at full size, with ones on the diagonal where there are no data yet,
    so that BLAS works in place on it.
    """

    def __init__(
        self,
        latents: Latents,
        inputs: int,
        components: int,
        budget: int,
        forgets_oldest: bool = False,
        compresses: bool = True,
        gate: float = GATE,
    ) -> None:
        if budget < 1:
            raise MisfitError(f"a budget of {budget} observations; expected at least 1")
        room = budget + 1  # a new datum comes before the least informative goes
        self._latents, self._budget, self.count = latents, budget, 0
        self._forgets_oldest, self._compresses = forgets_oldest, compresses and not forgets_oldest
        self._gate, self.doubted = gate, 0
        self._compressed: Compressed | None = None
        self._lower = np.asfortranarray(np.eye(room))
        self._inputs = np.zeros((room, inputs))
        self._coefficients = {name: np.zeros(room) for name in latents}
        self._residuals, self._half = np.zeros((room, components)), np.zeros((components, room))
        self._noise, self._precision = np.zeros(room), np.zeros(room)
        self._posterior: Posterior | None = None

    def add(self, observation: Observation) -> None:
        """Learn all rows of an observation, one after the other.

        Raises:
            MisfitError: if it does not fit, or a row follows from the data kept up to rounding; rows before it are learnt.
        """
        known(self._latents, observation.coefficients)
        for what, mine, theirs in (
            ("inputs", self._inputs, observation.inputs),
            ("components", self._residuals, observation.values),
        ):
            if mine.shape[1] != theirs.shape[1]:
                raise MisfitError(f"{observation.name} has {theirs.shape[1]} {what}, the learner {mine.shape[1]}")
        deviation = observation.deviation
        for k in range(len(observation.inputs)):
            one = Rows(observation.inputs[[k]], {name: a[[k]] for name, a in observation.coefficients.items()})
            self._learn(observation.name, one, observation.values[[k]], float(deviation[k] ** 2))

    def _learn(self, name: str, new: Rows, values: Array, noise: float) -> None:
        if self._compressed is not None:
            self._tell(self._compressed, new, values, noise)
            return
        self._append(name, new, values, noise)
        if self.count <= self._budget:
            return
        information = self.information()
        if not self._compresses or information.min() < _NOTHING:
            self.forget(0 if self._forgets_oldest else int(np.argmin(information)))
            return
        self._compressed = self._compress()
        self.count, self._posterior = self._compressed.count, None

    def _tell(self, kept: Compressed, new: Rows, values: Array, noise: float) -> None:
        phi, total = kept.towards(new), float(variances(self._latents, new)[0])
        off = (values - mean(self._latents, new, values.shape[1]))[0] - kept.expected(phi)
        noise = self._believed(float(np.max(np.abs(off))), kept.variance(phi, total), noise, total)
        kept.learn(new, phi, total, off, noise)
        self.count, self._posterior = kept.count, None

    def _believed(self, off: float, variance: float, noise: float, scale: float) -> float:
        """The variance of noise of a datum that is off by so much."""
        least = (off / self._gate) ** 2 - max(variance, 0.0)
        if least <= noise or least <= _ROUNDING * scale:
            return noise
        self.doubted += 1
        return least

    def _compress(self) -> Compressed:
        """What was learned so far, on fewer rows."""
        kept = Compressed(self._latents, self._inputs.shape[1], len(self._half), self._budget)
        for k in range(self.count):
            new = Rows(self._inputs[[k]], {name: column[[k]] for name, column in self._coefficients.items()})
            phi, total = kept.towards(new), float(variances(self._latents, new)[0])
            kept.learn(new, phi, total, self._residuals[k] - kept.expected(phi), float(self._noise[k]))
        return kept

    def information(self) -> Array:
        """What each datum says about the functions beyond the others, (n,), in nats; inf without noise.

        It is log(v / s^2) / 2, with s^2 the variance of its noise and v the variance of its value given all others, 1 /
        v being its diagonal element of the inverse covariance. Values do not count, so outliers are not preferred.
        """
        self._exactly("information")
        n = self.count
        with np.errstate(divide="ignore"):
            return -0.5 * np.log(self._precision[:n] * self._noise[:n])

    def forget(self, place: int) -> None:
        """Leave out a datum, by its place from 0 among those kept (oldest first)."""
        self._exactly("forget")
        n = self.count
        if not 0 <= place < n:
            raise MisfitError(f"there is no datum {place} to forget; there are {n}, from 0")
        unit = np.zeros(len(self._noise))
        unit[place] = 1.0
        column = self._solve(self._solve(unit), transposed=True)
        self._precision[:n] -= column[:n] ** 2 / column[place]
        remove(self._lower, self._half, n, place)
        for rows in (
            self._inputs,
            self._residuals,
            self._noise,
            self._precision,
            *self._coefficients.values(),
        ):
            rows[place : n - 1] = rows[place + 1 : n]
            rows[n - 1] = 0.0
        self.count, self._posterior = n - 1, None

    def live(self) -> Posterior:
        """The posterior of the data kept now, in the learner's own memory: to be used before it changes again."""
        if self._compressed is not None:
            self._posterior = self._posterior or self._compressed.posterior()
            return self._posterior
        if self._posterior is None:
            weights = [self._solve(column, transposed=True) for column in self._half]
            rows = Rows(self._inputs, self._coefficients)
            self._posterior = Posterior(self._latents, rows, self._lower, np.column_stack(weights))
        return self._posterior

    def posterior(self) -> Posterior:
        """The posterior of the data kept now; later learning does not change it."""
        n, now = self.count, self.live()
        if self._compressed is not None:
            return now
        rows = Rows(self._inputs[:n].copy(), {name: each[:n].copy() for name, each in self._coefficients.items()})
        return Posterior(self._latents, rows, self._lower[:n, :n].copy(order="F"), now.weights[:n].copy())

    def _exactly(self, what: str) -> None:
        if self._compressed is not None:
            raise MisfitError(
                f"{what}: the learner is full and has compressed its data, which are no longer apart; make it with compresses=False"
            )

    def _append(self, name: str, new: Rows, values: Array, noise: float) -> None:
        n = self.count
        given, total = noise, float(variances(self._latents, new)[0]) + noise
        explained = self._solve(self._covariance(new))
        off = (values - mean(self._latents, new, len(self._half)))[0] - self._half[:, :n] @ explained[:n]
        variance = total - noise - float(explained @ explained)
        noise = self._believed(float(np.max(np.abs(off))), variance, noise, total)
        total, left = total - given + noise, variance + noise
        if not left > least_share(n + 1) * total:
            raise MisfitError(
                f"{name}: the datum follows from the {n} before it (prior deviation with noise {np.sqrt(total):.3g}); "
                f"give it a noise of at least {least_noise(n + 1, np.sqrt(total)):.1g}, or leave it out"
            )
        gain = self._solve(explained, transposed=True)[:n]
        self._precision[:n] += gain**2 / left
        self._precision[n] = 1.0 / left
        self._inputs[n], self._noise[n] = new.inputs[0], noise
        for latent, column in self._coefficients.items():
            column[n] = new.coefficients[latent][0] if latent in new.coefficients else 0.0
        self._residuals[n] = (values - mean(self._latents, new, len(self._half)))[0]
        self._half[:, n] = (self._residuals[n] - self._half[:, :n] @ explained[:n]) / np.sqrt(left)
        self._lower[n, :n], self._lower[n, n] = explained[:n], np.sqrt(left)
        self.count, self._posterior = n + 1, None

    def _covariance(self, new: Rows) -> Array:
        """Covariance of a new datum with all that are kept, with zeros behind them."""
        n = self.count
        cross = np.zeros(len(self._noise))
        for name, a in new.coefficients.items():
            if n and a[0] != 0.0:
                found = self._latents[name].kernel.towards(self._inputs[:n])(new.inputs[0])
                found *= a[0] * self._coefficients[name][:n]
                cross[:n] += found
        return cross

    def _solve(self, right: Array, transposed: bool = False) -> Array:
        return dtrsv(self._lower, right, lower=1, trans=int(transposed))
