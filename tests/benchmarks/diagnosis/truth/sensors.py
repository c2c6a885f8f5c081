"""Sensors and recorders: noise, resolution, and for some cases an ugly recorder."""

from dataclasses import dataclass

import numpy as np

from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.truth.run import Run

LEVELS = ("lo", "mid", "hi")
# Standard deviation and resolution of encoders (rad) and of distance and level sensors (m).
_STD = {"lo": 1e-5, "mid": 1e-4, "hi": 1e-3}
_RESOLUTION = {"lo": 2 * np.pi / 2**19, "mid": 2 * np.pi / 2**16, "hi": 2 * np.pi / 2**13}
# Noise of a measured input as a share of its rms; of a drive's motor, whose torque is known from its current and is
# integrated twice on its way to the encoder; of the arm's force sensor in N.
_INPUT_SHARE = {"lo": 0.005, "mid": 0.02, "hi": 0.05}
_MOTOR_SHARE = {"lo": 1e-4, "mid": 5e-4, "hi": 2e-3}
_FORCE_N = {"lo": 0.02, "mid": 0.05, "hi": 0.25}
OUTLIER_SHARE, OUTLIER_SIZE = 0.005, 20.0
# Standard deviation of an ugly clock, in samples: at 5 rad/s it adds 2e-4 rad to an encoder.
JITTER = 0.01


@dataclass(frozen=True, eq=False)
class Recorder:
    """Noise of a case: `input_std` (nu,) and `output_std` (ny,) without resolution; `ugly` adds what goes wrong.

    Noise of inputs is coloured (first order, 50 Hz for a machine of ordinary speed); an ugly recorder's noise is AR(1)
    with a memory of ten samples, on all columns, with outliers, missing rows and a jittering clock.
    """

    machine: Machine
    level: str
    input_std: np.ndarray
    ugly: bool = False

    @staticmethod
    def of(machine: Machine, level: str, runs: list[Run], ugly: bool = False) -> "Recorder":
        """The recorder of a case, its input noise in proportion to the inputs of the nominal runs."""
        rms = np.sqrt(np.mean(np.concatenate([run.recorded for run in runs]) ** 2, axis=0))
        std = rms * (_INPUT_SHARE if machine.name == "tanks" else _MOTOR_SHARE)[level]
        # A sensor is noisy while its input is idle, too; a declared noise of 0 would be no declaration.
        std = np.maximum(std, 1e-3 * machine.torque * _MOTOR_SHARE[level] / _MOTOR_SHARE["hi"])
        for k, name in enumerate(machine.inputs):
            if name in machine.commands:
                std[k] = 0.0
            elif machine.name == "arm":
                std[k] = _FORCE_N[level]
        return Recorder(machine, level, std, ugly)

    @property
    def resolution(self) -> float:
        """Step of the encoders or level sensors."""
        return _RESOLUTION[self.level]

    @property
    def std(self) -> float:
        """Standard deviation of the encoders or level sensors, without resolution."""
        return _STD[self.level]

    @property
    def output_noise(self) -> float:
        """Standard deviation of what a sensor adds, resolution included."""
        return float(np.hypot(self.std, self.resolution / np.sqrt(12)))

    def record(self, run: Run, random: np.random.Generator) -> dict[str, np.ndarray]:
        """Columns of a trial as they come out of the recorder: time, inputs, outputs."""
        machine, step = self.machine, 1 / self.machine.rate_hz
        time = np.arange(round(run.time[-1] / step)) * step
        at = time + (random.normal(0, JITTER * step, len(time)) if self.ugly else 0.0)
        columns = {"time": time}
        memory = 0.9 if self.ugly else float(np.exp(-2 * np.pi * 0.2))
        for k, name in enumerate(machine.inputs):
            columns[name] = np.interp(at, run.time, run.recorded[:, k])
            columns[name] += self.input_std[k] * coloured(len(time), memory, random)
        for k, name in enumerate(machine.outputs):
            exact = np.interp(at, run.time, run.outputs[:, k])
            noise = self.std * coloured(len(time), 0.9 if self.ugly else 0.0, random)
            if self.ugly:
                noise += (
                    OUTLIER_SIZE * self.std * random.normal(size=len(time)) * (random.random(len(time)) < OUTLIER_SHARE)
                )
            columns[name] = np.round((exact + noise) / self.resolution) * self.resolution
        if self.ugly:
            kept = _without_dropouts(len(time), random)
            columns = {name: values[kept] for name, values in columns.items()}
        return columns


def coloured(n: int, memory: float, random: np.random.Generator) -> np.ndarray:
    """AR(1) noise of variance 1: each value keeps `memory` of the one before."""
    white, noise = random.normal(size=n), np.empty(n)
    noise[0] = white[0]
    for k in range(1, n):
        noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * white[k]
    return noise


def _without_dropouts(n: int, random: np.random.Generator) -> np.ndarray:
    kept = np.ones(n, bool)
    for begin in np.flatnonzero(random.random(n) < 0.002):
        kept[begin : begin + random.integers(1, 9)] = False
    kept[0] = True
    return kept
