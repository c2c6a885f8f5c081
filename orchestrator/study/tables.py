"""The study as tables of texts, for the terminal and for the report."""

from orchestrator.measurements.wording import counted
from orchestrator.report.page import PageTable
from orchestrator.report.summary import Fact
from orchestrator.study import published
from orchestrator.study.muscles import MUSCLES
from orchestrator.study.study import LIMITS, Study
from orchestrator.study.summary import (
    MAIN,
    Over,
    bars,
    chosen,
    drawn,
    improvements,
    lines,
    over,
    strong_mean,
)
from orchestrator.study.variants import VARIANTS

SHORT = ("ant", "post", "bic", "tri l", "tri s", "brach")


def regression_table(study: Study) -> PageTable:
    """Error of corrections against required force: median over the seeds, and range."""
    rows: list[tuple[str, ...]] = [
        ("published", f"{published.REGRESSION['slope']:g}", "", f"{published.REGRESSION['r2']:g}")
    ]
    for limit in LIMITS:
        for goal, where in ((False, "actual state"), (True, "goal posture")):
            found = lines(study, limit, goal)
            cells = (_range(over(getattr(line, name) for line in found), form) for name, form in _COLUMNS)
            rows.append((f"{where}, limit {limit:g} N", *cells))
    headings = ("perfect correction at", "slope", "intercept, N", "R2")
    return PageTable(
        "Error of a correction against required force, N: median (range) over the seeds", headings, tuple(rows)
    )


_COLUMNS = (("slope", ".2f"), ("intercept", ".0f"), ("r2", ".2f"))


def growth_table(study: Study, variant: str, initial: str) -> PageTable:
    """Improvement by the number of corrections, mean and standard deviation of draws, median over the seeds."""
    table = drawn(study, variant, initial)
    rows = []
    for muscle, sizes in table.items():
        *few, whole = sizes.values()
        cells = [f"{each.mean:.0f} ± {each.sd:.0f}" for each in few]
        paper = f"{published.IMPROVEMENT[muscle]:g}" if muscle in published.IMPROVEMENT else ""
        rows.append((muscle, *cells, f"{whole.mean:.0f} ({whole.low:.0f} to {whole.high:.0f})", paper))
    caption = f"Improvement in % by number of corrections, {variant}, {initial} initial set; with all: range over seeds"
    return PageTable(caption, ("muscle", *next(iter(table.values())), "published"), tuple(rows))


def variants_table(study: Study, initial: str, limit: float) -> PageTable:
    """Improvement with all corrections of every way to learn, medians over the seeds."""
    rows = []
    for name in VARIANTS:
        cases = chosen(study, name, initial, limit)
        mean = strong_mean(cases)
        used = over(float(case.outcome.used) for case in cases).median
        cells = (f"{each.median:.0f}" for each in improvements(cases))
        covered = [case.outcome.coverage for case in cases if case.outcome.coverage is not None]
        coverage = f"{100.0 * over(covered).median:.0f}" if covered else ""
        rows.append((name, f"{used:.0f}", *cells, _range(mean, ".0f"), coverage))
    caption = (
        f"Improvement in % with all corrections, {initial} initial set, limit {limit:g} N: medians over the seeds. "
        "Strong four: their mean, with its range. Inside: share in % of forces inside 90 % intervals predicted without their trial"
    )
    return PageTable(caption, ("way to learn", "used", *SHORT, "strong four", "inside"), tuple(rows))


def bars_table(study: Study) -> PageTable:
    """What had to be shown."""
    rows = []
    for bar in bars(study):
        wanted = f"{bar.low:g} or more" if bar.high == float("inf") else f"{bar.low:g} to {bar.high:g}"
        rows.append((bar.claim, f"{bar.found:.2f}", wanted, "met" if bar.met else "NOT met"))
    return PageTable("What had to be shown (medians over the seeds)", ("claim", "found", "bar", ""), tuple(rows))


def sentence(study: Study) -> str:
    """The result in one sentence."""
    actual = lines(study, LIMITS[0], goal=False)
    r2, slope = over(line.r2 for line in actual), over(line.slope for line in actual)
    main = strong_mean(chosen(study, *MAIN))
    missed = sum(not bar.met for bar in bars(study))
    return (
        f"Errors of {actual[0].n} corrections grow with the required force by {slope.median:.2f} (R2 {r2.median:.2f}; published "
        f"slope close to 1, R2 0.82); all of them improve the {len(MUSCLES) - 2} strong muscles by {main.median:.0f} % "
        f"(range {main.low:.0f} to {main.high:.0f} over {counted(len(study.seeds), 'seed')}; published 27 to 43 %). "
        + ("All bars are met." if not missed else f"{missed} of {len(bars(study))} bars are not met.")
    )


def facts(study: Study) -> tuple[Fact, ...]:
    """The result in a few numbers, medians with their range over the seeds."""
    slope = over(line.slope for line in lines(study, LIMITS[0], goal=False))
    main, found = strong_mean(chosen(study, *MAIN)), bars(study)
    met = sum(bar.met for bar in found)
    return (
        Fact(
            "Error per required force",
            f"{slope.median:.2f}",
            f"{slope.low:.2f} to {slope.high:.2f} over the seeds; published close to 1",
        ),
        Fact(
            "Strong muscles improve by",
            f"{main.median:.0f} %",
            f"{main.low:.0f} to {main.high:.0f} % over the seeds; published 27 to 43 %",
        ),
        Fact("Bars met", f"{met} of {len(found)}", "set before the study ran", "good" if met == len(found) else "bad"),
    )


def _range(found: Over, form: str) -> str:
    return f"{found.median:{form}} ({found.low:{form}}…{found.high:{form}})"
