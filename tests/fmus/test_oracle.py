"""Our FMUs against rumoca's own simulator: the same front end, but another back end and another integrator."""

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu  # type: ignore[import-untyped]

from fmus.build import Target, build_all
from fmus.catalogue import ModelicaModel, built_in_models
from fmus.library import library_root

CHILD = Path(__file__).with_name("rumoca_oracle.py")
POINTS = 50
TOLERANCE = 1e-5
TIME_LIMIT_S = 120
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
]


@dataclass(frozen=True)
class Case:
    """A class, what an oracle simulates for it, and what its FMU is driven with; times in s."""

    model: ModelicaModel
    source: str | None
    prefix: str
    stop: float
    inputs: dict[str, float]


def _built_in(model: ModelicaModel) -> Case:
    inputs = {v.name: 0.2 + 0.05 * i for i, v in enumerate(model.compile().inputs)}
    settings = "".join(f"  plant.{name} = {value!r};\n" for name, value in inputs.items())
    source = f"model Driven\n  {model.class_name} plant;\nequation\n{settings}end Driven;\n"
    return Case(model, source, "plant.", POINTS * model.step_size_s, inputs)


def _test_model(name: str) -> Case:
    text = (library_root() / "FESArm" / "Test" / f"{name}.mo").read_text()
    (stop,) = re.findall(r"experiment\(StopTime=([\d.]+)\)", text)
    return Case(ModelicaModel(name, f"FESArm.Test.{name}"), None, "", float(stop), {})


CASES = [*built_in_models(), *TEST_MODELS]


@cache
def _case(name: str) -> Case:
    return _test_model(name) if name in TEST_MODELS else _built_in(built_in_models()[name])


@pytest.fixture(scope="session")
def oracle(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, list[float]]]:
    """What rumoca gets for each case, every variable by its name."""
    folder = tmp_path_factory.mktemp("oracle")
    jobs = [
        {
            "source": case.source,
            "model": "Driven" if case.source else case.model.class_name,
            "stop": case.stop,
            "points": POINTS,
        }
        for case in map(_case, CASES)
    ]
    (folder / "jobs.json").write_text(json.dumps(jobs))
    command = [sys.executable, str(CHILD), str(library_root()), str(folder / "jobs.json"), str(folder / "results")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)
    found = [json.loads(line) for line in (folder / "results").read_text().splitlines()]
    at = CASES[len(found)] if len(found) < len(CASES) else "the end"
    assert done.returncode == 0, f"rumoca at {at}: {done.returncode} {done.stderr[-2000:]}"
    return dict(zip(CASES, found, strict=True))


@pytest.mark.parametrize("name", CASES)
def test_every_variable_takes_the_course_that_rumoca_computes(
    name: str, oracle: dict[str, dict[str, list[float]]], tmp_path: Path
) -> None:
    case, expected = _case(name), oracle[name]
    target = Target(case.model, "2.0", tmp_path / "model.fmu")
    build_all([target], workers=1)
    variables = [v for v in read_model_description(str(target.path)).modelVariables if _is_compared(v)]
    names = [v.name for v in variables if case.prefix + v.name in expected]
    assert len(names) >= 0.9 * len(variables) > 0

    result = simulate_fmu(
        str(target.path),
        stop_time=case.stop,
        step_size=case.stop / POINTS,
        output_interval=case.stop / POINTS,
        relative_tolerance=1e-10,
        start_values=case.inputs,
        output=names,
    )

    for variable in names:
        reference = np.array(expected[case.prefix + variable])
        scale = np.abs(reference).max() + 1e-2  # smaller ones are differences of what is compared beside them
        assert np.abs(result[variable] - reference).max() < TOLERANCE * scale, variable


def _is_compared(variable: Any) -> bool:
    """States and algebraic variables; derivatives are not among rumoca's results."""
    return variable.causality in ("local", "output") and not variable.name.startswith("der(")
