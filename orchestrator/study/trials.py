"""Trials through the co-simulation engine: the arm of the study and the person who holds it, two FMUs side by side."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.cosim import ComponentSpec, Connection, System, Value, simulate
from orchestrator.cosim.built import built_fmu
from orchestrator.study.design import POSITIONS, TRIAL_S, Caregiver, Trial
from orchestrator.study.muscles import statics, wrist

Array = NDArray[Any]
STEP_S = 1e-3
SIGNALS = ("arm.q1", "arm.q2", "arm.w1", "arm.w2", "caregiver.fx", "caregiver.fy")
STOPS = np.array([[-0.2, 0.3], [1.7, 2.4]])  # rad, where the arm ends; lower, upper
_SOURCE = Path(__file__).parent / "Caregivers.mo"


def run_trial(trial: Trial, caregiver: Caregiver, step: float = STEP_S) -> Array:
    """Record of a trial, (n, 6): q1, q2, w1, w2, fx, fy at every step from 0 to 2 s.

    The arm is at rest at its position and the caregiver holds it against its springs; at time 0 the stimulation sets in.

    Args:
        trial: posture and stimulation.
        caregiver: who holds the arm.
        step: of the simulation, in s.

    Raises:
        ComponentError: if a model fails on the way.
    """
    result = simulate(_system(trial, caregiver), step=step, stop=TRIAL_S, record=SIGNALS)
    return np.column_stack([result[name] for name in SIGNALS])


def _system(trial: Trial, caregiver: Caregiver) -> System:
    arm, person = fmus()
    position = POSITIONS[trial.position]
    place = wrist(position[None])[0]
    push = -statics(np.array([[*position, 0.0, 0.0]]))[0]
    values = {
        **caregiver.values(),
        **dict(zip(("x0", "y0"), place + trial.target_off, strict=True)),
        **dict(zip(("x", "y"), place, strict=True)),
        **dict(zip(("hx", "hy"), push, strict=True)),
        **{f"tremor[{k + 1}]": number for k, number in enumerate(trial.tremor_hz)},
        **{f"phaseX[{k + 1}]": number for k, number in enumerate(trial.phases[0])},
        **{f"phaseY[{k + 1}]": number for k, number in enumerate(trial.phases[1])},
    }
    start = {f"linkage.q[{k + 1}]": angle for k, angle in enumerate(position)}
    activation = {f"alpha_{k + 1}": number for k, number in enumerate(trial.activation)}
    return System(
        f"trial {trial.number + 1}",
        {
            "arm": ComponentSpec("arm", source=arm, values=_given({**start, **activation})),
            "caregiver": ComponentSpec("caregiver", source=person, values=_given(values)),
        },
        tuple(Connection(f"arm.{name}", f"caregiver.{name}") for name in ("x", "y", "vx", "vy"))
        + tuple(Connection(f"caregiver.{name}", f"arm.{name}") for name in ("fx", "fy")),
    )


def _given(numbers: Mapping[str, float]) -> dict[str, Value]:
    return {name: Value(float(number)) for name, number in numbers.items()}


@cache
def fmus() -> tuple[str, str]:
    """The FMUs of the arm and of a caregiver, built where they are not."""
    found = [str(built_fmu(f"{_SOURCE}:Caregivers.{name}")) for name in ("HeldArm", "Caregiver")]
    return found[0], found[1]
