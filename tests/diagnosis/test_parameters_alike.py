"""A parameter that is a little off and an effect that stands for it: a warning beside the effect's name."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator.compare.comparison import compare
from orchestrator.diagnosis.advise.parameters_alike import with_parameters_alike
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import extensible, model_of
from orchestrator.library.cards import effect_library
from orchestrator.measurements import bind, load_measurements
from orchestrator.model_argument import load_modelica
from orchestrator.verdicts.cannot_tell import cannot_tell
from tests.three_trials import three_trials

NOISE, INERTIA = 1e-3, 0.02


def warnings(folder: Path, names: tuple[str, ...], inertia: float, friction: float) -> list[str]:
    """What is said beside the names of effects that were fitted to swings of a drive, J phi'' = T sin(w t) - b phi'."""
    random, t = np.random.default_rng(6), np.arange(0, 6, 0.01)
    for k, w in enumerate((2.0, 3.1, 2.6), 1):
        phi = np.imag(_forced(t, 0.1, w, inertia, friction)) + NOISE * random.standard_normal(len(t))
        table = np.column_stack([t, 0.1 * np.sin(w * t), phi])
        np.savetxt(folder / f"trial_{k}.csv", table, delimiter=",", header="t,torque,phi", comments="")
    (folder / "case.toml").write_text(three_trials({"torque": "N.m", "phi": "rad"}, straight="torque"))
    source, measurements = load_modelica("drive"), load_measurements(folder)
    model = model_of(source, source.compile())
    given = compare(model, measurements, workers=1)
    data = bind(measurements, model.inputs, model.outputs)
    learning = LearningData.of(data, given.noise_floor)
    there, _ = extensible(source).candidates(source.compile(), effect_library())
    chosen = [next(c for c in there if c.card.id == name) for name in names]
    effects = EffectSet(source, chosen, data.output_names)
    named = refit(effects, learning, effects.first_guess())
    plain = model.restricted(data.output_names)
    told = with_parameters_alike(cannot_tell(given, ()), named, plain, learning, max(named.cost, 1.0), len(there))
    return [note for note in told.warnings if note.startswith("instead of")]


def _forced(t: np.ndarray, torque: float, w: float, inertia: float, friction: float) -> np.ndarray:
    """Complex motion from rest under torque exp(iwt): phi = B (exp(iwt) - 1) - iwB (1 - exp(-at)) / a, a = b/J."""
    a = friction / inertia
    size = torque / (inertia * 1j * w * (1j * w + a))
    fading = (1 - np.exp(-a * t)) / a if a else t
    return np.asarray(size * (np.exp(1j * w * t) - 1) - 1j * w * size * fading)


def test_a_scale_error_may_be_an_inertia_that_is_off(tmp_path: Path) -> None:
    (note,) = warnings(tmp_path, ("joint_scale", "viscous_friction"), INERTIA * 1.015, 0.01)
    assert note.startswith("instead of joint_scale at sensor:q1")
    share = float(note.partition("J ")[2].partition("%")[0])
    assert share == pytest.approx(1.5, abs=0.1)


def test_friction_is_no_inertia_that_is_off(tmp_path: Path) -> None:
    assert warnings(tmp_path, ("viscous_friction",), INERTIA, 0.01) == []
