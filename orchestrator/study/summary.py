"""Numbers over the seeds: median and range of everything, and the bars that were set before."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from orchestrator.study.muscles import MUSCLES, STRONG, WEAK
from orchestrator.study.regression import Line
from orchestrator.study.study import LIMITS, Case, Growth, Study

Array = NDArray[Any]
# The honest best: motion's own force taken off, corrections at the ends left out, all hyperparameters fitted to bench data and corrections
# together. The paper's own formulation, the joint posterior with the hyperparameters of the bench data, is reported beside it.
MAIN = ("refitted", "small")
PAPER = ("joint", "small")
# What improvements must reach, and what no muscle may lose, %.
STRONG_FOUR, NO_LOSS = 35.0, -5.0


@dataclass(frozen=True)
class Over:
    """Over the seeds: median, range, and the mean with its 90 % interval (Student's distribution; the median's range for one seed)."""

    median: float
    low: float
    high: float
    mean: float
    ci90: tuple[float, float]


def over(numbers: Iterable[float]) -> Over:
    """Median and range of some numbers."""
    found = np.array(list(numbers))
    mean, reach = float(found.mean()), 0.0
    if len(found) > 1:
        reach = float(scipy.stats.t.ppf(0.95, len(found) - 1) * found.std(ddof=1) / np.sqrt(len(found)))
    return Over(float(np.median(found)), float(found.min()), float(found.max()), mean, (mean - reach, mean + reach))


def lines(study: Study, limit: float, goal: bool) -> list[Line]:
    """The regression of each seed, at the actual state or at the goal posture."""
    return [study.errors[seed, limit][int(goal)].line for seed in study.seeds]


def chosen(study: Study, variant: str, initial: str, limit: float = LIMITS[0]) -> list[Case]:
    """The cases of a variant, one a seed."""
    return [case for case in study.cases if (case.variant, case.initial, case.limit) == (variant, initial, limit)]


def improvements(cases: Sequence[Case]) -> list[Over]:
    """Improvement of each muscle over the seeds, percent."""
    table = 100.0 * np.array([case.outcome.improvement for case in cases])
    return [over(column) for column in table.T]


def strong_mean(cases: Sequence[Case]) -> Over:
    """Mean improvement of the four strong muscles, over the seeds, percent."""
    return over(100.0 * float(case.outcome.improvement[list(STRONG)].mean()) for case in cases)


@dataclass(frozen=True)
class Drawn:
    """Improvement of a muscle for a number of corrections, percent, each the median over the seeds of what draws give.

    `mean` and `sd` are of the draws, `se` the standard error of the mean; `low` and `high` are the range of the mean over seeds.
    """

    mean: float
    se: float
    sd: float
    low: float
    high: float


def drawn(study: Study, variant: str, initial: str) -> dict[str, dict[str, Drawn]]:
    """By muscle and number of corrections. All corrections are one set, not a draw: their spread over draws is zero."""
    growths = growths_of(study, variant, initial)
    found: dict[str, dict[str, Drawn]] = {muscle: {} for muscle in MUSCLES}
    for m, muscle in enumerate(MUSCLES):
        for k, size in enumerate(growths[0].sizes):
            found[muscle][str(size)] = _drawn([100.0 * growth.improvement[:, k, m] for growth in growths])
        whole = over(100.0 * float(growth.whole[m]) for growth in growths)
        found[muscle][str(study.count)] = Drawn(whole.median, 0.0, 0.0, whole.low, whole.high)
    return found


def _drawn(samples: Sequence[Array]) -> Drawn:
    means = over(float(each.mean()) for each in samples)
    deviations = [float(each.std(ddof=1)) if len(each) > 1 else 0.0 for each in samples]
    errors = [deviation / np.sqrt(len(each)) for deviation, each in zip(deviations, samples, strict=True)]
    return Drawn(means.median, float(np.median(errors)), float(np.median(deviations)), means.low, means.high)


def growths_of(study: Study, variant: str, initial: str) -> list[Growth]:
    """The draws of a variant, one a seed."""
    return [growth for growth in study.growths if (growth.variant, growth.initial) == (variant, initial)]


@dataclass(frozen=True)
class Bar:
    """Something that had to be shown: what was found (the median over the seeds) and between what it had to be."""

    claim: str
    found: float
    low: float
    high: float

    @property
    def met(self) -> bool:
        """Whether it was."""
        return self.low <= self.found <= self.high


def bars(study: Study) -> list[Bar]:
    """The acceptance numbers, of the honest best unless said otherwise; joint speeds count in the paper's formulation."""
    inf = float("inf")
    actual = lines(study, LIMITS[0], goal=False)
    main, paper = chosen(study, *MAIN), chosen(study, *PAPER)
    each = improvements(main)
    blind = strong_mean(chosen(study, "without velocity", "small"))
    found = [
        Bar(
            "slope of error against required force, actual state",
            over(line.slope for line in actual).median,
            0.85,
            1.15,
        ),
        Bar("R2 of it", over(line.r2 for line in actual).median, 0.70, 0.90),
        Bar("mean improvement of the four strong muscles, %", strong_mean(main).median, STRONG_FOUR, inf),
        Bar("least improvement of a strong muscle, %", min(each[k].median for k in STRONG), 10.0, inf),
        Bar("least improvement of the weak pair, %", min(each[k].median for k in WEAK), NO_LOSS, inf),
        Bar("least improvement of any muscle in any seed, %", min(muscle.low for muscle in each), NO_LOSS, inf),
        Bar(
            "paper's formulation: mean improvement of the four strong muscles, %", strong_mean(paper).median, 25.0, inf
        ),
        Bar("cost of leaving out joint speeds, points", strong_mean(paper).median - blind.median, 15.0, inf),
    ]
    hardest = chosen(study, *MAIN, LIMITS[1])
    weak_ones = f"caregivers of {LIMITS[1]:g} N"
    found.append(
        Bar(
            f"{weak_ones}: mean improvement of the four strong muscles, %",
            strong_mean(hardest).median,
            STRONG_FOUR,
            inf,
        )
    )
    worst = min(muscle.low for muscle in improvements(hardest))
    found.append(Bar(f"{weak_ones}: least improvement of any muscle in any seed, %", worst, NO_LOSS, inf))
    for variant in ("joint", "clear of stops", "compensated", "refitted"):
        hard = improvements(chosen(study, variant, "small", LIMITS[1]))
        least = min(muscle.median for muscle in hard)
        found.append(Bar(f"{weak_ones}, {variant}: least improvement of a muscle, %", least, NO_LOSS, inf))
    return found
