"""A posterior that learns datum by datum in constant memory, and forgets the least informative when it is full."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtrsv

from fmus.errors import MisfitError
from orchestrator.gp.covariance import Latents, covariance, known, least_noise, least_share, mean, variances
from orchestrator.gp.observations import Observation, Rows
from orchestrator.gp.posterior import Posterior

Array = NDArray[Any]


class Learner:
    """The exact joint posterior of the data kept, at most `budget` of them; learning and forgetting take time n^2.

    Everything is allocated at once. The factor is kept at full size, with ones on the diagonal where there are no data yet,
    so that BLAS works in place on it.
    """

    def __init__(self, latents: Latents, inputs: int, components: int, budget: int) -> None:
        if budget < 1:
            raise MisfitError(f"a budget of {budget} observations; expected at least 1")
        room = budget + 1  # a new datum comes before the least informative goes
        self._latents, self._budget, self.count = latents, budget, 0
        self._lower = np.asfortranarray(np.eye(room))
        self._inputs = np.zeros((room, inputs))
        self._coefficients = {name: np.zeros(room) for name in latents}
        self._residuals, self._half = np.zeros((room, components)), np.zeros((room, components))
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
        for k in range(len(observation.inputs)):
            self._append(observation.rows(np.array([k])))
            if self.count > self._budget:
                self.forget(int(np.argmin(self.information())))

    def information(self) -> Array:
        """What each datum says about the functions beyond the others, (n,), in nats; inf without noise.

        It is log(v / s^2) / 2, with s^2 the variance of its noise and v the variance of its value given all others, 1 / v being
        its diagonal element of the inverse covariance. Values do not count, so outliers are not preferred.
        """
        n = self.count
        with np.errstate(divide="ignore"):
            return -0.5 * np.log(self._precision[:n] * self._noise[:n])

    def forget(self, place: int) -> None:
        """Leave out a datum, by its place from 0 among those kept (oldest first)."""
        n = self.count
        if not 0 <= place < n:
            raise MisfitError(f"there is no datum {place} to forget; there are {n}, from 0")
        unit = np.zeros(len(self._noise))
        unit[place] = 1.0
        column = self._solve(self._solve(unit), transposed=True)
        self._precision[:n] -= column[:n] ** 2 / column[place]
        self._remove_from_factor(place)
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
        for k in range(self._half.shape[1]):
            self._half[:, k] = self._solve(self._residuals[:, k])

    def posterior(self) -> Posterior:
        """The posterior of the data kept now; later learning does not change it."""
        if self._posterior is None:
            n = self.count
            weights = [self._solve(column, transposed=True) for column in self._half.T]
            rows = self._rows()
            kept = Rows(rows.inputs.copy(), {name: each.copy() for name, each in rows.coefficients.items()})
            self._posterior = Posterior(self._latents, kept, self._lower[:n, :n].copy(), np.column_stack(weights)[:n])
        return self._posterior

    def _append(self, datum: Observation) -> None:
        n = self.count
        new = Rows(datum.inputs, datum.coefficients)
        noise = float(datum.deviation[0] ** 2)
        total = float(variances(self._latents, new)[0]) + noise
        cross = np.zeros(len(self._noise))
        cross[:n] = covariance(self._latents, self._rows(), new)[:, 0]
        explained = self._solve(cross)
        left = total - float(explained @ explained)
        if not left > least_share(n + 1) * total:
            raise MisfitError(
                f"{datum.name}: the datum follows from the {n} before it (prior deviation with noise {np.sqrt(total):.3g}); "
                f"give it a noise of at least {least_noise(n + 1, np.sqrt(total)):.1g}, or leave it out"
            )
        gain = self._solve(explained, transposed=True)[:n]
        self._precision[:n] += gain**2 / left
        self._precision[n] = 1.0 / left
        self._inputs[n], self._noise[n] = datum.inputs[0], noise
        for name, column in self._coefficients.items():
            column[n] = datum.coefficients[name][0] if name in datum.coefficients else 0.0
        self._residuals[n] = (datum.values - mean(self._latents, new, self._half.shape[1]))[0]
        self._half[n] = (self._residuals[n] - explained[:n] @ self._half[:n]) / np.sqrt(left)
        self._lower[n, :n], self._lower[n, n] = explained[:n], np.sqrt(left)
        self.count, self._posterior = n + 1, None

    def _remove_from_factor(self, place: int) -> None:
        """Take a row out of the factor: the block behind it, L, becomes the factor of L L' + l l' (l its column).

        That is L M with M M' = I + v v' and v = inv(L) l, whose factor is known in closed form: with s_j = 1 + sum_{k<=j} v_k^2,
        M_jj = sqrt(s_j / s_{j-1}) and M_kj = v_k v_j / sqrt(s_j s_{j-1}) below it (Gill, Golub, Murray and Saunders 1974).
        """
        n = self.count
        block = self._lower[place + 1 : n, place + 1 : n].copy(order="F")
        if len(block):
            v = dtrsv(block, self._lower[place + 1 : n, place], lower=1)
            s = np.concatenate([[1.0], 1.0 + np.cumsum(v * v)])
            below = np.zeros_like(block)  # column j: sum_{k>j} L_k v_k
            below[:, :-1] = np.cumsum((block * v)[:, :0:-1], axis=1)[:, ::-1]
            block = np.tril(block * np.sqrt(s[1:] / s[:-1]) + below * (v / np.sqrt(s[1:] * s[:-1])))
        self._lower[place : n - 1, :place] = self._lower[place + 1 : n, :place]
        self._lower[place : n - 1, place : n - 1] = block
        self._lower[n - 1, :n] = 0.0
        self._lower[n - 1, n - 1] = 1.0

    def _rows(self) -> Rows:
        n = self.count
        return Rows(self._inputs[:n], {name: each[:n] for name, each in self._coefficients.items()})

    def _solve(self, right: Array, transposed: bool = False) -> Array:
        return dtrsv(self._lower, right, lower=1, trans=int(transposed))
