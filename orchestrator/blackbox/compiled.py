"""Runs of an FMU with effects, with the interface of a compiled model: outputs and their slopes."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.interpolate import PchipInterpolator

from fmus.errors import ComponentError
from orchestrator.blackbox.coupled import CoupledSystem
from orchestrator.blackbox.library import OUTPUT_SLOTS, PARAMETER_SLOT
from orchestrator.blackbox.ports import Port
from orchestrator.blackbox.process import SYSTEM_ENDINGS, FmuProcesses
from orchestrator.blackbox.sites import Sites
from orchestrator.blackbox.worker import RunRequest, Variant
from orchestrator.models.compiled import NOTHING_BEFORE, CompiledModel, FreeRun, build_library

RUNNER = Path(__file__).with_name("runner.c")
# Relative steps of finite differences: an integrator with fixed steps repeats itself exactly, one that adapts does not.
STEP_EXCHANGE, STEP_COSIMULATION = 1e-6, 1e-4
# A share of a parameter, for solvers that adapt their steps to it.
STEP_OF_SHARE = 1e-3


class CoupledRuns(CompiledModel):
    """Free runs of a coupled system, for a chosen tuple of outputs and of free parameters."""

    def __init__(
        self,
        system: CoupledSystem,
        sites: Sites,
        settable: Sequence[Port],
        processes: FmuProcesses,
        outputs: Sequence[str],
        free: Sequence[str] = (),
        held: Sequence[str] = (),
    ) -> None:
        super().__init__(system, outputs, free, held=held)
        self.coupled, self.sites, self.settable, self.processes = system, sites, tuple(settable), processes
        self._columns = [list(system.outputs).index(name) for name in outputs]
        # What acts on nothing of the FMU asks for no shorter steps of it.
        beside = all(part.slot in (*OUTPUT_SLOTS, PARAMETER_SLOT) for part in system.mounted)
        is_system = processes.path.suffix.lower() in SYSTEM_ENDINGS
        self.has_own_steps = is_system or (processes.cosimulation and beside)
        self._n_states = 0 if processes.cosimulation else len(sites.states)

    def run(
        self,
        time: np.ndarray,
        inputs: np.ndarray,
        parameters: np.ndarray,
        start: np.ndarray,
        *,
        substeps: int = 1,
        sensitivities: bool = False,
        before: np.ndarray = NOTHING_BEFORE,  # its delays are columns of inputs, and none are counted as delays
    ) -> FreeRun:
        variants, steps = [self._variant(time, inputs, parameters, start)], []
        if sensitivities:
            step = STEP_COSIMULATION if self.processes.cosimulation else STEP_EXCHANGE
            for k in range(len(start)):
                moved = start.copy()
                steps.append(step * max(abs(start[k]), 1.0))
                moved[k] += steps[-1]
                variants.append(self._variant(time, inputs, parameters, moved))
            for k in self._free_positions:
                changed = parameters.copy()
                variable = self.coupled.parameters[k]
                span = (variable.maximum or 0.0) - (variable.minimum or 0.0)
                is_share = any(k == share for _, _, share in self.coupled.wrong)
                steps.append(STEP_OF_SHARE if is_share else step * max(abs(parameters[k]), 0.01 * span))
                changed[k] += steps[-1]
                variants.append(self._variant(time, inputs, changed, start))
        request = RunRequest(
            library=self.library_file,
            wiring=self.sites.wiring,
            time=time,
            inputs=inputs,
            n_states=self._n_states,
            n_results=len(self.coupled.outputs),
            substeps=substeps,
            variants=tuple(variants),
            n_added=int(self.coupled.rhs.numel_out(0)) - self.sites.wiring.n_inputs,
            held=tuple(v.name in self.held for v in self.coupled.inputs),
        )
        answers = self.processes.ask(request)
        reached, first = answers[0]
        if reached != len(time):
            raise ComponentError(self._failure(reached, time))
        outputs = self._shown(time, first, parameters)
        if not sensitivities:
            return FreeRun(outputs, None)
        slopes = np.zeros((*outputs.shape, len(steps)))
        for k, ((n, moved), step) in enumerate(zip(answers[1:], steps, strict=True)):
            if n == len(time):  # a run that fails a hair's breadth away tells nothing about this one
                slopes[:, :, k] = (self._shown(time, moved, variants[k + 1].parameters) - outputs) / step
        return FreeRun(outputs, slopes)

    def _shown(self, time: np.ndarray, outputs: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """The outputs asked for (n, ny), those that are read late shifted; before the run they were what they begin with."""
        found = outputs.copy() if self.coupled.late else outputs
        for output, place in self.coupled.late:
            found[:, output] = PchipInterpolator(time, outputs[:, output])(
                np.maximum(time - parameters[place], time[0])
            )
        return found[:, self._columns]

    @property
    def operations(self) -> int:
        return 0  # what goes on inside an FMU is its own

    @cached_property
    def library_file(self) -> Path:
        """The runner, compiled with the effects."""
        assert self.coupled.outer is not None
        generator = ca.CodeGenerator("effects.c", {"with_header": False, "main": False})
        generator.add(self.coupled.rhs)
        generator.add(self.coupled.outer)
        return build_library(str(generator.dump()), RUNNER)

    def _failure(self, reached: int, time: np.ndarray) -> str:
        name = f"FMU {self.processes.path.name}"
        if reached == -1:
            return f"{name}: no memory for a run of {len(time)} samples"
        if reached < -1:
            return f"{name} failed: it refused a call between t = {time[-2 - reached]:.4g} s and the next sample"
        return f"{name} left the finite numbers at t = {time[reached]:.4g} s"

    def _variant(self, time: np.ndarray, inputs: np.ndarray, parameters: np.ndarray, start: np.ndarray) -> Variant:
        delayed = np.zeros((len(time), len(self.coupled.delayed)))
        for j, (i, k) in enumerate(self.coupled.delayed):
            delayed[:, j] = np.interp(time - parameters[k], time, inputs[:, i])
        settings: dict[int, list[float]] = {k: [value] for k, value in self.coupled.values.items()}
        settings |= {reference: [own * (1.0 + parameters[k])] for reference, own, k in self.coupled.wrong}
        if self.processes.cosimulation:
            for port, value in zip(self.settable, start, strict=False):
                settings.setdefault(port.reference, []).append(float(value))
            start = start[len(self.settable) :]
        return Variant(np.asarray(parameters, dtype=float), delayed, np.asarray(start, dtype=float), settings)
