"""What FMUs are compared in with other simulators of the same classes, and the comparison."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import read_model_description, simulate_fmu  # type: ignore[import-untyped]

from fmus.build import Target, build_all
from fmus.catalogue import ModelicaModel, built_in_models
from fmus.library import library_root

POINTS = 50
TOLERANCE = 1e-5
# One with each kind of equation: delay, root, nested lags, joined links, path dependence, steep and stopped motion.
TEST_MODELS = [
    "DelayOfARamp",
    "TankEmpties",
    "ReflexToAStep",
    "DoublePendulumKeepsItsEnergy",
    "HysteresisLoop",
    "CoulombStop",
    "BounceOffEndStops",
    "FactorsAreOtherArms",
    "MuscleTendonEquilibrium",
]
NAMES = [*built_in_models(), *TEST_MODELS]


@dataclass(frozen=True)
class Case:
    """A class, the Modelica model that a simulator runs for it, and what its FMU is driven with; times in s."""

    model: ModelicaModel
    simulated: str  # full name
    source: str | None  # of the simulated model where it is not in the library
    prefix: str  # of the variables in it
    stop: float
    inputs: dict[str, float]


@cache
def case(name: str) -> Case:
    """A built-in model with constant inputs, or one of the test models as it is."""
    return _test_model(name) if name in TEST_MODELS else _built_in(built_in_models()[name])


def _built_in(model: ModelicaModel) -> Case:
    inputs = {v.name: 0.2 + 0.05 * i for i, v in enumerate(model.compile().inputs)}
    name = "Driven_" + model.name.replace("-", "_")
    settings = "".join(f"  plant.{name} = {value!r};\n" for name, value in inputs.items())
    source = f"model {name}\n  {model.class_name} plant;\nequation\n{settings}end {name};\n"
    return Case(model, name, source, "plant.", POINTS * model.step_size_s, inputs)


def _test_model(name: str) -> Case:
    text = (library_root() / "FESArm" / "Test" / f"{name}.mo").read_text()
    (stop,) = re.findall(r"experiment\(StopTime=([\d.]+)\)", text)
    class_name = f"FESArm.Test.{name}"
    return Case(ModelicaModel(name, class_name), class_name, None, "", float(stop), {})


def assert_same_course(
    chosen: Case, expected: Mapping[str, Sequence[float]], folder: Path, *, least_share: float
) -> None:
    """Run the FMU of a case and compare every state and algebraic variable that `expected` has too.

    `expected` holds POINTS + 1 values a name; at least that share of the variables has to be among them.
    """
    target = Target(chosen.model, "2.0", folder / "model.fmu")
    build_all([target], workers=1)
    variables = [v for v in read_model_description(str(target.path)).modelVariables if _is_compared(v)]
    names = [v.name for v in variables if chosen.prefix + v.name in expected]
    assert names and len(names) >= least_share * len(variables)
    result = simulate_fmu(
        str(target.path),
        stop_time=chosen.stop,
        step_size=chosen.stop / POINTS,
        output_interval=chosen.stop / POINTS,
        relative_tolerance=1e-10,
        start_values=chosen.inputs,
        output=names,
    )
    for name in names:
        reference = np.array(expected[chosen.prefix + name])
        scale = np.abs(reference).max() + 1e-2  # smaller ones are differences of what is compared beside them
        assert np.abs(result[name] - reference).max() < TOLERANCE * scale, name


def _is_compared(variable: Any) -> bool:
    """States and algebraic variables; derivatives are not among the results of others."""
    return variable.causality in ("local", "output") and not variable.name.startswith("der(")
