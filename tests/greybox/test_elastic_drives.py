"""A drive whose load hangs on a spring: named in a model without slots, and written back as what two masses do."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.greybox.effects import with_effects
from orchestrator.measurements import load_measurements
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.verdicts.result import Estimate, NamedEffect
from tests.shaft import SHAFT
from tests.three_trials import three_trials

INERTIA, SHARE, FREQUENCY, DAMPING = 0.02, 0.4, 9.0, 0.05
TIME = np.arange(400) * 0.01


def torque(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies, in rad/s, phases and sizes, in N.m, of the sines of a torque."""
    random = np.random.default_rng(seed)
    return random.uniform(2.0, 25.0, 4), random.uniform(0, 6.28, 4), random.uniform(0.02, 0.1, 4)


def angle_of_motor(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Torque and angle of the motor at TIME: two masses on a spring and a damper, in their own coordinates."""
    waves, phases, sizes = torque(seed)

    pushed = np.sum([a * np.sin(w * TIME + p) for w, p, a in zip(waves, phases, sizes, strict=True)], axis=0)

    load, motor = SHARE * INERTIA, (1 - SHARE) * INERTIA
    stiffness, damper = load * FREQUENCY**2, 2 * DAMPING * load * FREQUENCY

    def rates(t: float, x: np.ndarray) -> list[float]:
        spring = stiffness * (x[0] - x[2]) + damper * (x[1] - x[3])
        return [x[1], (np.interp(t, TIME, pushed) - spring) / motor, x[3], spring / load]

    run = solve_ivp(rates, (0, TIME[-1]), np.zeros(4), t_eval=TIME, rtol=1e-9, atol=1e-11, max_step=0.01)
    return pushed, run.y[0]


def written_model(folder: Path) -> str:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "Shaft.mo").write_text(SHAFT)
    return f"{folder / 'Shaft.mo'}:Shaft"


def test_the_written_model_moves_as_two_masses_do(tmp_path: Path) -> None:
    values = {"share": (SHARE, "1"), "frequency": (FREQUENCY, "1/s"), "damping": (DAMPING, "1")}
    effect = NamedEffect("joint_elasticity", "phi", {k: Estimate(v, unit, (v, v)) for k, (v, unit) in values.items()})
    model = with_effects(find_modelica_model(written_model(tmp_path)), [effect], "Elastic", tmp_path)
    pushed, angle = angle_of_motor(seed=1)
    system = model.compile()
    start = {v.name: 0.0 for v in system.states}
    found = SymbolicModel("Elastic", system, ("phi",)).simulate(TIME, pushed[:, None], ("phi",), start)
    assert np.abs(found[:, 0] - angle).max() < 1e-3 * np.abs(angle).max()


def test_a_load_on_a_spring_is_named_with_its_antiresonance(tmp_path: Path) -> None:
    model = written_model(tmp_path)
    (tmp_path / "case.toml").write_text(three_trials({"torque": "N.m", "phi": "rad"}))
    random = np.random.default_rng(7)
    for trial in (1, 2, 3):
        pushed, angle = angle_of_motor(seed=trial)
        rows = np.column_stack([TIME, pushed, angle + 1e-4 * random.normal(size=len(TIME))])
        np.savetxt(tmp_path / f"trial_{trial}.csv", rows, delimiter=",", header="t,torque,phi", comments="")
    found = diagnose(find_modelica_model(model), load_measurements(str(tmp_path)), workers=1)
    assert found.verdict == "named" and [effect.id for effect in found.effects] == ["joint_elasticity"]
    (effect,) = found.effects
    assert effect.parameters["share"].value == pytest.approx(SHARE, rel=0.05)
    assert effect.parameters["frequency"].value == pytest.approx(FREQUENCY, rel=0.02)
