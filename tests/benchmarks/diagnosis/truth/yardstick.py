"""How large an effect is against the noise, once what free start values could explain is taken out of both."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tests.benchmarks.diagnosis.truth.excitation import Plan
from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.truth.run import Injection, Run, nominal_run, run_trial
from tests.benchmarks.diagnosis.truth.sensors import Recorder

_MOVE = 1e-6


@dataclass(frozen=True, eq=False)
class Yardstick:
    """Measures effects on the planned trials of a case.

    `noise` (ny,) is the rms that noise alone leaves of a free run whose start values are free: the sensors' own, and
    that of measured inputs carried through the nominal machine. `bases` hold, for each trial, an orthonormal basis
    (n ny, k) of what start values can do, of outputs in units of `scale` (ny,) at every `stride`-th step.
    """

    machine: Machine
    plans: tuple[Plan, ...]
    noise: np.ndarray
    scale: np.ndarray
    bases: tuple[np.ndarray, ...]

    @staticmethod
    def of(
        machine: Machine, plans: Sequence[Plan], runs: Sequence[Run], recorder: Recorder, random: np.random.Generator
    ) -> "Yardstick":
        """Build it from the nominal runs of the plans."""
        scale = np.full(len(machine.outputs), recorder.output_noise)
        bases = tuple(_basis(machine, run, scale) for run in runs)
        carried = np.zeros(len(scale))
        for run, basis in zip(runs, bases, strict=True):
            if machine.inputs:
                columns = recorder.record(run, random)
                noisy = [np.interp(run.time, columns["time"], columns[name]) for name in machine.inputs]
                change = nominal_run(machine, run, np.column_stack(noisy)) - run.outputs
                carried += np.mean(_left(machine, change, scale, basis) ** 2, axis=0) / len(runs)
        noise = scale * np.sqrt(1 + carried)
        return Yardstick(machine, tuple(plans), noise, scale, bases)

    def where_most(self, injections: Sequence[Injection], trials: int) -> "Yardstick":
        """The same for a few trials only, those in which effects do the most."""
        done = [np.sum(change**2) for change in self._changes(injections)]
        return self.in_trials(sorted(np.argsort(done)[-trials:]))

    def in_trials(self, chosen: Sequence[int]) -> "Yardstick":
        """The same for some of the trials only."""
        return replace(self, plans=tuple(self.plans[k] for k in chosen), bases=tuple(self.bases[k] for k in chosen))

    def enr(self, injections: Sequence[Injection]) -> float:
        """ENR: rms over trials and signals of (run with the effects - nominal free run) / noise."""
        return float(np.sqrt(np.mean(self.change(injections) ** 2)))

    def change(self, injections: Sequence[Injection]) -> np.ndarray:
        """What effects do, over the noise and beside what start values can do: samples of all trials and signals."""
        return np.concatenate(list(self._changes(injections)))

    def _changes(self, injections: Sequence[Injection]) -> Iterator[np.ndarray]:
        for plan, basis in zip(self.plans, self.bases, strict=True):
            run = run_trial(self.machine, plan, injections)
            change = run.outputs - nominal_run(self.machine, run, run.recorded)
            yield (_left(self.machine, change, self.scale, basis) * self.scale / self.noise).ravel()


def _stride(machine: Machine) -> int:
    return round(1 / (machine.rate_hz * machine.step))


def _basis(machine: Machine, run: Run, scale: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the outputs' changes with the start values of the nominal machine."""
    here = nominal_run(machine, run, run.recorded)
    moves = []
    for speeds in (False, True):
        for k in range(0 if machine.name == "tanks" and speeds else len(machine.order)):
            moved = run.moved(k, 0.0 if speeds else _MOVE, _MOVE if speeds else 0.0)
            change = (nominal_run(machine, moved, run.recorded) - here) / scale
            moves.append(change[:: _stride(machine)].ravel() / _MOVE)
    basis, _ = np.linalg.qr(np.column_stack(moves))
    return basis


def _left(machine: Machine, change: np.ndarray, scale: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """What start values leave of a change of the outputs, in units of `scale`, (n, ny)."""
    series = (change / scale)[:: _stride(machine)]
    flat = series.ravel()
    return (flat - basis @ (basis.T @ flat)).reshape(series.shape)
