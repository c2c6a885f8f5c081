"""P-values of right models are spread as p-values must be, also when the noise of a measured input goes through the plant."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from threadpoolctl import threadpool_limits

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import fit_nominal
from orchestrator.diagnosis.fit.extensible import find_candidates, model_of
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.tangent import Tangent
from orchestrator.diagnosis.linear.thresholds import SIGNIFICANT
from orchestrator.diagnosis.noise.nuisances import Nuisances
from orchestrator.diagnosis.prepared import in_metric
from orchestrator.library.cards import effect_library
from orchestrator.measurements import Noise, bind, load_measurements
from orchestrator.models.patch import free_slots
from tests.noisy_drive import described

STEP, COUNT, INERTIA, ANGLE_STD, TORQUE_STD = 0.004, 500, 0.02, 1e-4, 2e-4
RECORDS = 40
CARDS = ("viscous_friction", "coulomb_friction", "cogging", "stimulation_delay", "passive_stiffness", "tremor")


def write(folder: Path, noise: Noise, random: np.random.Generator) -> None:
    """Trials of J phi'' = torque, exact for a torque that is straight between samples, with noise on both columns."""
    time = np.arange(COUNT) * STEP
    for name in ("a.csv", "b.csv", "c.csv"):
        torque = np.sin(np.outer(time, [3.0, 11.0]) + random.uniform(0, 6, 2)) @ [0.05, 0.1]
        gain = torque / INERTIA
        speed = random.normal() + np.r_[0.0, np.cumsum(0.5 * STEP * (gain[1:] + gain[:-1]))]
        angle = np.r_[0.0, np.cumsum(STEP * speed[:-1] + STEP**2 * (gain[:-1] / 3 + gain[1:] / 6))]
        measured = torque + noise.draw((COUNT,), random), angle + ANGLE_STD * random.normal(size=COUNT)
        columns = np.column_stack([time, *measured])
        np.savetxt(folder / name, columns, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
    (folder / "case.toml").write_text(described(ANGLE_STD, TORQUE_STD))


def p_values(folder: Path, noise: Noise) -> Iterator[float]:
    source = find_modelica_model("drive")
    system = source.compile()
    model = model_of(source, system)
    plain, nothing = model.restricted(("phi",)), EffectSet(source, (), ("phi",))
    candidates, _ = find_candidates(source, system, [c for c in effect_library() if c.id in CARDS])
    assert {c.card.id for c in candidates} == set(CARDS)
    extra = Nuisances(shift_std=0.5 * STEP)
    for seed in range(RECORDS):
        write(folder, noise, np.random.default_rng(seed))
        data = bind(load_measurements(folder), model.inputs, model.outputs)
        learning = in_metric(source, plain, data, data.learning, {"phi": ANGLE_STD}, extra)
        tangent = Tangent(fit_nominal(nothing, plain, learning), plain, learning)
        blocks = tangent.blocks(candidates, free_slots(system), lambda work, items: [work(item) for item in items])
        yield Stage(tangent, blocks, 3, seed).p_value


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_one_in_twenty_right_models_has_a_p_value_below_a_twentieth(tmp_path: Path, memory: float) -> None:
    noise = Noise(0.0, TORQUE_STD, memory) if memory else Noise(TORQUE_STD)
    with threadpool_limits(limits=1, user_api="blas"):
        found = np.array(list(p_values(tmp_path, noise)))

    # Of 40 uniform p-values so few are below 0.05, and above 0.5 so many, but for one time in a thousand each.
    assert np.sum(found <= SIGNIFICANT) <= stats.binom.ppf(0.999, RECORDS, SIGNIFICANT)
    assert np.sum(found > 0.5) >= stats.binom.ppf(0.001, RECORDS, 0.5)
