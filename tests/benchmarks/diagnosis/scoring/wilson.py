"""Confidence of a share."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

Z95 = 1.959964


@dataclass(frozen=True)
class Share:
    """`hits` of `n`, with the Wilson 95 % interval (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927)."""

    hits: int
    n: int

    @staticmethod
    def of(hits: Iterable[bool]) -> "Share":
        """Count the true ones."""
        found = list(hits)
        return Share(sum(found), len(found))

    @property
    def value(self) -> float | None:
        """The share itself, None without cases."""
        return self.hits / self.n if self.n else None

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper limit.

        >>> [round(x, 3) for x in Share(0, 10).interval]
        [0.0, 0.278]
        """
        if not self.n:
            return 0.0, 1.0
        p, z2 = self.hits / self.n, Z95**2 / self.n
        middle, half = p + z2 / 2, Z95 * math.sqrt(p * (1 - p) / self.n + z2 / (4 * self.n))
        low, high = (middle - half) / (1 + z2), (middle + half) / (1 + z2)
        # Of none or of all, rounding must not leave the share itself outside.
        return min(p, max(0.0, low)), max(p, min(1.0, high))

    def __str__(self) -> str:
        """`8/10 = 80 % (49-94)`, or a dash without cases."""
        if not self.n:
            return "-"
        low, high = self.interval
        return f"{self.hits}/{self.n} = {100 * self.hits / self.n:.0f} % ({100 * low:.0f}-{100 * high:.0f})"
