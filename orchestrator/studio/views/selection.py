"""What is selected: trials, a range of time, a region of the state map."""

from dataclasses import dataclass

from fmus.errors import MisfitError


@dataclass(frozen=True)
class Range:
    """Values from `low` to `high`, both included.

    Example:
        >>> Range.of(2.0, -1.0)
        Range(low=-1.0, high=2.0)
    """

    low: float
    high: float

    @classmethod
    def of(cls, one: float, other: float) -> "Range":
        """The range between two values in any order."""
        return cls(min(one, other), max(one, other))

    @classmethod
    def entered(cls, low: float | None, high: float | None, what: str, unit: str) -> "Range":
        """The range that somebody typed.

        Raises:
            MisfitError: if an end is missing or they are the wrong way round.
        """
        if low is None or high is None:
            ends = ["nothing" if end is None else f"{end:g} {unit}" for end in (low, high)]
            raise MisfitError(f"{what} from {ends[0]} to {ends[1]}: an end is missing; enter both numbers")
        if not low < high:
            raise MisfitError(f"{what} from {low:g} to {high:g} {unit} is empty; enter a larger number at 'to'")
        return cls(low, high)


@dataclass(frozen=True)
class Region:
    """A box in the plane of two coordinates, named as in `orchestrator.compare.maps`, such as `q1` and `speed of q1`."""

    across: str
    across_range: Range
    along: str
    along_range: Range


@dataclass(frozen=True)
class Selection:
    """The samples of `trials` (places in the comparison; None for all) within `time`, in s, and within `region`."""

    trials: tuple[int, ...] | None = None
    time: Range | None = None
    region: Region | None = None

    @property
    def brushed(self) -> bool:
        """Whether less than whole trials is selected."""
        return self.time is not None or self.region is not None
