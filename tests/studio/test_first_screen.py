"""The first screen at 1280 x 800 answers: verdict, place, size, what it buys and the next step, as the JSON has them."""

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from accessibility import grave_violations
from playwright.sync_api import Page, expect
from studio_process import ROOT, Studio

from orchestrator import ledger
from orchestrator.compare.result import SetErrors
from orchestrator.ledger import LedgerEntry
from orchestrator.studio.project import DIAGNOSIS, MATCH, VERSION, Project
from orchestrator.studio.workspace import Workspace

# Results of real runs, thinned to what the screen reads.
CASES = sorted(path.stem for path in (ROOT / "tests" / "answers").glob("*.json"))
HEIGHT = 800


def document_of(case: str) -> dict[str, Any]:
    return dict(json.loads((ROOT / "tests" / "answers" / f"{case}.json").read_text()))


def project_of(studio: Studio, document: dict[str, Any]) -> Project:
    """A project as it stands after Diagnose."""
    project = Workspace(studio.workspace).create("A first screen")
    project.change(model=document["model"])
    (project.measurements / "trial.csv").write_text("time,q1\n0,1\n1,2\n")
    curves = document["curves"]
    trials = [{"file": each["file"], "set": "learning", "samples": 2, "seconds": 1.0} for each in curves]
    matched = {"model": document["model"], "columns": [], "trials": trials, "notes": [], "problem": ""}
    (project.results / MATCH).write_text(json.dumps(matched))
    (project.results / DIAGNOSIS).write_text(json.dumps(document))
    given = document["steps"][0]
    sets = [
        SetErrors(given[key]["rmse"], given[key]["over_floor"]) for key in ("learning", "held_out") if given.get(key)
    ]
    floor = given["noise_floor"]
    entry = LedgerEntry(
        0, "given", document["model"], (), sets[0], sets[-1], floor, dict.fromkeys(floor, "1"), "0", "0", "2026", "0"
    )
    ledger.append(project.results, entry)
    return project


def rms_over_floor(held_out: dict[str, Any], key: str) -> float:
    squares = [(value / held_out["noise_floor"][name]) ** 2 for name, value in held_out[key].items()]
    return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def shown_as(text: str, value: float, unsure: float = 0.0) -> bool:
    """Whether one of the numbers of a text is the value, rounded to three digits or to a fifth of how `unsure` it is."""
    words = text.replace("(", " ").replace(")", " ").replace(",", " ").split()
    for word in words:
        try:
            if math.isclose(float(word), value, rel_tol=6e-3, abs_tol=0.2 * unsure):
                return True
        except ValueError:
            continue
    return False


def visible_text(tab: Page) -> str:
    """Text of the answer that stands within the first screen."""
    script = """(height) => [...document.querySelectorAll('.studio-answer .a-verdict *, .studio-answer svg text, .studio-answer td,'
        + ' .studio-answer th, .studio-answer h3')].filter((e) => { const box = e.getBoundingClientRect();
        return box.height > 0 && box.bottom <= height; }).map((e) => e.textContent).join(' ')"""
    return str(tab.evaluate(script, HEIGHT)).replace("\u00a0", " ")


@pytest.mark.parametrize("case", CASES)
def test_the_first_screen_answers_what_the_json_says(
    case: str, tab: Page, studio: Studio, screenshot: Callable[[Page, str], Path]
) -> None:
    document = document_of(case)
    project = project_of(studio, document)
    tab.set_viewport_size({"width": 1280, "height": HEIGHT})
    tab.goto(f"{studio.url}/project/{project.id}")
    expect(tab.locator(".a-verdict h2")).to_be_visible()
    tab.screenshot(path=ROOT / "build" / "screenshots" / f"first_screen_{case}.png")
    tab.emulate_media(color_scheme="dark")
    tab.screenshot(path=ROOT / "build" / "screenshots" / f"first_screen_{case}_dark.png")

    text = visible_text(tab)
    held_out = document["held_out"]
    before, after = rms_over_floor(held_out, "rmse_before"), rms_over_floor(held_out, "rmse_after")
    assert shown_as(text, before), "the error as given"
    assert "Next:" in text
    if document["effects"] and document["verdict"] == "named":
        button = tab.get_by_role("button", name=re.compile("^Add ")).inner_text()
        assert button in tab.locator(".a-verdict p").last.inner_text(), "the button does what the sentence says"
    assert "…" not in "".join(tab.locator(".a-axis").all_text_contents()), "a label is cut"
    for effect in document["effects"] if document["verdict"] == "named" else ():
        assert effect["id"].replace("_", " ") in text.lower()
        assert all(part in text for part in effect["site"].split("+"))
        name, size = next(iter(effect["parameters"].items()))
        assert name in text
        unsure = (size["ci90"][1] - size["ci90"][0]) / 2
        scales = (1.0, 1e3, 1e6)
        assert any(shown_as(text, size["value"] * k, unsure * k) for k in scales), f"the size of {name}"
        assert shown_as(text, after), "the error with it"
        assert tab.get_by_role("button", name="Add", exact=False).first.bounding_box()["y"] < HEIGHT  # type: ignore[index]
    if document["verdict"] == "named":
        first = tab.locator(".a-named th").inner_text().lower()
        assert all(effect["id"].replace("_", " ") in first for effect in document["effects"])
        # One figure for "removes": that of the held-out trials, and no other percentage of the same thing.
        assert tab.locator(".studio-answer").inner_text().count("of the avoidable error") == 1
    if not document["effects"]:
        expect(tab.get_by_role("button", name="Add", exact=False)).to_have_count(0)
    if document["verdict"] == "named" and any("law" in row for row in document["where"]["force"]):
        assert tab.locator(".a-law").count(), "the fitted law as a line"
    if document["verdict"] == "ambiguous":
        assert "input delay at tau or sensor delay in the sensor phi" in text
        assert "35.02 ms" in text, "the size"
        expect(tab.get_by_role("button", name="Add input delay at tau")).to_be_visible()
    if document["verdict"] == "cannot_tell":
        assert "muscle4" in text, "what the record does not show"
    assert not tab.get_by_text("Drop files here").is_visible()
    assert tab.evaluate("document.documentElement.scrollWidth") <= 1280


def test_wrong_units_are_told_on_the_first_screen_with_what_to_do(tab: Page, studio: Studio) -> None:
    project = Workspace(studio.workspace).create("Wrong units")
    project.change(model="drive")
    rows = "".join(f"{k / 10},{k / 5},{k / 7}\n" for k in range(20))
    (project.measurements / "a.csv").write_text(f"time,torque,phi\n{rows}")
    (project.measurements / "case.toml").write_text('files = ["a.csv"]\n[columns]\nphi = "m"\ntorque = "N.m"\n')
    tab.set_viewport_size({"width": 1280, "height": HEIGHT})
    tab.goto(f"{studio.url}/project/{project.id}")

    told = tab.locator(".a-verdict")
    expect(told.get_by_role("heading", name="These data cannot be used yet.")).to_be_visible(timeout=60_000)
    problem = told.locator(".studio-problem", has_text="column 'phi' in 'm' cannot be model variable 'phi' in 'rad'")
    expect(problem).to_be_visible()
    expect(told.get_by_text("Next: Correct the unit in [columns] of case.toml")).to_be_visible()
    expect(tab.get_by_text("2 of 2 columns are variables of the model; they cannot be used yet.")).to_be_visible()
    tab.screenshot(path=ROOT / "build" / "screenshots" / "first_screen_wrong_units.png")
    assert told.bounding_box()["y"] < HEIGHT / 4  # type: ignore[index]
    expect(tab.get_by_role("button", name="Diagnose")).to_be_disabled()


def test_why_opens_the_evidence_and_axe_finds_nothing_serious_in_light_or_dark(
    tab: Page, studio: Studio, screenshot: Callable[[Page, str], Path]
) -> None:
    project = project_of(studio, document_of("arm"))
    tab.goto(f"{studio.url}/project/{project.id}")
    tab.get_by_role("button", name="Why do you think so?").click()

    expect(tab.get_by_text("What was found")).to_be_visible()
    assert grave_violations(tab) == []
    tab.emulate_media(color_scheme="dark")
    expect(tab.locator("body")).to_have_css("background-color", "rgb(21, 25, 30)")
    screenshot(tab, "dark_answer")
    expect(tab.locator(".q-loading-bar[role=progressbar]")).to_have_count(0)  # has no name while something is loading
    assert grave_violations(tab) == []


def test_what_was_opened_stays_open_while_the_page_follows_the_disk(tab: Page, studio: Studio) -> None:
    project = project_of(studio, document_of("arm"))
    tab.goto(f"{studio.url}/project/{project.id}")
    tab.get_by_role("button", name="Why do you think so?").click()
    expect(tab.get_by_text("What was found")).to_be_visible()
    project.change(name="Another name", wanted=0)
    (project.results / DIAGNOSIS).write_text(json.dumps(document_of("pendulum")))
    expect(tab.get_by_role("heading", name="Another name")).to_be_visible()
    expect(tab.get_by_role("heading", name="Viscous friction at joint1 is missing.")).to_be_visible()

    assert tab.locator("#why").evaluate("(why) => why.open")


def test_the_list_of_projects_says_model_and_verdict(tab: Page, studio: Studio) -> None:
    project_of(studio, document_of("pendulum"))
    tab.goto(studio.url)

    expect(tab.get_by_text("pendulum · Viscous friction at joint1 is missing.").first).to_be_visible()
    assert tab.locator("li", has_text="pendulum · Viscous").first.locator(".studio-spark polyline").count() == 1


def test_after_add_the_error_falls_in_the_pictures_whose_axes_stay(tab: Page, studio: Studio) -> None:
    document = document_of("pendulum")
    project = project_of(studio, document)
    tab.goto(f"{studio.url}/project/{project.id}")
    pictures = tab.locator(".a-grid-of-four").inner_html()
    better = tab.locator("rect.a-better:visible")
    assert better.evaluate("(bar) => getComputedStyle(bar).animationName") == "none"

    held_out = document["held_out"]
    errors = SetErrors(held_out["rmse_after"], rms_over_floor(held_out, "rmse_after"))
    given = ledger.read(project.results)[0]
    ledger.append(project.results, replace(given, version=1, name="Pendulum_1", learning=errors, held_out=errors))
    (project.results / VERSION.format(1)).write_text(json.dumps({"entry": 1}))
    project.change(wanted=1)

    expect(tab.get_by_text("Pendulum_1 has it: the error on held-out trials fell from 2690 to 341")).to_be_visible()
    assert better.evaluate("(bar) => getComputedStyle(bar).animationName") == "a-fall"
    # It begins at the length of the bar of the model as given.
    begin = "(bar) => { const [a] = bar.getAnimations(); a.pause(); a.currentTime = 0; return getComputedStyle(bar).width; }"
    assert float(better.evaluate(begin).removesuffix("px")) == float(
        tab.locator("rect.a-given:visible").get_attribute("width") or 0
    )
    assert tab.locator(".a-grid-of-four").inner_html() == pictures
