"""Stops at the ends of a machine's travel: on one side or both, with and without losses, found and written on their own side."""

from pathlib import Path

import pytest
from plants import SLIDE, diagnosed, slide_record

from fmus.catalogue import find_modelica_model
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.effects import with_effects
from orchestrator.greybox.laws import laws
from orchestrator.greybox.places import Place
from orchestrator.verdicts.result import Estimate, NamedEffect

ABOVE, BELOW = 0.11, -0.08
STOPS = {law.variant: law for law in laws() if law.id == "end_stop"}


def _both(x: float, v: float, loss: float = 0.0) -> float:
    """Stops of 3000 and 2000 N/m; with a loss, of 3000 (1 + loss v) and 2000 (1 - loss v) N/m."""
    return -3000.0 * (1 + loss * v) * max(x - ABOVE, 0.0) + 2000.0 * (1 - loss * v) * max(BELOW - x, 0.0)


def test_stops_at_both_ends_are_named_on_their_own_sides_with_their_values(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, _both, samples=250, said=True))
    assert (found.verdict, found.incomplete) == ("named", False)
    assert {(e.id, e.variant) for e in found.effects} == {("end_stop", "above"), ("end_stop", "below")}
    values = {(e.variant, name): p.value for e in found.effects for name, p in e.parameters.items()}
    expected = {("above", "k"): 3000, ("above", "qStop"): ABOVE, ("below", "k"): 2000, ("below", "qStop"): BELOW}
    assert values == {key: pytest.approx(value, rel=0.02) for key, value in expected.items()}


def test_a_stop_that_takes_energy_is_told_from_one_that_gives_it_back(tmp_path: Path) -> None:
    found = diagnosed(slide_record(tmp_path, lambda x, v: _both(max(x, BELOW), v, loss=1.5), samples=200, said=True))
    (effect,) = found.effects
    assert (found.verdict, effect.id, effect.variant) == ("named", "end_stop", "above with losses")
    assert {name: p.value for name, p in effect.parameters.items()} == {
        "k": pytest.approx(3000, rel=0.03),
        "c": pytest.approx(4500, rel=0.03),
        "qStop": pytest.approx(ABOVE, rel=0.01),
    }


@pytest.mark.parametrize(
    ("variant", "force"),
    [
        ("above", "- end1_k*max(x - end1_qStop, 0)"),
        ("below", "+ end1_k*max(end1_qStop - x, 0)"),
        ("", "- end1_k*max(x - end1_qStop, 0)"),  # results of old do not tell
    ],
)
def test_a_stop_is_written_on_its_own_side(variant: str, force: str, tmp_path: Path) -> None:
    (tmp_path / "Slide.mo").write_text(SLIDE)
    base = find_modelica_model(f"{tmp_path / 'Slide.mo'}:Slide")
    values = {"k": Estimate(3000.0, "N/m", (2900.0, 3100.0)), "qStop": Estimate(0.1, "m", (0.1, 0.1))}
    with_effects(base, [NamedEffect("end_stop", "x", values, variant)], "Slide_1", tmp_path)
    assert f"m*der(v) = F - k*x {force};" in (tmp_path / "Slide_1.mo").read_text()


@pytest.mark.parametrize(
    ("one", "other", "together"),
    [
        ("above", "below", True),
        ("above", "below with losses", True),
        ("above with losses", "below with losses", True),
        ("above", "above", False),
        ("above", "above with losses", False),  # a stop without losses is one with losses of 0
    ],
)
def test_a_machine_has_one_stop_on_each_side(one: str, other: str, together: bool) -> None:
    place = Place("balance", "x", "N")
    first, second = (Candidate(STOPS[variant], place) for variant in (one, other))
    assert first.is_apart_from(second) == second.is_apart_from(first) == together
