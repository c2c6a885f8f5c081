"""Write `docs/benchmarks/study.md` and its pictures from what `misfit study caregivers --json F --html F` wrote.

python tests/benchmarks/study/write_page.py study.json study.html docs/benchmarks
"""

import base64
import json
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

MUSCLES = ("anterior deltoid", "posterior deltoid", "biceps", "triceps long head", "triceps short head", "brachialis")
PICTURES = ("study_errors.png", "study_growth.png")


def main() -> None:
    """Write page and pictures into a folder."""
    document, page, folder = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2]).read_text(), Path(sys.argv[3])
    images = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
    for name, image in zip(PICTURES, images, strict=True):
        (folder / name).write_bytes(base64.b64decode(image))
    (folder / "study.md").write_text("\n\n".join(_parts(document)) + "\n")


def _parts(document: Mapping[str, Any]) -> Iterable[str]:
    seeds, draws = document["seeds"], document["draws"]
    yield "# The caregivers' study: all numbers"
    yield (
        f"Written by `tests/benchmarks/study/write_page.py` from `misfit study caregivers`: seeds {seeds[0]} to {seeds[-1]}, "
        f"{draws} draws of each size, {document['seconds']:.0f} s on a busy machine with two cores. Numbers are medians over the seeds, "
        "ranges over the seeds in brackets; improvements in %. [What it means](../study.md)."
    )
    yield "## What had to be shown"
    yield _table(("claim", "found", "bar", ""), [_bar(bar) for bar in document["bars"]])
    yield "## Error of a correction against the required force"
    yield _table(("perfect correction at", "slope", "intercept, N", "R2"), list(_lines(document)))
    yield f"![Errors of corrections against the required force]({PICTURES[0]})"
    yield "## Improvement by the number of corrections"
    yield f"![Improvement by the number of corrections]({PICTURES[1]})"
    for growth in document["growth"]:
        yield f"`{growth['variant']}`, {growth['initial']} initial set: mean ± standard deviation of one draw; with all: range over the seeds."
        yield _growth(document, growth["improvement"])
    yield "## Ways to learn, with all corrections"
    for limit in dict.fromkeys(each["limit_N"] for each in document["variants"]):
        for initial in dict.fromkeys(each["initial"] for each in document["variants"]):
            rows = [e for e in document["variants"] if (e["limit_N"], e["initial"]) == (limit, initial)]
            yield f"Median strength {limit:g} N, {initial} initial set."
            yield _variants(rows)


def _bar(bar: Mapping[str, Any]) -> Sequence[str]:
    wanted = f"{bar['low']:g} or more" if bar["high"] is None else f"{bar['low']:g} to {bar['high']:g}"
    return bar["claim"], f"{bar['found']:.2f}", wanted, "met" if bar["met"] else "**not met**"


def _lines(document: Mapping[str, Any]) -> Iterable[Sequence[str]]:
    yield "published", "close to 1", "", "0.82"
    found, hard = document["corrections"], document["hard_case"]
    yield "actual state", *_over_seeds(found)
    yield "goal posture", *_over_seeds(found["goal"])
    yield f"actual state, caregivers of {hard['limit_N']:g} N", *_over_seeds(hard)


def _over_seeds(line: Mapping[str, Any]) -> Iterable[str]:
    for name, form in (("slope", ".2f"), ("intercept", ".0f"), ("r2", ".2f")):
        values = [seed[name] for seed in line["seeds"]]
        yield f"{line[name]:{form}} ({min(values):{form}}…{max(values):{form}})"


def _growth(document: Mapping[str, Any], table: Mapping[str, Any]) -> str:
    paper = document["published"]["improvement"]
    rows = []
    for muscle in MUSCLES:
        *few, whole = table[muscle].values()
        cells = [f"{each['mean']:.1f} ± {each['sd']:.1f}" for each in few]
        rows.append((muscle, *cells, _range(whole, "mean"), f"{paper[muscle]:g}" if muscle in paper else ""))
    return _table(("muscle", *table[MUSCLES[0]], "published"), rows)


def _variants(found: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for each in found:
        cells = [_range(each["improvement"][muscle], "median") for muscle in MUSCLES]
        inside = "" if each["coverage_90"] is None else f"{100 * each['coverage_90']:.0f}"
        value = "" if each["minus_log_likelihood"] is None else f"{each['minus_log_likelihood']:.0f}"
        rows.append((each["variant"], f"{each['used']:.0f}", *cells, *_with_mean(each["strong_four"]), inside, value))
    return _table(
        (
            "way to learn",
            "used",
            *MUSCLES,
            "strong four",
            "mean, 90 % interval",
            "in 90 % intervals, %",
            "-log likelihood",
        ),
        rows,
    )


def _range(found: Mapping[str, float], middle: str) -> str:
    return f"{found[middle]:.0f} ({found['low']:.0f}…{found['high']:.0f})"


def _with_mean(found: Mapping[str, Any]) -> tuple[str, str]:
    """Median with range, and mean with its 90 % interval over the seeds."""
    return _range(found, "median"), f"{found['mean']:.0f} ({found['ci90'][0]:.0f}…{found['ci90'][1]:.0f})"


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    main()
