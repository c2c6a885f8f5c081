"""The latent force curve: it finds the coordinates that matter, and its band holds the truth."""

import re
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.compare.comparison import compare
from orchestrator.diagnosis.advise.latent import Series, latent_force
from orchestrator.diagnosis.free_runs import search_slots
from orchestrator.greybox.diagnose import diagnose_greybox
from orchestrator.library.cards import effect_library
from orchestrator.measurements import MeasurementSet, load_measurements
from orchestrator.model_argument import load_model
from orchestrator.verdicts.latent_force import LatentForce


@cache
def found(seed: int = 0) -> tuple[LatentForce, np.ndarray]:
    """Two trials; the force depends on speed and position alone, beside noise of a tenth of its size."""
    random, series, truths = np.random.default_rng(seed), {name: [] for name in ("q", "w", "u", "t", "r")}, []
    for _ in range(2):
        time = np.linspace(0, 10, 600)
        q = np.sin(1.3 * time + random.uniform(0, 6)) + 0.4 * np.sin(2.9 * time + random.uniform(0, 6))
        w = np.gradient(q, time)
        force = -0.5 * np.tanh(2 * w) * (1 + 0.6 * q)
        truths.append(force)
        values = {"q": q, "w": w, "u": np.cos(0.7 * time), "t": time, "r": force + 0.04 * random.standard_normal(600)}
        for name, value in values.items():
            series[name].append(value)
    made = {name: Series(name, "1", tuple(parts)) for name, parts in series.items()}
    curve = latent_force(made["r"], [made[name] for name in ("q", "w", "u", "t")])
    assert curve is not None
    return curve, np.concatenate(truths)


def test_the_two_coordinates_that_make_the_force_are_found_and_explain_it_on_data_left_out() -> None:
    curve, _ = found()

    assert curve.coordinates == ("w", "q")
    assert curve.explained[1] > 0.97
    assert curve.explained[0] < curve.explained[1] - 0.02
    assert curve.sentence().startswith("what is left of r depends most on w, then on q: both explain 9")


@pytest.mark.parametrize("seed", range(3))
def test_band_holds_the_true_curve_at_most_places(seed: int) -> None:
    curve, _ = found(seed)

    # On the line the second coordinate is at its median, close to 0.
    truth = -0.5 * np.tanh(2 * np.array(curve.at))
    inside = (np.array(curve.low) - 0.03 <= truth) & (truth <= np.array(curve.high) + 0.03)
    assert inside.mean() > 0.85
    assert np.all(np.array(curve.low) <= curve.force) and np.all(np.array(curve.force) <= curve.high)


def test_white_noise_is_explained_by_nothing() -> None:
    random = np.random.default_rng(0)
    series = {name: Series(name, "1", (random.standard_normal(800),)) for name in "rab"}

    curve = latent_force(series["r"], [series["a"], series["b"]])

    assert curve is not None
    assert curve.explained[1] < 0.05


def test_draft_card_is_toml_that_carries_the_curve() -> None:
    curve, _ = found()

    table = tomllib.loads(curve.draft_card(1))["table"]

    assert table["coordinates"] == ["w", "q"]
    np.testing.assert_allclose(table["force"], curve.surface, rtol=1e-5)
    assert len(table["first"]) == len(table["force"])


def test_too_few_samples_give_no_curve() -> None:
    short = Series("r", "1", (np.arange(10.0),))

    assert latent_force(short, [short, short]) is None


def _pendulum_with_a_second_wave(folder: Path) -> MeasurementSet:
    """Three records of a pendulum with a further torque of 20 mN.m sin(2 theta)."""

    m, a, inertia, g = 0.147585, 0.147755, 1.0912e-4, 9.81001
    random, time = np.random.default_rng(4), np.arange(0, 4, 0.01)
    for k, start in enumerate((1.0, 1.6, 2.0), start=1):
        run = solve_ivp(
            lambda t, x: [x[1], (m * g * a * np.sin(x[0]) + 0.02 * np.sin(2 * x[0])) / (inertia + m * a**2)],
            (0, 4),
            [start, 0],
            t_eval=time,
            rtol=1e-9,
            atol=1e-10,
        )
        rows = np.column_stack([time, run.y[0] + 5e-4 * random.standard_normal(len(time))])
        np.savetxt(folder / f"{k}.csv", rows, delimiter=",", header="time,theta", comments="")
    return load_measurements(folder)


def test_a_search_that_finds_no_effect_shows_the_force_over_what_it_depends_on(tmp_path: Path) -> None:
    cards = [card for card in effect_library() if card.id == "viscous_friction"]
    records = _pendulum_with_a_second_wave(tmp_path)

    given = compare(load_model("pendulum"), records, workers=1)
    found = search_slots(find_modelica_model("pendulum"), records, given, cards, 1, lambda message: None, None)

    assert found.verdict == "unknown"
    (curve,) = found.latent_forces
    assert curve.coordinates[0] == "theta"
    assert curve.unit == "N.m"
    expected = 0.02 * np.sin(2 * np.array(curve.at))
    # The residual is smoothed to the bandwidth of the motion, which rounds peaks off.
    assert np.corrcoef(curve.force, expected)[0, 1] > 0.9
    assert found.to_json()["latent_forces"][0]["coordinates"][0] == "theta"


def test_effects_that_together_approximate_a_force_of_no_library_are_not_named(tmp_path: Path) -> None:
    """A cubic spring, stops and a wrong gravity follow sin(2 theta) over half a turn to a few per cent."""
    records = _pendulum_with_a_second_wave(tmp_path)

    found = diagnose_greybox(find_modelica_model("pendulum"), records, workers=1)

    assert found.verdict == "unknown" and not found.effects and len(found.best) > 1
    assert re.search(r"some other force over \w+ predicts \d\d% better", " ".join(found.warnings))
