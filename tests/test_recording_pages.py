"""The gallery of real recordings: each page shows what was measured, and nothing that was recorded is kept."""

import json
import xml.etree.ElementTree as ET

import pytest

from docs.generator.record_recordings import kept_of
from docs.generator.recording_pages import FOLDER, pages, pictures, recordings, standalone
from orchestrator.report.answer import answer_of

NAMES = sorted(recordings())


def test_there_is_a_page_for_each_recorded_result_and_none_without() -> None:
    assert {path.stem for path in FOLDER.glob("*.json")} == set(NAMES)
    assert len(NAMES) >= 6
    assert set(pages()) == {"recordings/index.md", *(f"recordings/{name}.md" for name in NAMES)}


@pytest.mark.parametrize("name", NAMES)
def test_a_page_has_the_answer_of_its_json_the_commands_and_pictures_that_exist(name: str) -> None:
    _, document = recordings()[name]
    page, answer = pages()[f"recordings/{name}.md"], answer_of(document)

    assert page.index(answer.headline) < page.index(f"{name}_error.svg") < page.index("## What was given")
    assert "misfit discover" in page
    assert "## What is known" in page
    shown = [path for path in pictures() if path.startswith(f"recordings/img/{name}_")]
    assert all(path.removeprefix("recordings/") in page for path in shown)
    assert f"recordings/img/{name}_error.svg" in shown
    assert answer.detail in page


def test_pictures_are_drawings_with_words_for_those_who_do_not_see_them() -> None:
    for svg in pictures().values():
        assert ET.fromstring(svg).attrib["aria-label"]
        assert "<style>" in svg


def test_no_measured_curve_is_kept() -> None:
    document = {
        "where": {"force": [], "time": [1]}, "ranking": [], "tried": [], "steps": [], "seconds": 1.0,
        "curves": [{"measured": [1.0, 2.0]}], "latent_forces": [1],
    }  # fmt: skip
    kept = kept_of(document)

    assert "curves" not in kept and "latent_forces" not in kept
    assert kept["where"] == {"force": []}
    for path in FOLDER.glob("*.json"):
        assert "measured" not in json.loads(path.read_text())


def test_a_picture_of_its_own_has_the_colours_of_the_page() -> None:
    assert standalone('<svg class="a"><g/></svg>').count("--residual") >= 1
