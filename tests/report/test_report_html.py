"""Pages need nothing from outside, escape what users named, and show the numbers of the result."""

import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from builders import blank, comparison, diagnosis, entries

from orchestrator.compare.result import Comparison
from orchestrator.report.html import comparison_report, diagnosis_report, discovery_report, ledger_report
from orchestrator.report.numbers import estimate_parts, quantity

HOSTILE = "<script>alert('$x$')</script>&\"\n\x00日本.csv"


class Page(HTMLParser):
    """The elements of a page: tags with attributes, and the text outside `<style>` and `<script>`."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(source)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))

    def handle_data(self, data: str) -> None:
        if self.cdata_elem is None:
            self.text += data

    def alternatives(self) -> list[str]:
        return [attributes["alt"] or "" for tag, attributes in self.elements if tag == "img"]


@pytest.fixture(scope="module")
def large() -> str:
    """A discovery whose trials have more samples than a picture shows."""
    found = diagnosis(n=2500)
    return discovery_report(found, entries(found))


@pytest.fixture(scope="module")
def pages(large: str) -> dict[str, Page]:
    found = diagnosis()
    drawn = {"comparison": Page(comparison_report(found.steps[0].comparison)), "discovery": Page(large)}
    with blank():
        # Its pictures are those of the discovery, but for one.
        return drawn | {"diagnosis": Page(diagnosis_report(found))}


KINDS = pytest.mark.parametrize("kind", ["comparison", "diagnosis", "discovery"])


@KINDS
def test_a_page_fetches_nothing(pages: dict[str, Page], kind: str) -> None:
    for tag, attributes in pages[kind].elements:
        assert tag not in ("script", "link", "iframe", "object")
        assert "src" not in attributes or str(attributes["src"]).startswith("data:image/png;base64,")
        assert str(attributes.get("href", "#")).startswith("#")
        assert "style" not in attributes


@KINDS
def test_a_page_forbids_what_it_does_not_need(pages: dict[str, Page], kind: str) -> None:
    policies = [a["content"] for tag, a in pages[kind].elements if tag == "meta" and "http-equiv" in a]

    assert policies == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]


@KINDS
def test_every_image_says_what_it_shows_with_numbers(pages: dict[str, Page], kind: str) -> None:
    texts = pages[kind].alternatives()

    assert len(texts) >= 7
    assert all(any(character.isdigit() for character in text) for text in texts)


@KINDS
def test_headings_never_skip_a_level(pages: dict[str, Page], kind: str) -> None:
    levels = [int(tag[1]) for tag, _ in pages[kind].elements if tag in ("h1", "h2", "h3", "h4")]

    assert levels[0] == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))


def test_the_comparison_shows_the_error_of_every_trial(pages: dict[str, Page]) -> None:
    for trial in comparison().trials:
        assert trial.file in pages["comparison"].text
        assert all(quantity(value, "rad") in pages["comparison"].text for value in trial.rmse.values())


@pytest.mark.parametrize("kind", ["diagnosis", "discovery"])
def test_the_effects_table_shows_values_units_and_intervals(pages: dict[str, Page], kind: str) -> None:
    for effect in diagnosis().effects:
        for name, found in effect.parameters.items():
            value, interval = estimate_parts(found)
            assert "".join((name, value, found.unit, interval)) in pages[kind].text


def test_the_held_out_table_shows_before_after_and_floor(pages: dict[str, Page]) -> None:
    held_out = diagnosis().held_out
    for signal, before in held_out.rmse_before.items():
        after, floor = held_out.rmse_after[signal], held_out.noise_floor[signal]
        row = signal + "".join(quantity(value, "rad") for value in (before, after, floor))
        assert row in pages["diagnosis"].text


def test_the_errors_of_a_set_say_which_model_they_belong_to(pages: dict[str, Page]) -> None:
    assert "Error (rms) of each set, with the effects added" in pages["diagnosis"].text


def test_the_discovery_shows_versions_and_content_hashes(pages: dict[str, Page]) -> None:
    for entry in entries(diagnosis()):
        assert entry.name in pages["discovery"].text
        assert entry.model_hash in pages["discovery"].text


def test_the_falling_error_comes_before_everything_else(pages: dict[str, Page]) -> None:
    first = pages["discovery"].alternatives()[0]

    assert first.startswith("Error on held-out trials as a multiple of the noise floor")
    assert "Arm_2" in first


def small(**changes: Any) -> Comparison:
    """The smallest comparison with both sets: fewer figures make a faster test."""
    return comparison(**({"n": 100, "n_learning": 1, "n_held_out": 1} | changes))


def _renamed(found: Comparison) -> Comparison:
    return replace(
        found,
        model=HOSTILE,
        data=HOSTILE,
        findings=(HOSTILE,),
        notes=(HOSTILE,),
        trials=tuple(replace(trial, file=HOSTILE) for trial in found.trials),
        curves=tuple(replace(curves, file=HOSTILE) for curves in found.curves),
    )


def test_a_hostile_file_name_is_text_and_never_markup() -> None:
    page = Page(comparison_report(_renamed(small())))

    assert all(tag != "script" for tag, _ in page.elements)
    assert "<script>alert('$x$')</script>" in page.text
    assert any("<script>alert" in text for text in page.alternatives())


def test_a_hostile_signal_unit_and_effect_are_text_too() -> None:
    found = small(n_held_out=0, signals=(HOSTILE, "$\\frac$"))
    found = replace(found, units=dict.fromkeys(found.signals, "<b>$"))

    page = Page(comparison_report(found))

    assert all(tag not in ("script", "b") for tag, _ in page.elements)


def _extra_keys(found: Comparison) -> Comparison:
    where: dict[str, list[dict[str, Any]]] = {
        "signal": [{"signal": "q1", "mood": "bad"}],
        "time": [],
        "state": [{"rmse": None}],
        "new": [{"x": 1.5}],
    }
    return replace(found, where=where)


@pytest.mark.parametrize(
    "unusual",
    [
        lambda: small(signals=tuple(f"s{i}" for i in range(5)), n_held_out=0),
        lambda: small(amplitude=0.0, n_held_out=0),
        lambda: small(amplitude=0.0, error=0.0, signals=("q1",)),
        lambda: replace(small(signals=("q1",)), noise_floor={"q1": 0.0}),
        lambda: replace(small(), curves=()),
        lambda: replace(_extra_keys(small()), curves=()),
        lambda: replace(small(), findings=(), notes=(), where={}, curves=()),
    ],
    ids=["five", "constant", "perfect", "no noise", "no curves", "odd where", "bare"],
)
def test_unusual_comparisons_have_a_page(unusual: Callable[[], Comparison]) -> None:
    page = Page(comparison_report(unusual()))

    assert "The model" in page.text
    assert not re.search(r"\b(nan|None)\b", page.text)


def test_a_model_that_diverged_has_a_page() -> None:
    found = small(signals=("q1",))
    curves = tuple(replace(c, modelled={name: np.full(100, np.inf) for name in c.modelled}) for c in found.curves)
    trials = tuple(replace(t, rmse={name: np.inf for name in t.rmse}) for t in found.trials)

    assert "∞" in Page(comparison_report(replace(found, curves=curves, trials=trials))).text


def test_a_diagnosis_without_held_out_trials_or_effects_has_a_page() -> None:
    found = diagnosis("cannot_tell", n_held_out=0, n=100)
    with blank():
        page = Page(diagnosis_report(replace(found, steps=found.steps[:1], ranking=(), next_experiment=None)))

    assert "cannot tell" in page.text
    assert "held-out" not in page.text


def test_a_single_record_cut_in_two_windows_pairs_each_window_with_itself() -> None:
    found = diagnosis(n=200)
    steps = tuple(
        replace(step, comparison=replace(step.comparison, curves=tuple(replace(c, file="a.csv") for c in pair)))
        for step in found.steps
        for pair in [(step.comparison.curves[0], step.comparison.curves[-1])]
    )

    with blank():
        texts = Page(diagnosis_report(replace(found, steps=steps))).alternatives()

    last = steps[-1].comparison.curves[-1]
    after = float(np.sqrt(np.mean((last.measured["q1"] - last.modelled["q1"]) ** 2)))
    assert any("held-out trial a.csv" in text and f"added by {quantity(after, 'rad')}" in text for text in texts)


def test_a_large_report_is_small(large: str) -> None:
    assert 200_000 < len(large.encode()) < 2_000_000


def test_the_ledger_has_a_page_of_its_own_that_says_how_far_the_error_fell() -> None:
    known = entries(diagnosis())
    page = Page(ledger_report(known))

    assert (
        "From arm to Arm_2 the error on held-out trials went from 40.2 times to 0.992 times the noise floor"
        in page.text
    )
    assert all(entry.model_hash in page.text for entry in known)
    assert "there is no other version yet" in Page(ledger_report(known[:1])).text
    assert "There is no version yet" in Page(ledger_report([])).text
