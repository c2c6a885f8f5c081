"""The study as a JSON document, `misfit.study/1`. Improvements and their spreads are in percent, forces in N."""

from dataclasses import asdict
from typing import Any

from orchestrator.study import published
from orchestrator.study.muscles import MUSCLES
from orchestrator.study.researcher import SETS
from orchestrator.study.study import GROWTHS, LIMITS, Study
from orchestrator.study.summary import (
    MAIN,
    bars,
    chosen,
    drawn,
    improvements,
    lines,
    over,
    strong_mean,
)
from orchestrator.study.variants import VARIANTS


def document(study: Study, seconds: float) -> dict[str, Any]:
    """Plain data, ready for JSON; single numbers are medians over the seeds."""
    return {
        "schema": "misfit.study/1",
        "seeds": list(study.seeds),
        "draws": study.draws,
        "unit": "%",
        "corrections": {**_regression(study, LIMITS[0], goal=False), "goal": _regression(study, LIMITS[0], goal=True)},
        "improvement": _growth(study, *MAIN),
        "published": {
            "corrections": published.REGRESSION,
            "improvement": published.IMPROVEMENT,
            "in_words": published.IN_WORDS,
        },
        "growth": [
            {"variant": variant, "initial": initial, "improvement": _growth(study, variant, initial)}
            for variant, initial in GROWTHS
        ],
        "variants": [
            _variant(study, name, initial, limit) for limit in LIMITS for initial in SETS for name in VARIANTS
        ],
        "hard_case": _regression(study, LIMITS[1], goal=False),
        "bars": [
            {
                "claim": bar.claim,
                "found": bar.found,
                "low": bar.low,
                "high": None if bar.high == float("inf") else bar.high,
                "met": bar.met,
            }
            for bar in bars(study)
        ],
        "seconds": seconds,
    }


def _regression(study: Study, limit: float, goal: bool) -> dict[str, Any]:
    found = lines(study, limit, goal)
    return {
        "n": found[0].n,
        "limit_N": limit,
        **{name: over(getattr(line, name) for line in found).median for name in ("slope", "intercept", "r2")},
        "seeds": [asdict(line) for line in found],
    }


def _growth(study: Study, variant: str, initial: str) -> dict[str, Any]:
    table = drawn(study, variant, initial)
    return {muscle: {size: asdict(each) for size, each in sizes.items()} for muscle, sizes in table.items()}


def _variant(study: Study, name: str, initial: str, limit: float) -> dict[str, Any]:
    cases = chosen(study, name, initial, limit)
    values = [case.outcome.value for case in cases if case.outcome.value is not None]
    covered = [case.outcome.coverage for case in cases if case.outcome.coverage is not None]
    return {
        "variant": name,
        "initial": initial,
        "limit_N": limit,
        "used": over(float(case.outcome.used) for case in cases).median,
        "strong_four": asdict(strong_mean(cases)),
        "improvement": {
            muscle: {**asdict(each), "seeds": [100.0 * float(case.outcome.improvement[k]) for case in cases]}
            for k, (muscle, each) in enumerate(zip(MUSCLES, improvements(cases), strict=True))
        },
        "minus_log_likelihood": over(values).median if values else None,
        "coverage_90": over(covered).median if covered else None,
    }
