"""Inputs whose course between samples nobody has said: the model with its effects is compared as the answer reads them."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.discover import discover
from orchestrator.greybox.evidence import all_candidates, case_of, nominal_set
from orchestrator.greybox.explained import leaves_nothing
from orchestrator.greybox.search import fit_set
from orchestrator.greybox.thresholds import Thresholds
from orchestrator.measurements import load_measurements

CART = """model Cart
  parameter Real m(unit = "kg") = 2;
  input Real F(unit = "N");
  output Real v(unit = "m/s", start = 0, fixed = true);
equation
  m*der(v) = F;
end Cart;
"""
STEP, DRAG, MASS = 0.1, 3.0, 2.0


def cart_record(folder: Path) -> Path:
    """A cart with viscous friction under forces that are held over each sample, by the exact solution of its equation."""
    (folder / "Cart.mo").write_text(CART)
    random, decay = np.random.default_rng(2), np.exp(-DRAG / MASS * STEP)
    for number in (1, 2, 3):
        time = STEP * np.arange(300)
        waves = random.uniform(0.3, 1.0, 4)[:, None] * time * 2 * np.pi + random.uniform(0, 6, 4)[:, None]
        force = np.round(np.sin(waves).sum(axis=0), 3)
        speed = np.zeros(len(time))
        for k, held in enumerate(force[:-1]):
            speed[k + 1] = held / DRAG + (speed[k] - held / DRAG) * decay
        shown = speed + 0.03 * random.standard_normal(len(time))
        rows = np.column_stack([time, force, shown])
        np.savetxt(folder / f"trial_{number}.csv", rows, delimiter=",", header="time,F,v", comments="", fmt="%.9g")
    (folder / "case.toml").write_text(
        'files = ["trial_1.csv", "trial_2.csv", "trial_3.csv"]\nlearning = [1, 2]\nheld_out = [3]\n'
        '[columns]\ntime = "s"\nF = "N"\nv = "m/s"\n'
    )
    return folder


def test_the_right_set_leaves_nothing_and_the_model_as_given_does(tmp_path: Path) -> None:
    folder = cart_record(tmp_path)
    (folder / "case.toml").write_text((folder / "case.toml").read_text() + '[interpolation]\nF = "hold"\n')
    case = case_of(find_modelica_model(f"{folder / 'Cart.mo'}:Cart"), load_measurements(folder))
    setting, nominal = nominal_set(case, Thresholds())
    friction = next(c for c in all_candidates(case, nominal) if c.id == "viscous_friction")

    right = fit_set(setting, (friction,), nominal.fit.noise)

    left = [leaves_nothing(setting.fitter, each.fit, Thresholds().quiet) for each in (nominal, right)]
    assert left == [False, True]


def test_the_added_model_leaves_what_the_answer_says(tmp_path: Path) -> None:
    folder = cart_record(tmp_path)
    source = find_modelica_model(f"{folder / 'Cart.mo'}:Cart")

    found = discover(source, load_measurements(folder), tmp_path / "out", workers=1)

    # Dry friction with a corner wider than all speeds is the same, and no name for it.
    assert [effect.id for effect in found.diagnosis.effects] == ["viscous_friction"]
    assert found.diagnosis.interpolation == {"F": "hold"}
    said, kept = found.diagnosis.steps[-1].comparison.held_out, found.entries[-1].held_out
    assert said is not None and kept is not None
    assert kept.over_floor == pytest.approx(said.over_floor, rel=0.01)
