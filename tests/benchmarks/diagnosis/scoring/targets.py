"""Scores beside what is promised of them."""

from dataclasses import dataclass

from tests.benchmarks.diagnosis.scoring.wilson import Share


@dataclass(frozen=True)
class Target:
    """`least` must hold and `aim` would be better; both are limits from below, or from above where `less` is better.

    >>> Target(0.95, 0.99).reached(0.97), Target(0.05, 0.03, less=True).reached(0.06)
    ('met', 'missed')
    """

    least: float
    aim: float
    less: bool = False

    def reached(self, value: float) -> str:
        """`aim met`, `met` or `missed`."""
        sign = -1 if self.less else 1
        if sign * value >= sign * self.aim:
            return "aim met"
        return "met" if sign * value >= sign * self.least else "missed"

    def is_certain(self, low: float, high: float) -> bool:
        """Whether all values from `low` to `high` keep the promise, or all break it."""
        return len({self.reached(value) == "missed" for value in (low, high)}) == 1

    def words(self, factor: float) -> str:
        """The target, its values times `factor`."""
        return f"{'at most ' if self.less else ''}{self.least * factor:g} / {self.aim * factor:g}"


@dataclass(frozen=True)
class Band:
    """A figure that should lie within `least` (low, high), better within `aim`.

    >>> Band((0.8, 0.97), (0.87, 0.93)).reached(0.95)
    'met'
    """

    least: tuple[float, float]
    aim: tuple[float, float]

    def reached(self, value: float) -> str:
        """`aim met`, `met` or `missed`."""
        if self.aim[0] <= value <= self.aim[1]:
            return "aim met"
        return "met" if self.least[0] <= value <= self.least[1] else "missed"

    def is_certain(self, low: float, high: float) -> bool:
        """Whether all values from `low` to `high` keep the promise, or all break it."""
        inside = self.least[0] <= low and high <= self.least[1]
        return inside or high < self.least[0] or low > self.least[1]

    def words(self, factor: float) -> str:
        """The target, its values times `factor`."""
        return " / ".join(f"{low * factor:g} to {high * factor:g}" for low, high in (self.least, self.aim))


@dataclass(frozen=True)
class Score:
    """A figure over `n` cases, as text, with its target; `value` is None where there is nothing to count.

    `limits` is the 95 % interval of the figure, if it has one.
    """

    name: str
    text: str
    n: int
    value: float | None = None
    target: Target | Band | None = None
    limits: tuple[float, float] | None = None
    percent: bool = True

    @staticmethod
    def share(name: str, share: Share, target: Target | Band | None = None) -> "Score":
        """A share with Wilson's interval."""
        return Score(name, str(share), share.n, share.value, target, share.interval if share.n else None)

    @property
    def wanted(self) -> str:
        """The target in words."""
        if self.target is None:
            return ""
        return self.target.words(100) + " %" if self.percent else self.target.words(1)

    @property
    def reached(self) -> str:
        """`missed`, `met` or `aim met`; with a note if the interval leaves open whether the promise holds."""
        if self.target is None or self.value is None:
            return ""
        found = self.target.reached(self.value)
        certain = self.limits is None or self.target.is_certain(*self.limits)
        return found if certain else f"{found}, not certain"
