"""A plant made of an arm's FMU: the virtual robot's joints 2 and 3 move it, and a virtual caregiver holds its wrist."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hil.emulation.planar import PLANE, Placement
from hil.virtual.caregiver import Caregiver
from hil.virtual.plant import FreeJoints
from orchestrator.cosim.built import built_fmu
from orchestrator.cosim.fmu import open_fmu
from orchestrator.cosim.system import ComponentSpec

# The robot makes the muscles' torques, so the plant's own muscles pull not even when they are stretched.
NO_MUSCLES = {"Kp": 0.0}
_INPUTS = ("correction_q1", "correction_q2", "fx", "fy")
_OUTPUTS = ("q1", "q2", "linkage.w[1]", "linkage.w[2]", "linkage.r[1]", "linkage.r[2]", "linkage.v[1]", "linkage.v[2]")


class ArmPlant:
    """An arm on a robot; joint 1, which lifts it, moves by itself.

    Args:
        model: a built-in model with the ports of `arm`, or `FILE.mo:Class`; hidden effects live in it.
        values: its parameters.

    Raises:
        MisfitError: if the model cannot be built.
    """

    def __init__(
        self,
        angles: np.ndarray,
        placement: Placement,
        model: str = "arm",
        values: Mapping[str, float] | None = None,
        caregiver: Caregiver | None = None,
    ) -> None:
        self.placement, self.caregiver = placement, caregiver or Caregiver()
        self._lift = FreeJoints(np.array(angles[:1]))
        self._fmu = open_fmu(ComponentSpec("plant", "fmu", str(built_fmu(model))), Path())
        start = placement.angles(np.asarray(angles))
        given = {"linkage.q[1]": start[0], "linkage.q[2]": start[1], **NO_MUSCLES, **(values or {})}
        self._fmu.initialise(0.0, None, None)
        self._fmu.set(list(given), [float(value) for value in given.values()])
        self._fmu.start()
        self._time = 0.0
        self._show()
        self.force = np.zeros(3)
        self._acceleration = np.zeros(2)

    def step(self, torques: np.ndarray, seconds: float) -> None:
        """Move on by a time, under constant joint torques (3,) in N.m.

        The caregiver's force of a step is that of its middle, as far as it can be told before; `force` is that at its
        end. A force that lagged half a step behind would look like negative friction to whoever has the recording.
        """
        self._lift.step(torques[:1], seconds)
        self.caregiver.advance(self._wrist, self._velocity, seconds)
        half = 0.5 * seconds
        pull = self.caregiver.force(self._wrist + half * self._velocity, self._velocity + half * self._acceleration)
        before = self._velocity
        self._fmu.set(_INPUTS, [*self.placement.speeds(torques).tolist(), *pull.tolist()])
        self._time = self._fmu.step(self._time, seconds).time
        self._show()
        self._acceleration = (self._velocity - before) / seconds
        self.force = self.placement.sensor_force(self.caregiver.force(self._wrist, self._velocity), self._angles)

    def close(self) -> None:
        """Give the FMU back."""
        self._fmu.terminate()

    def _show(self) -> None:
        q1, q2, w1, w2, *wrist = self._fmu.get(_OUTPUTS)
        self._angles = np.array([q1, q2])
        self._wrist, self._velocity = np.array(wrist[:2]), np.array(wrist[2:])
        self.angles = np.concatenate([self._lift.angles, self.placement.robot_angles(self._angles)[list(PLANE)]])
        self.speeds = np.concatenate([self._lift.speeds, self.placement.sign * np.array([w1, w2])])
