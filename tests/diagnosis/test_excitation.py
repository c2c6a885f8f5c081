"""A record of a right model: adequate if it excites the effects, cannot_tell where it does not; small effects are found."""

from pathlib import Path

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.library.cards import effect_library
from orchestrator.measurements import load_measurements
from orchestrator.models.compiled import CompiledModel
from orchestrator.verdicts.result import Diagnosis

CARDS = [c for c in effect_library() if c.id in ("muscle_weakness", "moment_arm_error", "viscous_friction")]
TIME = np.arange(1000) * 0.004
NOISE = 5e-4


def record(folder: Path, gains: list[float], *, damping: float = 0.3) -> Path:
    """Two trials of the arm, stimulated in steps that `gains` scale for each muscle."""
    system = find_modelica_model("arm").compile()
    # Columns that stay and jump count as held, so that is what the arm gets.
    arm = CompiledModel(system, ["q1", "q2"], ["linkage.b[1]"], held=[v.name for v in system.inputs])
    random = np.random.default_rng(3)
    for k in (1, 2):
        alpha = np.repeat(random.uniform(0.1, 0.5, (10, 6)), 100, axis=0) * gains
        inputs = np.column_stack([alpha, np.zeros((1000, 4))])
        q = arm.run(TIME, inputs, arm.with_values([damping]), np.array([0.8, 1.2, 0, 0]), substeps=2).outputs
        table = np.column_stack([TIME, alpha, q + NOISE * random.standard_normal(q.shape)])
        header = "time," + ",".join(f"alpha_{i}" for i in range(1, 7)) + ",q1,q2"
        np.savetxt(folder / f"trial_{k}.csv", table, delimiter=",", header=header, comments="")
    units = "\n".join(f'alpha_{i} = "1"' for i in range(1, 7))
    text = f'files = ["trial_1.csv", "trial_2.csv"]\nlearning = [1]\nheld_out = [2]\n[columns]\ntime = "s"\n{units}\n'
    (folder / "case.toml").write_text(f'{text}q1 = "rad"\nq2 = "rad"\n[sensors]\nencoder_noise_std_rad = {NOISE}\n')
    return folder


def diagnosed(folder: Path) -> Diagnosis:
    return diagnose(find_modelica_model("arm"), load_measurements(folder), cards=CARDS, workers=1)


def test_rich_record_of_a_right_model_is_adequate(tmp_path: Path) -> None:
    found = diagnosed(record(tmp_path, [1.0] * 6))

    assert (found.verdict, found.effects) == ("adequate", ())


def test_muscle_that_is_never_stimulated_cannot_be_judged(tmp_path: Path) -> None:
    found = diagnosed(record(tmp_path, [1.0, 1.0, 1.0, 0.0, 1.0, 1.0]))

    assert found.verdict == "cannot_tell"
    assert any("effects at muscle4:" in warning for warning in found.warnings)


def test_friction_below_an_overstated_floor_is_named(tmp_path: Path) -> None:
    """10 % more damping at one joint; the floor that the case's steps of stimulation suggest is far too high."""
    found = diagnosed(record(tmp_path, [1.0] * 6, damping=0.33))

    assert found.p_value is not None
    assert found.p_value <= 0.01
    assert [effect.id for effect in found.effects] == ["viscous_friction"]
    low, high = found.effects[0].parameters["b[1]"].ci90
    assert low < 0.03 < high
