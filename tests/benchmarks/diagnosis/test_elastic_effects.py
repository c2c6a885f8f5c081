"""Play and elastic parts of the library: against the truth simulator, which solves the same laws on its own."""

from collections.abc import Mapping, Sequence

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.models.patch import Attachment, check_attached, patched_model
from orchestrator.models.symbolic import SymbolicModel
from tests.benchmarks.diagnosis.truth.machines import MACHINES
from tests.benchmarks.diagnosis.truth.native import simulate

TIME = np.arange(2001) * 1e-3
# The truth is hard where the library's laws are rounded, so it needs small steps.
PARTS = 16
FINE = np.arange(2000 * PARTS + 1) * 1e-3 / PARTS


def _true(name: str, values: Mapping[str, float], u: np.ndarray, start: Sequence[float]) -> np.ndarray:
    """Positions (n, dofs) at `TIME` from rest; commands (n, nu) are straight between the samples."""
    fine = np.column_stack([np.interp(FINE, TIME, column) for column in u.T])
    q, _ = simulate(name, values, fine, start, np.zeros(2), step=1e-3 / PARTS)
    return q[::PARTS]


def _modelled(name: str, effects: Sequence[Attachment], u: np.ndarray, start: Mapping[str, float]) -> np.ndarray:
    """Outputs of a built-in model with effects, from rest, for commands (n, nu); its other inputs are zero."""
    system = patched_model(find_modelica_model(name), "WithEffect", effects).compile()
    check_attached(system, effects)
    own = list(MACHINES[name].inputs)
    columns = [u[:, own.index(v.name)] if v.name in own else np.zeros(len(u)) for v in system.inputs]
    states = {v.name: start.get(v.name, v.start or 0.0) for v in system.states}
    model = SymbolicModel("WithEffect", system)
    return model.simulate(TIME, np.column_stack(columns), list(MACHINES[name].outputs), states)


def test_drive_with_backlash_moves_as_in_the_truth() -> None:
    values = {**MACHINES["two-mass"].values, "b1": 0.02, "b2": 0.02}
    u = 0.02 * np.sin(2 * np.pi * TIME)[:, None]
    effects = [
        Attachment("jointTorque1", "FESArm.Effects.JointTorque.ViscousFriction", {"b": {"b[1]": 0.02, "b[2]": 0.02}}),
        Attachment("shaft1", "FESArm.Effects.Shaft.Backlash", {"gap": 0.02}),
    ]
    truth, tight = (_true("two-mass", {**values, "gap": gap}, u, [0.0, 0.0]) for gap in (0.02, 0.0))

    modelled = _modelled("two-mass", effects, u, {"phiMotor": 0.0, "phiLoad": 0.0})

    assert np.abs(tight - truth).max(axis=0).min() > 4e-3
    np.testing.assert_allclose(modelled, truth, atol=2e-4)


def test_arm_on_elastic_tendons_moves_as_in_the_truth() -> None:
    tones = np.array([1.0, 1.3, 0.7, 1.9, 1.1, 1.6])
    u = np.hstack([0.2 * np.sin(np.pi * np.outer(TIME, tones)) ** 2, np.zeros((len(TIME), 2))])
    start = [0.1, 2.0]
    values = MACHINES["arm"].values
    truth = _true("arm", {**values, "strain": 0.06}, u, start)
    rigid = _true("arm", values, u, start)
    effect = Attachment("tendon1", "FESArm.Effects.Tendon.SeriesElasticity", {"strain": 0.06})

    modelled = _modelled("arm", [effect], u, {"linkage.q[1]": start[0], "linkage.q[2]": start[1]})

    assert np.abs(rigid - truth).max(axis=0).min() > 0.1
    # The tendon's own damping, which the truth lacks, delays forces by half a millisecond.
    np.testing.assert_allclose(modelled, truth, atol=5e-4)
