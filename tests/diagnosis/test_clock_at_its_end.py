"""A clock that is off by as much as it can be excuses no more: what else the error is shows to first order."""

from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import fit_nominal
from orchestrator.diagnosis.fit.extensible import find_candidates, model_of
from orchestrator.diagnosis.linear.tangent import Tangent
from orchestrator.diagnosis.noise.nuisances import Nuisances
from orchestrator.diagnosis.prepared import in_metric
from orchestrator.library.cards import effect_library
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.patch import free_slots
from tests.noisy_drive import described

INERTIA, STEP, COUNT, ANGLE_STD, TORQUE_STD = 0.02, 0.004, 500, 1e-4, 1e-5
LATE = 0.012


def test_delay_of_three_samples_shows_beside_a_clock_that_may_be_one_late(tmp_path: Path) -> None:
    random, time = np.random.default_rng(3), np.arange(COUNT) * STEP
    for name in ("a.csv", "b.csv", "c.csv"):
        waves, phases = np.array([3.0, 11.0, 37.0]), random.uniform(0, 6, 3)
        sizes = np.array([0.05, 0.1, 0.1])
        torque = np.sin(np.outer(time, waves) + phases) @ sizes
        angle = np.sin(np.outer(time - LATE, waves) + phases) @ (-sizes / waves**2 / INERTIA)
        shown = torque + TORQUE_STD * random.normal(size=COUNT), angle + ANGLE_STD * random.normal(size=COUNT)
        columns = np.column_stack([time, *shown])
        np.savetxt(tmp_path / name, columns, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
    (tmp_path / "case.toml").write_text(described(ANGLE_STD, TORQUE_STD))
    source = find_modelica_model("drive")
    system = source.compile()
    model = model_of(source, system)
    plain = model.restricted(("phi",))
    data = bind(load_measurements(tmp_path), model.inputs, model.outputs)
    learning = in_metric(source, plain, data, data.learning, {"phi": ANGLE_STD}, Nuisances(shift_std=0.5 * STEP))
    base = fit_nominal(EffectSet(source, (), ("phi",)), plain, learning)

    tangent = Tangent(base, plain, learning)

    assert abs(base.fit.shift) > 0.999 * STEP
    candidates, _ = find_candidates(source, system, [c for c in effect_library() if c.id == "stimulation_delay"])
    (block,) = tangent.blocks(candidates, free_slots(system), lambda work, items: [work(item) for item in items])
    column = block.columns[:, 0] / np.linalg.norm(block.columns)
    assert abs(column @ tangent.error) > 0.9 * np.linalg.norm(tangent.error)
