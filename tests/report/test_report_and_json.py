"""The page of a diagnosis and its JSON say the same: every number in a table of the page is in the JSON."""

import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import pytest

from orchestrator.library.cards import Candidate, effect_library
from orchestrator.report.html import comparison_report, diagnosis_report
from orchestrator.verdicts.open_questions import CollinearPair, Coverage
from orchestrator.verdicts.result import Diagnosis, Tried
from tests.report.builders import comparison, diagnosis

pytestmark = pytest.mark.usefixtures("blank_pictures")

PREFIXES = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
# Curves hold thousands of numbers, among which any would be found.
NOT_SEARCHED = ("curves", "latent_forces")


class Cells(HTMLParser):
    """Texts of the data cells of all tables."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self._inside = False
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._inside = tag == "td"
        if self._inside:
            self.texts.append("")

    def handle_endtag(self, tag: str) -> None:
        self._inside = False

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.texts[-1] += data


def leaves(value: Any, key: str = "") -> list[Any]:
    """Every text and number of a JSON document."""
    if isinstance(value, dict):
        inside = [leaves(part, name) for name, part in value.items() if name not in NOT_SEARCHED]
        return [leaf for part in inside for leaf in part]
    if isinstance(value, list):
        return [leaf for part in value for leaf in leaves(part)]
    return [value]


def unmatched(page: str, document: dict[str, Any]) -> list[str]:
    """Cells of a page with a number that no number of the document rounds to, and that are no text of it."""
    found = leaves(json.loads(json.dumps(document)))
    texts = " ".join(leaf for leaf in found if isinstance(leaf, str))
    numbers = [float(leaf) for leaf in found if isinstance(leaf, int | float) and not isinstance(leaf, bool)]
    # Odds are the ratio of two probabilities of the ranking.
    ranking = document.get("ranking", ())
    chances = [each["probability"] for each in ranking]
    numbers += [chances[0] / each for each in chances if each > 0] + [100 * each["score"] for each in ranking]
    return [cell for cell in Cells(page).texts if cell not in texts and not _is_known(cell, numbers)]


def _is_known(cell: str, numbers: list[float]) -> bool:
    scale = _scale(cell)
    return all(any(_rounds(text, known / scale) for known in numbers) for text in NUMBER.findall(_without_units(cell)))


def _without_units(cell: str) -> str:
    return re.sub(r"\[[^\d\s,.-]*\d*\]", "", cell)


def _scale(cell: str) -> float:
    """What the unit's prefix stands for."""
    unit = re.search(r" ([pnµmkMG]?)(?:rad|m|s|Hz|N|N\.m|kg)\b", cell)
    return PREFIXES[unit[1]] if unit else 1.0


def _rounds(text: str, value: float) -> bool:
    shown = float(text.replace("−", "-"))
    digits = len(text.lstrip("-−").replace(".", "").split("e")[0].lstrip("0")) or 1
    half = 0.5 * 10.0 ** (math.floor(math.log10(abs(shown))) + 1 - digits) if shown else 0.5e-6
    return abs(value - shown) <= 1.02 * half


def full_diagnosis() -> Diagnosis:
    """The made-up diagnosis with a row in every table."""
    cards = {card.id: card for card in effect_library()}
    coulomb, viscous = (
        Candidate(cards[name], "jointTorque1", "", "joint1") for name in ("coulomb_friction", "viscous_friction")
    )
    return replace(
        diagnosis(),
        tried=(Tried(("viscous_friction",), ("joint1",), "weighted error 1.07 (noise alone: 1): explains less"),),
        kin=(CollinearPair(coulomb, viscous, 0.9234, 37.6), CollinearPair(viscous, coulomb, 0.9876, 0.21)),
        excitation=(Coverage("coulomb_friction", "joint1", "at least 4 reversals of speed", 4, 12.0),),
    )


@pytest.fixture(scope="module")
def page() -> str:
    """The page of the diagnosis: its figures take two seconds to draw."""
    return diagnosis_report(full_diagnosis())


def test_numbers_in_the_tables_of_a_diagnosis_are_in_its_json(page: str) -> None:
    assert unmatched(page, full_diagnosis().to_json()) == []


def test_numbers_in_the_tables_of_a_comparison_are_in_its_json() -> None:
    found = comparison()

    assert unmatched(comparison_report(found), found.to_json()) == []


@pytest.mark.parametrize("part", ["kin", "excitation", "steps", "held_out", "effects"])
def test_number_that_the_json_lacks_is_found(page: str, part: str) -> None:
    found = full_diagnosis()
    document = {key: value for key, value in found.to_json().items() if key != part}
    if part in ("held_out", "effects"):
        del document["steps"]

    assert unmatched(page, document)


def test_verdict_comes_first_then_what_is_open_then_evidence_then_what_was_rejected(page: str) -> None:
    headings = re.findall(r"<h2\b[^>]*>(.*?)</h2>", page)
    assert headings[0].startswith("Coulomb friction at joint1")
    order = [
        "What is missing",
        "What the data leave open",
        "Where the model as given fails",
        "Tried and rejected",
        "Before, after and the noise floor",
    ]
    assert [heading for heading in headings if heading in order] == order
