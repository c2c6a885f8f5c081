"""A posterior over a few rows that holds the information of many data: sparse online learning by projection.

Csato and Opper, Sparse on-line Gaussian processes (2002), in whitened form: the values of the rows kept are L v with L
L' their prior covariance, and v is normal with mean m and covariance S, which data only shrink from I. A new datum adds
a row; where there are too many, one is told by the others alone, so that what it was told stays with them.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dsymm, dsymv, dsyr, dtrsv
from scipy.linalg.lapack import dgeqrf, dormqr, dpotrf, dtrtri

from orchestrator.gp.covariance import Latents
from orchestrator.gp.observations import Rows
from orchestrator.gp.posterior import Posterior
from orchestrator.gp.triangle import one_thread

Array = NDArray[Any]
# A row of which less than this share of the noise, or of its own variance, is new is not kept: what is new in it counts
# as noise.
_SHARE_OF_NOISE, _SHARE_OF_VARIANCE = 0.1, 1e-8
# Below this share of its prior variance nobody knows a direction better or worse: rounding.
_ROUNDING = 1e-12


class Compressed:
    """At most `budget` rows, and what is known of them; it begins without any."""

    def __init__(self, latents: Latents, inputs: int, components: int, budget: int) -> None:
        room = budget + 1
        self._latents, self._budget, self.count = latents, budget, 0
        self._inputs, self._counts = np.zeros((room, inputs)), {name: np.zeros(room) for name in latents}
        self._lower, self._s = (np.zeros((room, room), order="F") for _ in range(2))
        self._m = np.zeros((room, components))

    def towards(self, new: Rows) -> Array:
        """L^-1 times the covariances of the rows kept with a row, (m,)."""
        n, found = self.count, np.zeros(self.count)
        if not n:
            return found
        for name, a in new.coefficients.items():
            if a[0] != 0.0:
                kernel = self._latents[name].kernel.towards(self._inputs[:n])(new.inputs[0])
                kernel *= self._counts[name][:n]
                kernel *= a[0]
                found += kernel
        return dtrsv(self._lower[:n, :n], found, lower=1)

    def expected(self, phi: Array) -> Array:
        """Mean, less the prior's, of a row, (p,)."""
        return phi @ self._m[: self.count]

    def variance(self, phi: Array, total: float) -> float:
        """Variance of a row of which `total` is the prior's."""
        return max(total - float(phi @ phi), 0.0) + float(phi @ self._told(phi))

    def learn(self, new: Rows, phi: Array, total: float, off: Array, noise: float) -> None:
        """Learn that a row is `off` what is expected, (p,), with this variance of noise.

        Args:
            new: the row, its inputs and coefficients.
            phi: its covariances with the rows that are kept, as their Cholesky factor gives them, (n,).
            total: its prior variance.
            off: what it is off, (p,).
            noise: variance of its noise.
        """
        n, novel = self.count, max(total - float(phi @ phi), 0.0)
        if novel <= max(_SHARE_OF_NOISE * noise, _SHARE_OF_VARIANCE * total):
            self._tell(phi, off, noise + novel)
            return
        root = np.sqrt(novel)
        self._inputs[n], self._lower[n, :n], self._lower[n, n] = new.inputs[0], phi, root
        for name, column in self._counts.items():
            column[n] = new.coefficients[name][0] if name in new.coefficients else 0.0
        self._s[n, :n], self._s[:n, n], self._s[n, n], self._m[n] = 0.0, 0.0, 1.0, 0.0
        self.count = n + 1
        self._tell(np.append(phi, root), off, noise)
        if self.count > self._budget:
            with one_thread():
                self._leave_out(self._least())

    def posterior(self) -> Posterior:
        """The posterior with a factor: of variances k** - |inv(lower) k|^2."""
        with one_thread():
            return self._posterior()

    def _posterior(self) -> Posterior:
        n = self.count
        # I - S = U U' with U upper triangular, from a factor of the matrix with rows and columns reversed; lower = L
        # inv(U)'.
        known = (np.eye(n) * (1.0 + _ROUNDING) - self._whole())[::-1, ::-1]
        half, failed = dpotrf(known, lower=1, clean=1)
        if failed:
            values, vectors = np.linalg.eigh(known)
            half = np.linalg.cholesky((vectors * np.maximum(values, 2.0 * n * _ROUNDING)) @ vectors.T)
        upper = half[::-1, ::-1]
        inverse = dtrtri(np.asfortranarray(upper.T), lower=1)[0]
        lower = self._lower[:n, :n]
        weights = np.column_stack([dtrsv(lower, column, lower=1, trans=1) for column in self._m[:n].T])
        rows = Rows(self._inputs[:n].copy(), {name: column[:n].copy() for name, column in self._counts.items()})
        return Posterior(self._latents, rows, np.asfortranarray(lower @ inverse), weights)

    def _told(self, phi: Array) -> Array:
        n = self.count
        return dsymv(1.0, self._s[:n, :n], phi, lower=1) if n else phi

    def _tell(self, phi: Array, off: Array, noise: float) -> None:
        n, told = self.count, self._told(phi)
        spread = float(phi @ told) + noise
        self._s[:n, :n] = dsyr(-1.0 / spread, told, lower=1, a=self._s[:n, :n])
        self._m[:n] += np.outer(told, off / spread)

    def _least(self) -> int:
        """The row that changes least if it is told by the others: the divergence of its mean and of its spread."""
        n = self.count
        inverse = dtrtri(self._lower[:n, :n], lower=1)[0]
        weights = inverse.T @ self._m[:n]
        own = np.einsum("ij,ij->j", inverse, inverse)
        left = np.einsum("ij,ij->j", inverse, dsymm(1.0, self._s[:n, :n], inverse, lower=1))
        left = np.clip(left, _ROUNDING * own, own)
        loss = np.einsum("ij,ij->i", weights, weights) / left - weights.shape[1] * np.log(left / own)
        return int(np.argmin(loss))

    def _leave_out(self, place: int) -> None:
        """Without a row of L its columns from there on are turned to be triangular again, and v with them; its last
        entry goes."""
        n, last = self.count, self.count - 1
        if place < last:
            turned, tau, _, _ = dgeqrf(self._lower[place + 1 : n, place:n].T)
            self._lower[place:last, :place] = self._lower[place + 1 : n, :place]
            self._lower[place:last, place:last] = np.tril(turned[:-1].T)
            whole, room = self._whole(), 64 * n
            whole[place:] = dormqr("L", "T", turned, tau, whole[place:], room)[0]
            whole[:, place:] = dormqr("R", "N", turned, tau, whole[:, place:], room)[0]
            self._s[:n, :n] = whole
            self._m[place:n] = dormqr("L", "T", turned, tau, self._m[place:n], room)[0]
            for table in (self._inputs, *self._counts.values()):
                table[place:last] = table[place + 1 : n]
        self.count = last

    def _whole(self) -> Array:
        """S with both of its triangles."""
        s = np.tril(self._s[: self.count, : self.count])
        return s + np.tril(s, -1).T
