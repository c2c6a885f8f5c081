"""A ceiling near the highest command of a noisy record takes noise away; along inputs without noise it does nothing.

Waves of cogging do the same there as along the record, if the motion is the same.
"""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.decide.confusion import half_bic
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, Refit, fit_nominal, refit, smoothed
from orchestrator.diagnosis.fit.extensible import find_candidates, model_of
from orchestrator.diagnosis.linear.input_noise import explained_by_noise, misfit_without_input_noise
from orchestrator.diagnosis.linear.noise_model import metrics_of
from orchestrator.diagnosis.linear.response import Response
from orchestrator.diagnosis.linear.tangent import Tangent
from orchestrator.diagnosis.search.search import Searcher
from orchestrator.library.cards import effect_library
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.patch import free_slots

INERTIA, HIGHEST, TORQUE_NOISE, ANGLE_NOISE, STEP = 0.02, 0.1, 4e-3, 1e-4, 0.004
SOURCE = find_modelica_model("drive")
CASE = f"""files = ["a.csv", "b.csv"]
learning = [1]
held_out = [2]
[columns]
time = "s"
torque = "N.m"
phi = "rad"
[sensors]
phi_noise_std_rad = {ANGLE_NOISE}
"torque_noise_std_N.m" = {TORQUE_NOISE}
"""


def recorded(folder: Path, ceiling: float, constant: float = 0.0) -> tuple[Tangent, LearningData]:
    """A drive that is pushed to and fro, tested without effects; its torque is cut off at a ceiling, and joined by a
    constant one."""
    random, time = np.random.default_rng(8), np.arange(1500) * STEP
    for name in ("a.csv", "b.csv"):
        # Straight between samples, so that the trapezoidal rule and its next term are exact.
        torque = HIGHEST * np.clip(3 * np.sin(2 * time + random.uniform(0, 6)), -1, 1)
        rate = (np.clip(torque, -ceiling, ceiling) + constant) / INERTIA
        speed = np.r_[0.0, np.cumsum(0.5 * STEP * (rate[1:] + rate[:-1]))]
        angle = np.r_[0.0, np.cumsum(STEP * speed[:-1] + STEP**2 * (2 * rate[:-1] + rate[1:]) / 6)]
        write(folder / name, time, torque, angle, TORQUE_NOISE, random)
    (folder / "case.toml").write_text(CASE)
    return without_effects(folder)


def write(
    file: Path, time: np.ndarray, torque: np.ndarray, angle: np.ndarray, noise: float, random: np.random.Generator
) -> None:
    """A trial as it is recorded, with `noise` of the torque."""
    shown = [torque + noise * random.normal(size=len(time)), angle + ANGLE_NOISE * random.normal(size=len(time))]
    columns = np.column_stack([time, *shown])
    np.savetxt(file, columns, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")


def without_effects(folder: Path) -> tuple[Tangent, LearningData]:
    """Recorded trials of the drive, tested without effects in the metric of their noise."""
    model = model_of(SOURCE, SOURCE.compile())
    data = bind(load_measurements(folder), model.inputs, model.outputs)
    model, nothing = model.restricted(("phi",)), EffectSet(SOURCE, (), ("phi",))
    noise = np.array([ANGLE_NOISE])
    trials = smoothed(data.learning, noise)
    first = fit_nominal(nothing, model, LearningData(trials, noise))
    outputs, inputs = ([data.noise_of(name) for name in names] for names in (data.output_names, data.input_names))
    metrics = metrics_of(Response(first, [t.smoother for t in trials]), outputs, inputs)
    learning = LearningData(trials, noise, tuple(metrics))
    return Tangent(fit_nominal(nothing, model, learning), model, learning), learning


def effects_of(*effects: str) -> EffectSet:
    cards = [card for card in effect_library() if card.id in effects]
    return EffectSet(SOURCE, find_candidates(SOURCE, SOURCE.compile(), cards)[0], ("phi",))


def with_effect(effect: str, first: float, learning: LearningData) -> Refit:
    return refit(effects_of(effect), learning, np.array([first]))


def test_ceiling_that_only_cuts_noise_explains_nothing(tmp_path: Path) -> None:
    tangent, learning = recorded(tmp_path, ceiling=np.inf)
    found = with_effect("saturation", HIGHEST, learning)
    charge = 0.5 * np.log(found.fit.rows)
    assert 0.5 * (tangent.base.fit.misfit - found.fit.misfit) > charge  # it would pass for an effect

    assert explained_by_noise(tangent, found, 1.0, charge)


def test_ceiling_that_cuts_the_torque_explains_the_error_without_noise_too(tmp_path: Path) -> None:
    tangent, learning = recorded(tmp_path, ceiling=0.97 * HIGHEST)
    found = with_effect("saturation", HIGHEST, learning)

    assert not explained_by_noise(tangent, found, 1.0, 0.5 * np.log(found.fit.rows))


def test_noise_that_a_linear_effect_leaves_as_it_is_changes_nothing(tmp_path: Path) -> None:
    tangent, learning = recorded(tmp_path, ceiling=np.inf)
    found = with_effect("constant_force", 1e-4, learning)

    assert misfit_without_input_noise(tangent, found) == pytest.approx(found.fit.misfit, abs=1e-3)


def test_waves_that_noise_puts_out_of_step_are_confirmed_along_inputs_without_that_noise(tmp_path: Path) -> None:
    """To the model without waves their torque is noise of the input; a motion along inputs without that passes other waves."""
    random, time, noise = np.random.default_rng(8), np.arange(1500) * STEP, 1e-3
    effects, true = effects_of("cogging"), np.array([5e-4, 0.0, 25.0])
    model = effects.model
    for name in ("a.csv", "b.csv"):
        torque = HIGHEST * np.cos(2 * time + random.uniform(0, 6))
        inputs = np.column_stack([torque, np.zeros(len(time))])
        angle = model.compiled.run(time, inputs, model.compiled.with_values(true), np.zeros(2)).outputs[:, 0]
        write(tmp_path / name, time, torque, angle, noise, random)
    (tmp_path / "case.toml").write_text(CASE.replace(str(TORQUE_NOISE), str(noise)))
    tangent, learning = without_effects(tmp_path)
    found = refit(effects, learning, true)

    assert tangent.base.fit.misfit - found.fit.misfit < found.fit.rows  # less than the noise: quiet inputs are asked
    assert misfit_without_input_noise(tangent, found) == pytest.approx(found.fit.misfit, abs=3.0)
    assert not explained_by_noise(tangent, found, 1.0, 0.5 * found.size * np.log(found.fit.rows))


def test_set_that_is_likelier_with_an_effect_that_only_cuts_noise_does_without_it(tmp_path: Path) -> None:
    """Together they explain far more than there is noise; what the needless one does shows only beside the other alone."""
    tangent, learning = recorded(tmp_path, ceiling=np.inf, constant=0.01)
    pair = effects_of("constant_force", "saturation")
    owners = [pair.candidates[k].card.id for k in pair.owners()]
    found = refit(pair, learning, np.array([{"constant_force": 0.01, "saturation": HIGHEST}[name] for name in owners]))
    search = Searcher(SOURCE, tangent.nominal, free_slots(SOURCE.compile()), pair.candidates, learning, 1, print)

    simple = search.simplified(found, noise=1.0)

    assert simple.ids == ("constant_force",)
    assert half_bic(simple, 1.0, 2) > half_bic(found, 1.0, 2)
