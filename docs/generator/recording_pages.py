"""The gallery of real recordings: a page each, from what `record_recordings` measured, with pictures drawn by the build."""

import json
import re
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from orchestrator.report.answer import answer_of
from orchestrator.report.answer.drawing import bars_svg, witness_svg
from orchestrator.report.answer.markup import answer_style
from orchestrator.report.answer.witness import shape_words, witnesses_of
from orchestrator.report.answer.words import capital
from orchestrator.report.numbers import digits
from orchestrator.report.palette import css_variables

FOLDER = Path(__file__).parents[1] / "assets" / "recordings"
WORDS = Path(__file__).with_name("recordings.toml")


@cache
def recordings() -> dict[str, tuple[Mapping[str, str], Mapping[str, Any]]]:
    """The words and the recorded diagnosis of each page, in the order of the gallery."""
    words = tomllib.loads(WORDS.read_text())
    return {name: (text, json.loads((FOLDER / f"{name}.json").read_text())) for name, text in words.items()}


def pages() -> dict[str, str]:
    """Each page with its path."""
    return {"recordings/index.md": _index()} | {
        f"recordings/{name}.md": _page(name, words, document) for name, (words, document) in recordings().items()
    }


def pictures() -> dict[str, str]:
    """Each picture (SVG) with its path."""
    found = {}
    for name, (_, document) in recordings().items():
        for kind, svg in _drawn(document).items():
            found[f"recordings/img/{name}_{kind}.svg"] = standalone(svg)
    return found


def standalone(svg: str) -> str:
    """A picture of the first screen as a file of its own, light on white."""
    style = f"svg {{ background: #fff }} {css_variables('svg')} {answer_style()}"
    return svg.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1).replace(
        ">", f"><style>{style}</style>", 1
    )


def _drawn(document: Mapping[str, Any]) -> dict[str, str]:
    drawn = {"error": bars_svg(answer_of(document).bars)}
    return drawn | {f"force_{k}": witness_svg(each) for k, each in enumerate(witnesses_of(document), start=1)}


def _index() -> str:
    rows = []
    for name, (words, document) in recordings().items():
        answer = answer_of(document)
        errors = " → ".join(digits(bar.value) for bar in answer.bars[:-1])
        rows.append(f"| [{words['title']}]({name}.md) | {answer.headline} | {errors} |")
    return "\n".join([_INTRODUCTION, *rows, ""])


_INTRODUCTION = """# Real recordings

What was missing in this servo, this muscle, this drive, this tank? Each page shows one machine that somebody recorded: the
answer and what it buys, why, what was given to misfit, and the commands. Two recordings are shipped, so you can repeat these pages as they
are; for the others the page says where the data are. Errors are free runs along trials that were never used for learning, as multiples
of the sensor's noise.

| recording | answer | error, before → after |
|---|---|---|"""


def _page(name: str, words: Mapping[str, str], document: Mapping[str, Any]) -> str:
    answer, witnesses = answer_of(document), witnesses_of(document)
    drawn = _drawn(document)
    parts = [f"# {words['title']}", words["what"], f"**{answer.headline}** {answer.detail} {answer.caution}".strip()]
    parts.append(f"![{_alt(drawn['error'])}](img/{name}_error.svg)")
    if witnesses and document["verdict"] != "adequate":
        parts += ["## Why", f"{capital(shape_words(witnesses))}."]
        parts += [f"![{_alt(svg)}](img/{name}_{kind}.svg)" for kind, svg in drawn.items() if kind != "error"]
    parts += ["## What was given", f"{words['given']} {words['data']}"]
    if document["model_text"]:
        parts.append(f"```modelica\n{document['model_text'].strip()}\n```")
    data = (
        f"tests/cases/{name}"
        if not document["model_text"] and name in ("pendulum", "rat_muscle")
        else document["data_name"]
    )
    parts += ["## The commands", f"```text\nmisfit compare {document['model_name']} {data}"]
    parts[-1] += f"\nmisfit discover {document['model_name']} {data} --out found --html found.html\n```"
    parts.append(f"It took {document['seconds']:g} s. (misfit at commit {document['commit']}.)")
    if document["written"]:
        parts += ["## The model that was written", f"```modelica\n{document['written'].strip()}\n```"]
    parts += ["## What is known", words["known"]]
    return "\n\n".join(parts) + "\n"


def _alt(svg: str) -> str:
    found = re.search(r'aria-label="([^"]*)"', svg)
    return (found[1] if found else "").replace("[", "(").replace("]", ")")
