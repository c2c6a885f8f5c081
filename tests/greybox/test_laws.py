"""Every law of the library: its text can be evaluated, its units add up, and it vanishes without its gains."""

import numpy as np
import pytest

from orchestrator.greybox.candidates import candidates_at
from orchestrator.greybox.expression import evaluate_numbers
from orchestrator.greybox.laws import Law, laws
from orchestrator.greybox.places import Place

NAMES = {
    "q": 0.3,
    "v": 0.7,
    "x": 1.2,
    "u": 0.9,
    "y": 1.1,
    "p": 2.0,
    "t": 4.0,
    "z": 0.4,
    "w": 0.2,
    "net": 0.8,
    "storage": 1.5,
    "twist": 0.1,
    "rate": 0.6,
    "load": 0.6,
    "other": 0.5,
}
UNITS = {
    "force": "N",
    "speed": "m/s",
    "position": "m",
    "state": "K",
    "input": "V",
    "output": "Pa",
    "time": "s",
    "centre": "m",
}


def _sized(law: Law, size: float) -> dict[str, float]:
    """The parameters of a law, and states that begin with anything, where it is of some size."""
    return {p.name: size if p.gain else 0.5 for p in law.parameters} | dict.fromkeys(law.unknown_starts, size)


@pytest.mark.parametrize("law", laws(), ids=lambda law: f"{law.id}-{law.place}")
def test_a_law_changes_nothing_while_its_gains_are_zero(law: Law) -> None:
    values = NAMES | _sized(law, 0.0)
    unchanged = {
        "input": NAMES["u"],
        "between_inputs": NAMES["u"],
        "output": NAMES["y"],
        "response": NAMES["y"],
        "parameter": NAMES["p"],
    }
    assert evaluate_numbers(law.expression, values) == pytest.approx(unchanged.get(law.place, 0.0))


@pytest.mark.parametrize("law", [law for law in laws() if not law.curved], ids=lambda law: f"{law.id}-{law.place}")
def test_a_laws_gains_enter_linearly(law: Law) -> None:
    def at(share: float) -> float:
        return float(evaluate_numbers(law.expression, NAMES | _sized(law, share)))

    assert at(2.0) - at(1.0) == pytest.approx(at(1.0) - at(0.0))


@pytest.mark.parametrize("law", laws(), ids=lambda law: f"{law.id}-{law.place}")
def test_every_parameter_has_a_unit_and_a_description(law: Law) -> None:
    for parameter in law.parameters:
        assert parameter.unit(UNITS) and parameter.description
        assert parameter.gain or parameter.grid


def test_a_dissipative_law_never_adds_energy() -> None:
    for law in laws():
        if law.id in ("viscous_friction", "coulomb_friction", "stribeck_friction", "quadratic_drag"):
            for speed in (-2.0, -0.01, 0.01, 2.0):
                values = NAMES | {p.name: 0.5 for p in law.parameters} | {"v": speed}
                assert evaluate_numbers(law.expression, values) * speed < 0


def test_dry_friction_reaches_more_than_nine_tenths_of_its_size_below_a_third_of_the_speeds_of_a_record() -> None:
    """Dry friction that grows over all speeds would be viscous friction by another name, and a rival of it in any record."""
    [friction] = [law for law in laws() if law.id == "coulomb_friction"]
    speed = 2.0
    place = Place("motion", "x", "N", {"v": "v"}, {}, UNITS, dict.fromkeys(UNITS, 1.0) | {"speed": speed})
    [corner] = [p for p in friction.parameters if p.smooths]
    for candidate in candidates_at([place], [friction]):
        widest = candidate.limits(corner)[1]
        at = NAMES | {p.name: 1.0 for p in friction.parameters} | {corner.name: widest, "v": speed / 3}
        assert -evaluate_numbers(friction.expression, at) > 0.9


def test_a_force_that_repeats_shows_a_few_of_its_waves_whatever_is_fitted() -> None:
    """Less than one wave is like a spring: it stood for the play of a coupling."""
    [ripple] = [law for law in laws() if law.id == "force_ripple"]
    half = 0.03
    place = Place("motion", "x", "N", {"q": "x", "v": "v"}, {}, UNITS, dict.fromkeys(UNITS, half), range=(0.0, half))
    [wavenumber] = [p for p in ripple.parameters if p.waves]
    tried = candidates_at([place], [ripple])
    assert tried
    for candidate in tried:
        fewest = candidate.limits(wavenumber)[0]
        assert fewest * 2 * half == pytest.approx(2 * np.pi * wavenumber.waves)
        assert candidate.shapes[wavenumber.name] >= fewest
