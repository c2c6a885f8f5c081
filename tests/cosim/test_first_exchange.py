"""FMUs of FMI 1.0 for model exchange: integrated with their state and time events."""

import subprocess
import zipfile
from pathlib import Path

import pytest

from fmus.runtime.compiler import find_compiler
from orchestrator.cosim import Simulation, Value
from orchestrator.cosim.load import load_system

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="ball" modelIdentifier="ball" guid="{ball}" numberOfContinuousStates="2" numberOfEventIndicators="1">
 <ModelVariables>
  <ScalarVariable name="h" valueReference="0" causality="output"><Real start="1" fixed="true"/></ScalarVariable>
  <ScalarVariable name="v" valueReference="1" causality="output"><Real start="0" fixed="true"/></ScalarVariable>
  <ScalarVariable name="e" valueReference="2" variability="parameter"><Real start="0.7" fixed="true"/></ScalarVariable>
  <ScalarVariable name="completed" valueReference="3" causality="output"><Real/></ScalarVariable>
 </ModelVariables>
</fmiModelDescription>"""
G = 9.81


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU."""
    folder = tmp_path_factory.mktemp("ball")
    source = Path(__file__).parent / "fmus" / "first_ball.c"
    subprocess.run([*find_compiler(), "-shared", "-fPIC", "-O1", "-o", "ball.so", str(source)], cwd=folder, check=True)
    with zipfile.ZipFile(folder / "ball.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(folder / "ball.so", "binaries/linux64/ball.so")
    return folder / "ball.fmu"


def height(time: float, share: float) -> float:
    """Of a ball that fell from 1 m at time 0."""
    first = (2.0 / G) ** 0.5
    if time < first:
        return 1.0 - 0.5 * G * time**2
    time, speed = time - first, share * G * first
    while time > 2.0 * speed / G:
        time, speed = time - 2.0 * speed / G, share * speed
    return speed * time - 0.5 * G * time**2


@pytest.mark.parametrize("share", [0.7, 0.9])
def test_a_ball_bounces_and_is_let_go_again_as_the_formula_says(ball: Path, share: float) -> None:
    system = load_system(ball).with_values({"ball.e": Value(share)})
    with Simulation(system, step=0.1, stop=2.0) as run:
        found = {round(run.step(), 9): run.get("ball.h") for _ in range(20)}
        assert run.get("ball.completed") > 20
    assert [found[t] for t in (0.4, 0.7, 1.2)] == pytest.approx([height(t, share) for t in (0.4, 0.7, 1.2)], abs=1e-6)
    assert [found[t] for t in (1.6, 2.0)] == pytest.approx([height(t - 1.5, share) for t in (1.6, 2.0)], abs=1e-6)
