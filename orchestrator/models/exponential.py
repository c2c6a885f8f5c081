"""Exponentials of many small matrices at once: what a linear system becomes in each of thousands of sample intervals."""

import numpy as np
from scipy import linalg

# The polynomial of this degree errs by less than rounding for matrices of this norm.
DEGREE, SMALL = 12, 0.25
# Matrices of a larger norm are squared too often to be done together with the others.
LARGE = 64.0


def exponentials(matrices: np.ndarray) -> np.ndarray:
    """exp of each of many matrices (n, m, m).

    Scaling and squaring with a Taylor polynomial, the same number of squarings for all (Moler and Van Loan, SIAM Review 45,
    2003, method 3); the few that are large, or no numbers, are left to SciPy, which takes one after the other.
    """
    norms = np.abs(matrices).sum(axis=1).max(axis=1, initial=0.0)
    together = norms <= LARGE
    found = np.empty_like(matrices)
    found[together] = _together(matrices[together], float(norms[together].max(initial=0.0)))
    if not together.all():
        found[~together] = linalg.expm(matrices[~together])
    return found


def _together(matrices: np.ndarray, norm: float) -> np.ndarray:
    squarings = max(0, int(np.ceil(np.log2(max(norm, SMALL) / SMALL))))
    scaled, one = matrices / 2.0**squarings, np.eye(matrices.shape[1])
    found = one + scaled / DEGREE
    for k in range(DEGREE - 1, 0, -1):
        found = one + scaled @ found / k
    for _ in range(squarings):
        found = found @ found
    return np.asarray(found)
