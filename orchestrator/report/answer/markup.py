"""The first screen as HTML, the same for the studio, reports and notebooks."""

import html
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from orchestrator.report.answer.answer import Answer
from orchestrator.report.answer.drawing import NARROW, WIDE, bars_svg, residual_svg, witness_svg
from orchestrator.report.answer.formulas import formula_lines
from orchestrator.report.answer.residual import worst_residual
from orchestrator.report.answer.rivals import Rival
from orchestrator.report.answer.witness import shape_words, stated, witnesses_of
from orchestrator.report.answer.words import capital
from orchestrator.report.numbers import unbroken

# Formulas that have room beside each other.
MOST_LAWS = 3


def answer_style() -> str:
    """The style sheet of the screen; it needs the variables of the palette."""
    return Path(__file__).with_name("answer.css").read_text()


def verdict_html(answer: Answer) -> str:
    """The sentence, its figures, and what is next."""
    parts = [f"<h2>{_text(answer.headline)}</h2>"]
    if answer.detail or answer.caution:
        caution = f' <span class="a-caution">{_text(answer.caution)}</span>' if answer.caution else ""
        parts.append(f'<p class="a-detail">{_text(answer.detail)}{caution}</p>')
    parts.append(f'<p><span class="a-next">Next:</span> {_text(answer.next_step)}</p>')
    return "".join(parts)


def _text(sentence: str) -> str:
    return html.escape(unbroken(sentence))


def evidence_html(answer: Answer, document: Mapping[str, Any]) -> str:
    """The four parts below: why, what it buys, where it failed, what else it could be."""
    parts = [_why(document), _laws(document), _buys(answer), _failed(document), _rivals(answer)]
    return f'<div class="a-grid-of-four">{"".join(part for part in parts if part)}</div>'


def answer_html(answer: Answer, document: Mapping[str, Any]) -> str:
    """All of it as one part of a page."""
    return f'<div class="answer"><div class="a-verdict">{verdict_html(answer)}</div>{evidence_html(answer, document)}</div>'


def _why(document: Mapping[str, Any]) -> str:
    found = witnesses_of(document)
    if not found or document.get("verdict") == "adequate":
        return ""
    if len(found) > 1:
        panels = f'<div class="a-panels">{"".join(f"<div>{witness_svg(each)}</div>" for each in found)}</div>'
    else:
        panels = _either(lambda narrow: witness_svg(found[0], NARROW if narrow else WIDE))
    line = " Line: the effect that was fitted." if any(each.law for each in found) else ""
    note = f"Dots: what the model lacks, from learning trials, with 90 % bands.{line}"
    return _section(f"Why: {shape_words(found)}", panels + _small(note))


def _laws(document: Mapping[str, Any]) -> str:
    """What is proposed where no card explains all: each law over the missing force, and words for each."""
    laws = document.get("laws") or ()
    if not laws:
        return ""
    curves = [(law["formula"], stated(law["curve"])) for law in laws[:MOST_LAWS] if law.get("curve")]
    panels = "".join(f"<div>{witness_svg(curve)}{_small(formula)}</div>" for formula, curve in curves if curve)
    drawn = f'<div class="a-panels">{panels}</div>' if panels else ""
    lines = "".join(f"<p>{html.escape(line)}</p>" for line in formula_lines(document))
    return _section("A formula for what no card explains", drawn + lines)


def _buys(answer: Answer) -> str:
    if not answer.bars:
        return ""
    heading = "What it buys, on trials never used for learning" if len(answer.bars) > 2 else "How far the model is off"
    drawn = _either(partial(bars_svg, answer.bars))
    return _section(heading, drawn + _small("Error as a multiple of the noise floor; linear scale."))


def _failed(document: Mapping[str, Any]) -> str:
    found = worst_residual(document)
    if found is None:
        return ""
    heading = "Where it failed, before and after" if found.after is not None else "Where the error is largest"
    drawn = _either(partial(residual_svg, found))
    return _section(heading, drawn + _small("The held-out trial with the largest error; grey: the noise."))


def _rivals(answer: Answer) -> str:
    if not answer.rivals:
        return ""
    odds = any(rival.odds for rival in answer.rivals)
    names = ("effect", "odds against it", "why") if odds else ("effect", "why")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    body = "".join(_row(rival, odds) for rival in answer.rivals)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    heading = "What else it could be" if answer.rivals[0].named else "What it could be"
    return _section(heading, table + (_small(answer.not_tried) if answer.not_tried else ""))


def _row(rival: Rival, odds: bool) -> str:
    kind = ' class="a-named"' if rival.named else ""
    first = f'<td class="a-odds">{html.escape(rival.odds)}</td>' if odds else ""
    return f'<tr{kind}><th scope="row">{html.escape(rival.name)}</th>{first}<td>{html.escape(unbroken(rival.reason))}</td></tr>'


def _either(draw: Callable[[bool], str]) -> str:
    """A picture for a column of a page and the same for a phone; answer.css shows the one that has its letters' size."""
    return f'<div class="a-wide">{draw(False)}</div><div class="a-narrow">{draw(True)}</div>'


def _section(heading: str, content: str) -> str:
    return f"<section><h3>{html.escape(capital(heading))}</h3>{content}</section>"


def _small(text: str) -> str:
    return f'<p class="a-small">{html.escape(text)}</p>'
