"""What an effect may know of a case when it is drawn: the machine, chance, and how far the nominal machine moves."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.truth.run import Injection, Run

# An effect of the given size; 1 is a size that is usually small, and more is more.
Sized = Callable[[float], Injection]


@dataclass(frozen=True, eq=False)
class Context:
    """`runs` are the planned trials of the nominal machine."""

    machine: Machine
    random: np.random.Generator
    runs: tuple[Run, ...]

    def quantile(self, joint: int, share: float) -> float:
        """Position of a joint (from 0) below which it spends a share of its time."""
        return float(np.quantile(np.concatenate([run.q[:, joint] for run in self.runs]), share))

    def speed(self, joint: int) -> float:
        """Root mean square of a joint's speed, rad/s."""
        return float(np.sqrt(np.mean(np.concatenate([run.v[:, joint] for run in self.runs]) ** 2)))

    def shares(self) -> np.ndarray:
        """How an effect at the joints is divided: mostly over both, sometimes on one."""
        if self.machine.joints == 1:
            return np.ones(1)
        if self.random.random() < 0.6:
            return self.random.uniform(0.5, 1.0, 2)
        return np.eye(2)[self.random.integers(2)]


def joint_site(shares: np.ndarray) -> str:
    """`joint1`, `joint2` or `joint1+joint2`.

    >>> joint_site(np.array([0.0, 1.0]))
    'joint2'
    """
    return "+".join(f"joint{k}" for k, share in enumerate(shares, 1) if share)


def indexed(name: str, values: np.ndarray) -> dict[str, float]:
    """`{"b[1]": ..., "b[2]": ...}`; elements that are 0 are left out.

    >>> indexed("b", np.array([0.0, 2.0]))
    {'b[2]': 2.0}
    """
    return {f"{name}[{k}]": float(value) for k, value in enumerate(values, 1) if value}


def numbered(name: str, values: np.ndarray) -> dict[str, float]:
    """The same for the simulator: `{"b1": ..., "b2": ...}`."""
    return {f"{name}{k}": float(value) for k, value in enumerate(values, 1) if value}
