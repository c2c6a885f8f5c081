"""What happens between samples of an input excuses an error up to what it can be, and no more."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

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
from orchestrator.measurements import bind, load_measurements
from orchestrator.models.patch import free_slots
from tests.noisy_drive import described

INERTIA, STEP, COUNT, ANGLE_STD, TORQUE_STD = 0.02, 0.004, 500, 1e-6, 1e-5


def stage_of(folder: Path, share: float) -> Stage:
    """The test of a drive whose angle yields with its torque as if `share` of the second difference were added to that."""
    random, time = np.random.default_rng(3), np.arange(COUNT) * STEP
    for name in ("a.csv", "b.csv", "c.csv"):
        torque = np.sin(np.outer(time, [3.0, 11.0, 37.0]) + random.uniform(0, 6, 3)) @ [0.05, 0.1, 0.1]
        rate = torque / INERTIA
        speed = np.r_[0.0, np.cumsum(0.5 * STEP * (rate[1:] + rate[:-1]))]
        angle = np.r_[0.0, np.cumsum(STEP * speed[:-1] + STEP**2 * (rate[:-1] / 3 + rate[1:] / 6))]
        angle += share * STEP**2 * rate
        shown = torque + TORQUE_STD * random.normal(size=COUNT), angle + ANGLE_STD * random.normal(size=COUNT)
        columns = np.column_stack([time, *shown])
        np.savetxt(folder / name, columns, delimiter=",", header="time,torque,phi", comments="", fmt="%.12g")
    (folder / "case.toml").write_text(described(ANGLE_STD, TORQUE_STD))
    source = find_modelica_model("drive")
    system = source.compile()
    model = model_of(source, system)
    plain, nothing = model.restricted(("phi",)), EffectSet(source, (), ("phi",))
    data = bind(load_measurements(folder), model.inputs, model.outputs)
    learning = in_metric(source, plain, data, data.learning, {"phi": ANGLE_STD}, Nuisances(shift_std=0.5 * STEP))
    tangent = Tangent(fit_nominal(nothing, plain, learning), plain, learning)
    candidates, _ = find_candidates(source, system, [c for c in effect_library() if c.id == "viscous_friction"])
    blocks = tangent.blocks(candidates, free_slots(system), lambda work, items: [work(item) for item in items])
    return Stage(tangent, blocks, 1, 0)


@pytest.mark.parametrize(("share", "is_structured"), [(0.1, False), (1.0, True)])
def test_error_is_no_noise_if_more_must_happen_between_samples_than_can(
    tmp_path: Path, share: float, is_structured: bool
) -> None:
    found = stage_of(tmp_path, share)

    assert found.tangent.base.cost > 4.0
    assert min(found.p_value, found.p_of_flexible) > SIGNIFICANT, "neither effects nor forces explain it"
    assert found.is_structured is is_structured


def test_a_model_with_effects_holds_the_inputs_that_were_held() -> None:
    source = replace(find_modelica_model("drive"), held=("torque",))
    candidates, _ = find_candidates(
        source, source.compile(), [c for c in effect_library() if c.id == "viscous_friction"]
    )
    chosen = EffectSet(source, tuple(candidates), ("phi",))
    models = model_of(source, source.compile()), chosen.model, chosen.fixed(np.array([0.1]), "Written")
    assert [model.compiled.held for model in models] == [("torque",)] * 3
