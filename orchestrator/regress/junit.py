"""Outcomes as other tools read them: JUnit XML, and workflow commands that GitHub shows beside the changed files."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from orchestrator.regress.outcome import Outcome

# Characters that XML 1.0 cannot hold.
_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(outcomes: Sequence[Outcome]) -> str:
    """One test suite with a test case each; the class name is the case file, so that tools group by it."""
    count = {verdict: sum(each.verdict == verdict for each in outcomes) for verdict in ("failed", "error")}
    seconds = f"{sum(each.took_s for each in outcomes):.6f}"
    totals = {"tests": str(len(outcomes)), "failures": str(count["failed"]), "errors": str(count["error"])}
    root = ET.Element("testsuites", {"name": "misfit regress", **totals, "time": seconds})
    suite = ET.SubElement(root, "testsuite", {"name": "misfit regress", **totals, "skipped": "0", "time": seconds})
    for outcome in outcomes:
        _add(suite, outcome)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add(suite: ET.Element, outcome: Outcome) -> None:
    case = ET.SubElement(
        suite,
        "testcase",
        {"classname": _text(outcome.file), "name": _text(outcome.name), "time": f"{outcome.took_s:.6f}"},
    )
    if outcome.verdict != "passed":
        tag = "failure" if outcome.verdict == "failed" else "error"
        kind = "flaky" if outcome.flaky else outcome.problem or "difference"
        ET.SubElement(case, tag, {"message": _text(outcome.reason), "type": kind}).text = _text(
            "\n".join(lines(outcome))
        )
    if outcome.notes:
        ET.SubElement(case, "system-out").text = _text("\n".join(outcome.notes))


def lines(outcome: Outcome) -> list[str]:
    """What is wrong, a line for each check that did not pass."""
    found = [outcome.reason]
    found += [f"{each.name} ({each.check}): {each.reason}" for each in outcome.signals if not each.passed]
    found += [f"{each.check}: {each.reason}" for each in outcome.wholes if not each.passed]
    return found if len(found) != 2 else found[:1]


def _text(text: str) -> str:
    return _FORBIDDEN.sub("?", text)


def annotations(outcomes: Sequence[Outcome], folder: Path) -> list[str]:
    """One `::error` for each case that did not pass; files are relative to `folder`, as GitHub wants them.

    Example:
        >>> annotations([Outcome("ball", "m/ball.regress.toml", "failed", "h is off by 2 m")], Path())
        ['::error file=m/ball.regress.toml,line=1,title=misfit regress%3A ball failed::h is off by 2 m']
    """
    found = []
    for outcome in outcomes:
        if outcome.verdict == "passed":
            continue
        title = _property(f"misfit regress: {outcome.name} {outcome.verdict}")
        place = _property(_relative(outcome.file, folder))
        found.append(f"::error file={place},line=1,title={title}::{_data(outcome.reason)}")
    return found


def _relative(file: str, folder: Path) -> str:
    path = Path(file)
    try:
        return path.resolve().relative_to(folder.resolve()).as_posix() if path.is_absolute() else path.as_posix()
    except ValueError:
        return path.as_posix()


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
