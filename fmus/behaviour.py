"""Checks that run an FMU's native code: `python -m fmus.behaviour FOLDER RESULT`, as a process of its own.

FOLDER is an unpacked FMU; the findings are written to the file RESULT as a JSON list of lines. An FMU may crash or hang,
which is for the caller to notice (see `fmus.validate`).
"""

import json
import math
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

STEPS = 20


class Instance:
    """One instance of either FMI version, initialised at the start time, with values addressed by reference."""

    def __init__(self, folder: Path, description: Any, kind: str) -> None:
        from fmpy import instantiate_fmu  # type: ignore[import-untyped]

        self.fmu = instantiate_fmu(str(folder), description, fmi_type=kind)
        self.second = description.fmiVersion == "2.0"
        self.start = float(getattr(description.defaultExperiment, "startTime", None) or 0.0)
        if self.second:
            self.fmu.setupExperiment(startTime=self.start)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=self.start)
        self.fmu.exitInitializationMode()

    def get(self, references: list[int]) -> list[float]:
        """Values of variables."""
        read: Callable[[list[int]], list[float]] = self.fmu.getReal if self.second else self.fmu.getFloat64
        return list(read(references))

    def set(self, reference: int, value: float) -> None:
        """Set one variable."""
        write = self.fmu.setReal if self.second else self.fmu.setFloat64
        write([reference], [value])

    def enter_continuous_time(self) -> None:
        """From the initial event mode of model exchange to continuous time."""
        update = self.fmu.newDiscreteStates if self.second else self.fmu.updateDiscreteStates
        while update()[0]:
            pass
        self.fmu.enterContinuousTimeMode()

    def save(self) -> Any:
        """A snapshot."""
        return self.fmu.getFMUstate() if self.second else self.fmu.getFMUState()

    def restore(self, state: Any) -> None:
        """Go back to a snapshot and free it."""
        if self.second:
            self.fmu.setFMUstate(state)
            self.fmu.freeFMUstate(state)
        else:
            self.fmu.setFMUState(state)
            self.fmu.freeFMUState(state)

    def end(self) -> None:
        """Terminate and free."""
        self.fmu.terminate()
        self.fmu.freeInstance()


def behaviour_findings(folder: Path) -> list[str]:
    """What is wrong with the behaviour of an unpacked FMU, one line each."""
    from fmpy import read_model_description

    description = read_model_description(str(folder), validate=False)
    if any(variable.dimensions for variable in description.modelVariables):
        return []  # only scalars are perturbed and compared here
    findings: list[str] = []
    if description.coSimulation is not None:
        findings += _repeatability(folder, description)
    if description.modelExchange is not None:
        findings += _dependencies(folder, description)
    return findings


def _recorded(description: Any) -> list[int]:
    """References of all numbers that the model computes while it runs."""
    variables = [v for v in description.modelVariables if v.type in ("Real", "Float64")]
    return [v.valueReference for v in variables if v.causality in ("output", "local") and v.variability == "continuous"]


def _step_size(description: Any) -> float:
    experiment = description.defaultExperiment
    if experiment is not None and experiment.stepSize is not None:
        return float(experiment.stepSize)
    return float(getattr(experiment, "stopTime", None) or 1.0) / 1000


def _run(instance: Instance, begin: float, step: float, references: list[int]) -> list[list[float]]:
    rows = []
    for k in range(STEPS):
        instance.fmu.doStep(begin + k * step, step)
        rows.append(instance.get(references))
    return rows


def _repeatability(folder: Path, description: Any) -> list[str]:
    """Two instances give the same bits, and so does one that goes back to a snapshot."""
    references, step, findings = _recorded(description), _step_size(description), []
    names = {v.valueReference: v.name for v in reversed(description.modelVariables)}
    one, two = (Instance(folder, description, "CoSimulation") for _ in range(2))
    first, second = (_run(instance, instance.start, step, references) for instance in (one, two))
    if changed := _different(first, second):
        findings.append(f"two equal runs differ in {names[references[changed[0]]]!r}: {changed[1]!r}, {changed[2]!r}")
    elif description.coSimulation.canGetAndSetFMUstate:
        middle = one.start + STEPS * step
        state = one.save()
        ahead = _run(one, middle, step, references)
        one.restore(state)
        again = _run(one, middle, step, references)
        if changed := _different(ahead, again):
            name = names[references[changed[0]]]
            findings.append(f"after its state was restored {name!r} is {changed[2]!r}; it was {changed[1]!r}")
    one.end()
    two.end()
    return findings


def _different(one: Iterable[list[float]], other: Iterable[list[float]]) -> tuple[int, float, float] | None:
    """Column and values of the first difference; NaN equals NaN."""
    for row, twin in zip(one, other, strict=True):
        for column, (a, b) in enumerate(zip(row, twin, strict=True)):
            if a != b and not (math.isnan(a) and math.isnan(b)):
                return column, a, b
    return None


def _dependencies(folder: Path, description: Any) -> list[str]:
    """Outputs and derivatives move only with inputs and states that they are declared to depend on."""
    unknowns = [u for u in (*description.outputs, *description.derivatives) if u.dependencies is not None]
    unknowns = [u for u in unknowns if u.variable.type in ("Real", "Float64")]
    references = [u.variable.valueReference for u in unknowns]
    instance = Instance(folder, description, "ModelExchange")
    instance.enter_continuous_time()
    findings = []
    for variable, move in _movers(instance, description):
        before = instance.get(references)
        move(1)
        after = instance.get(references)
        move(0)
        for unknown, a, b in zip(unknowns, before, after, strict=True):
            if a != b and all(known is not variable for known in unknown.dependencies):
                findings.append(f"{unknown.variable.name!r} changes with {variable.name!r}, which it does not declare")
    instance.end()
    return findings


def _movers(instance: Instance, description: Any) -> Iterable[tuple[Any, Callable[[int], None]]]:
    """Each input and state, with a function that moves it (1) and puts it back (0)."""
    from ctypes import c_double

    for variable in description.modelVariables:
        if variable.causality == "input" and variable.type in ("Real", "Float64"):
            (value,) = instance.get([variable.valueReference])

            def move_input(on: int, reference: int = variable.valueReference, value: float = value) -> None:
                instance.set(reference, value + on * _nudge(value))

            yield variable, move_input
    n = len(description.derivatives)
    base = (c_double * n)()
    instance.fmu.getContinuousStates(base, n)
    for i, unknown in enumerate(description.derivatives):

        def move_state(on: int, i: int = i) -> None:
            moved = (c_double * n)(*base)
            moved[i] += on * _nudge(base[i])
            instance.fmu.setContinuousStates(moved, n)

        yield unknown.variable.derivative, move_state


def _nudge(value: float) -> float:
    return 0.01 * max(abs(value), 1.0)


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(behaviour_findings(Path(sys.argv[1]))))
