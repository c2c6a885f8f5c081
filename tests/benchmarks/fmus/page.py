"""The page of the gate: counts first, then a row for each FMU, with the reason of each failure in one line."""

import re
from collections.abc import Iterator, Mapping, Sequence
from tempfile import gettempdir
from typing import Any

Row = Mapping[str, Any]
TRIED = ("validate", "run", "repeat", "swap", "regress")
# Nearer than that, two simulators agree.
AGREES = 1e-6


def page(rows: Sequence[Row], structures: Sequence[Row], skipped: int = 0) -> str:
    """The whole page as Markdown."""
    return "\n".join(_lines(rows, structures, skipped)) + "\n"


def _lines(rows: Sequence[Row], structures: Sequence[Row], skipped: int) -> Iterator[str]:
    yield "# Public FMUs"
    yield ""
    yield "Written by `make bench-fmus FMUS=FOLDER`: each FMU of a folder is validated, run, run again without isolation, swapped"
    yield "for itself and put under regression; FMPy runs the same experiment. Files with equal content count once. None of them is"
    yield "shipped with misfit. The difference to FMPy is the largest of all outputs, as a share of the signal's largest value."
    yield ""
    yield "Sources: " + ", ".join(dict.fromkeys(row["source"].replace("+", "/") for row in (*rows, *structures))) + "."
    yield ""
    yield from _counts(rows, structures, skipped)
    yield from (
        "",
        "## Each tool",
        "",
        "| tool | FMI | FMUs | run here | run by FMPy | of these, agree or have no outputs |",
    )
    yield "|---|---|---|---|---|---|"
    yield from _tools(rows)
    yield ""
    yield "## Each FMU"
    yield ""
    yield "| FMU | tool | FMI | validate | run | FMPy | difference | repeat | swap | regress |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for row in rows:
        cells = [row["file"], row.get("tool", ""), row.get("version", ""), row.get("validate", "")]
        cells += [row.get("run", ""), row.get("fmpy", ""), _number(row.get("difference"))]
        yield "| " + " | ".join(_cell(each) for each in (*cells, *(row.get(name, "") for name in TRIED[2:]))) + " |"
    if structures:
        yield from ("", "## Each system structure", "", "| file | components | read |", "|---|---|---|")
        for row in structures:
            yield f"| {_cell(row['file'])} | {row.get('components', '')} | {_cell(row['read'])} |"


def _counts(rows: Sequence[Row], structures: Sequence[Row], skipped: int) -> Iterator[str]:
    theirs = [row for row in rows if row.get("fmpy") == "ok"]
    both = [row for row in theirs if row.get("run") == "ok"]
    near = [row for row in both if row.get("difference") is not None and row["difference"] <= AGREES]
    yield "| what | count |"
    yield "|---|---|"
    yield f"| FMUs | {len(rows)} |"
    if skipped:
        yield f"| FMUs that were not begun, for lack of time | {skipped} |"
    yield f"| run here | {sum(row.get('run') == 'ok' for row in rows)} |"
    yield f"| run by FMPy | {len(theirs)} |"
    yield f"| run by FMPy and here | {len(both)} |"
    yield f"| of these, with outputs that agree to {AGREES:g} | {len(near)} |"
    yield f"| of these, without outputs to compare | {sum(row.get('difference') is None for row in both)} |"
    compared = [row for row in both if row.get("reference") is not None and row.get("fmpy_reference") is not None]
    if compared:
        better = sum(row["reference"] <= max(row["fmpy_reference"] * 1.001, AGREES) for row in compared)
        yield f"| with reference results beside them | {len(compared)} |"
        yield f"| of these, as near to the reference as FMPy | {better} |"
    for name in TRIED:
        if name != "run":
            yield f"| {name}: without a word | {sum(row.get(name) == 'ok' for row in rows)} |"
    yield f"| system structures | {len(structures)} |"
    yield f"| of these, read | {sum(row['read'] == 'ok' for row in structures)} |"


def _tools(rows: Sequence[Row]) -> Iterator[str]:
    """A row for each tool, as it calls itself and its version, and version of FMI."""
    of: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        of.setdefault((row.get("tool") or "not said", row.get("version") or "not read"), []).append(row)
    for (tool, version), made in sorted(of.items()):
        theirs = [row for row in made if row.get("fmpy") == "ok"]
        near = [row for row in theirs if row.get("run") == "ok" and (row.get("difference") or 0.0) <= AGREES]
        run = sum(row.get("run") == "ok" for row in made)
        yield f"| {_cell(tool)} | {version} | {len(made)} | {run} | {len(theirs)} | {len(near)} |"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def _cell(text: object) -> str:
    words = " ".join(str(text).replace("|", "/").split())
    words = re.sub(re.escape(gettempdir()) + r"/(\S+/)?", "", words)  # folders that were there for a moment
    return words if len(words) <= 160 else f"{words[:157]}..."
