"""Outcomes as one HTML file that needs no network and no script."""

from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version

from fmus.units import after_number
from orchestrator.regress.comparison import SignalVerdict
from orchestrator.regress.figures import curve_figure
from orchestrator.regress.outcome import Outcome
from orchestrator.report.html import render
from orchestrator.report.numbers import quantity
from orchestrator.report.page import Page, PageTable, Picture, Section
from orchestrator.report.summary import Fact

# A page with more pictures takes longer to draw than the cases to run.
_MOST_PICTURES = 40


def page(outcomes: Sequence[Outcome]) -> str:
    """The page: what failed first, with pictures; then every case, and every comparison."""
    wrong = [each for each in outcomes if each.verdict != "passed"]
    verdict = (
        f"{len(outcomes)} cases, all passed" if not wrong else f"{len(wrong)} of {len(outcomes)} cases did not pass"
    )
    left = _MOST_PICTURES
    sections = []
    for outcome in wrong:
        shown = outcome.curves[:left]
        left -= len(shown)
        sections.append(_failed(outcome, shown))
    sections += [
        Section("All cases", tables=(_cases(outcomes),)),
        Section("All comparisons", tables=_comparisons(outcomes)),
    ]
    made = (("misfit", version("misfit-fmu")), ("made", datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")))
    sections.append(Section("Provenance", pairs=(*made, *_models(outcomes))))
    return render(Page("Regression tests", verdict, None, tuple(sections), facts=_facts(outcomes)))


def _facts(outcomes: Sequence[Outcome]) -> tuple[Fact, ...]:
    """How many of each verdict, and how long it took."""
    counts = {verdict: sum(each.verdict == verdict for each in outcomes) for verdict in ("passed", "failed", "error")}
    took = quantity(sum(each.took_s for each in outcomes), "s")
    return (
        Fact("Passed", str(counts["passed"]), f"of {len(outcomes)} cases", "good" if counts["passed"] else ""),
        Fact("Failed", str(counts["failed"]), "differ from what was expected", "bad" if counts["failed"] else ""),
        Fact(
            "Not run", str(counts["error"]), "a component or the case itself failed", "bad" if counts["error"] else ""
        ),
        Fact("Time", took, "of the clock, over all cases"),
    )


def _failed(outcome: Outcome, shown: Sequence[object]) -> Section:
    verdicts = {each.name: each for each in outcome.signals if not each.passed}
    texts = [outcome.reason, *(f"{each.check}: {each.reason}" for each in outcome.wholes if not each.passed)]
    pictures = [
        Picture(curve_figure(curve, verdicts.get(curve.name)), f"{curve.name}: {_reason(verdicts.get(curve.name))}")
        for curve in outcome.curves[: len(shown)]
    ]
    pairs = (("file", outcome.file), *((("compared with", outcome.where),) if outcome.where else ()))
    tables = _comparisons([outcome])
    return Section(
        f"{outcome.name}: {outcome.verdict}", tuple(dict.fromkeys(texts)), pairs, tables, tuple(pictures), True
    )


def _reason(verdict: SignalVerdict | None) -> str:
    return "" if verdict is None else verdict.reason


def _cases(outcomes: Sequence[Outcome]) -> PageTable:
    rows = tuple((each.name, each.verdict, f"{each.took_s:.2g} s", each.file, each.reason) for each in outcomes)
    return PageTable("Cases", ("case", "verdict", "time", "file", "why"), rows)


def _comparisons(outcomes: Sequence[Outcome]) -> tuple[PageTable, ...]:
    rows = []
    for outcome in outcomes:
        for each in outcome.signals:
            passing = "" if each.would_have_passed is None else f"{each.would_have_passed:.4g}{after_number(each.unit)}"
            verdict = "passed" if each.passed else "failed"
            rows.append((outcome.name, each.name, each.check, verdict, each.tolerance, passing, each.reason))
        for whole in outcome.wholes:
            rows.append((outcome.name, "", whole.check, "passed" if whole.passed else "failed", "", "", whole.reason))
    headings = ("case", "signal", "check", "verdict", "tolerance", "would have passed", "what was found")
    return (PageTable("Comparisons", headings, tuple(rows)),) if rows else ()


def _models(outcomes: Sequence[Outcome]) -> tuple[tuple[str, str], ...]:
    return tuple((each.name, f"sha256 {each.model_sha256}") for each in outcomes if each.model_sha256)
