"""Play and elastic parts of the library: against the truth simulator, which solves the same laws on its own."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import effect_library
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
    q, _ = simulate(name, values, fine, start, np.zeros(len(start)), step=1e-3 / PARTS)
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
    effect = Attachment("tendon1", "FESArm.Effects.Tendon.SeriesElasticity", {"strain": 0.06, "creep": 5e-4})

    modelled = _modelled("arm", [effect], u, {"linkage.q[1]": start[0], "linkage.q[2]": start[1]})

    assert np.abs(rigid - truth).max(axis=0).min() > 0.1
    # The tendon's own damping, which the truth lacks, delays forces by half a millisecond.
    np.testing.assert_allclose(modelled, truth, atol=5e-4)


def test_drive_with_an_elastic_joint_moves_as_in_the_truth() -> None:
    """At a step the twist rings at its resonance of 7 Hz; the encoder sits on the motor."""
    inertia = MACHINES["drive"].values["J"]
    u = np.where(TIME < 1.0, 0.05, -0.02)[:, None]
    values = {"JMotor": 0.4 * inertia, "JLoad": 0.6 * inertia, "k": 10.0, "d": 0.02}
    truth = _true("two-mass", values, u, [0.0, 0.0])[:, :1]
    rigid = _true("drive", {"J": inertia}, u, [0.0])
    effect = Attachment(
        "transmission1", "FESArm.Effects.Transmission.JointElasticity", {"k": 10.0, "d": 0.02, "share": 0.4}
    )

    modelled = _modelled("drive", [effect], u, {})

    assert np.abs(rigid - truth).max() > 1e-3
    np.testing.assert_allclose(modelled, truth, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "effect"), [("two-mass", "backlash"), ("arm", "series_elasticity"), ("drive", "joint_elasticity")]
)
def test_diagnosis_can_put_the_effect_into_its_machine(name: str, effect: str) -> None:
    base = find_modelica_model(name)
    system = base.compile()
    cards = [card for card in effect_library() if card.id == effect]

    (candidate,) = find_candidates(base, system, cards)[0]

    added = EffectSet(base, [candidate], system.outputs)
    low, high = added.bounds()
    assert np.all((low <= added.first_guess()) & (added.first_guess() <= high))
    # Without the effect the model has neither its states nor its parameters.
    assert {v.name for v in system.states} <= {v.name for v in added.system.states}
    assert not [v.name for v in system.parameters if v.name.startswith(f"{candidate.slot}.")]
