"""The Reference FMUs of the Modelica Association, where MISFIT_REFERENCE_FMUS names the folder with `2.0` and `3.0`."""

import csv
import io
import math
import os
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.cosim import ComponentSpec, RunSettings, System, Value
from orchestrator.cosim.simulation import Simulation

FOLDER = Path(os.environ.get("MISFIT_REFERENCE_FMUS", "/nowhere"))
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="MISFIT_REFERENCE_FMUS names no folder")

NAMES = ("BouncingBall", "Dahlquist", "Feedthrough", "Resource", "Stair", "VanDerPol")
STEPPED = [(2, name) for name in NAMES] + [(3, name) for name in (*NAMES, "StateSpace")]
INTERFACES = ["CoSimulation", "ModelExchange"]


def one(name: str, version: int, interface: str, step: float, values: Any = None, **run: Any) -> System:
    path = FOLDER / f"{version}.0" / f"{name}.fmu"
    given = {key: Value(value) for key, value in (values or {}).items()}
    spec = ComponentSpec("fmu", source=str(path), values=given, options={"interface": interface})
    return System(name, {"fmu": spec}, run=RunSettings(step=step, **run), folder=Path("/"))


def reference(name: str, version: int) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the results that an FMU brings along."""
    with zipfile.ZipFile(FOLDER / f"{version}.0" / f"{name}.fmu") as archive:
        member = f"extra/org.fmi-standard.fmi-ls-ref/{name}_out.csv"
        if member not in archive.namelist():
            pytest.skip("this release brings no results")
        header, *rows = csv.reader(io.StringIO(archive.read(member).decode()))
    return header, rows


def parsed(text: str, like: Any) -> Any:
    if isinstance(like, bool):
        return text == "true"
    if isinstance(like, str):
        return text
    if isinstance(like, bytes):
        return bytes.fromhex(text)
    return np.array(text.split(), dtype=float) if isinstance(like, np.ndarray) else float(text)


@pytest.mark.parametrize(("version", "name"), STEPPED)
def test_cosimulation_gives_the_results_that_the_fmu_brings(version: int, name: str) -> None:
    header, rows = reference(name, version)
    step = float(rows[1][0]) - float(rows[0][0])
    with Simulation(one(name, version, "CoSimulation", step)) as simulation:
        simulation.initialise()
        for number, row in enumerate(rows):
            assert simulation.time == pytest.approx(float(row[0]), abs=1e-9)
            for variable, text in zip(header[1:], row[1:], strict=True):
                if version == 2 and variable not in {p.name for p in simulation.coupling.components["fmu"].ports}:
                    continue  # types that FMI 2 does not have
                value = simulation.get(f"fmu.{variable}")
                expected = parsed(text, value)
                if isinstance(value, str | bytes | bool):
                    assert value == expected
                else:
                    np.testing.assert_allclose(
                        value, expected, rtol=1e-9, atol=1e-12, err_msg=f"{variable} at {row[0]} s"
                    )
            if number + 1 < len(rows) and not simulation.ended:
                simulation.step()


@pytest.mark.parametrize("version", [2, 3])
def test_dahlquist_by_model_exchange_decays_exponentially(version: int) -> None:
    with Simulation(one("Dahlquist", version, "ModelExchange", 0.5, tolerance=1e-9)) as simulation:
        simulation.run(5.0)
        assert simulation.get("fmu.x") == pytest.approx(math.exp(-5.0), abs=1e-8)


@pytest.mark.parametrize("version", [2, 3])
def test_the_ball_by_model_exchange_follows_its_parabolas(version: int) -> None:
    g, e = -9.81, 0.7
    with Simulation(one("BouncingBall", version, "ModelExchange", 0.01, tolerance=1e-10)) as simulation:
        fall = math.sqrt(-2.0 / g)
        for time in (0.3, 0.6, 1.0):
            simulation.run(time)
            if time < fall:
                expected = 1.0 + 0.5 * g * time**2
            else:
                since, up = time - fall, -e * g * fall
                expected = up * since + 0.5 * g * since**2
            assert simulation.get("fmu.h") == pytest.approx(expected, abs=1e-6)
        simulation.run(3.0)
        assert simulation.get("fmu.h") == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("version", [2, 3])
def test_the_stair_by_model_exchange_goes_up_every_second_and_ends_with_the_tenth(version: int) -> None:
    with Simulation(one("Stair", version, "ModelExchange", 0.25)) as simulation:
        for k in range(35):
            simulation.step()
            assert simulation.get("fmu.counter") == 1 + math.floor(0.25 * (k + 1) + 1e-9)
        simulation.run(20.0)
        # The tenth step of the stairs is that at 9 s.
        assert (simulation.get("fmu.counter"), simulation.ended) == (10, "fmu ended the run at t = 9 s")


@pytest.mark.parametrize("version", [2, 3])
def test_van_der_pol_agrees_with_an_integrator_of_another_family(version: int) -> None:
    from scipy.integrate import solve_ivp

    exact = solve_ivp(
        lambda t, x: [x[1], (1 - x[0] ** 2) * x[1] - x[0]], (0, 20), [2, 0], "LSODA", rtol=1e-10, atol=1e-12
    )
    with Simulation(one("VanDerPol", version, "ModelExchange", 0.5, tolerance=1e-9)) as simulation:
        simulation.run(20.0)
        assert [simulation.get("fmu.x0"), simulation.get("fmu.x1")] == pytest.approx(exact.y[:, -1], abs=1e-6)


@pytest.mark.parametrize("interface", INTERFACES)
def test_the_state_space_model_follows_its_matrices(interface: str) -> None:
    # Its sizes stay as they are: some releases refuse every structural parameter (they count its value twice).
    a = np.diag([-0.5, -1.0, 0.0])
    with Simulation(one("StateSpace", 3, interface, 1.0, tolerance=1e-9)) as simulation:
        for name, value in (("A", a), ("D", np.zeros((3, 3))), ("u", np.ones(3))):
            simulation.set(f"fmu.{name}", value)
        simulation.run(2.0)
        x = simulation.get("fmu.x")
        np.testing.assert_array_equal(simulation.get("fmu.y"), x)
    exact = [2.0 - 2.0 * math.exp(-1.0), 1.0 - math.exp(-2.0), 2.0]
    # By co-simulation the model takes Euler steps of its own.
    np.testing.assert_allclose(x, exact, atol=1e-7 if interface == "ModelExchange" else 0.5)


def test_clocks_tick_as_the_table_in_its_source_says() -> None:
    system = one("Clocks", 3, "ScheduledExecution", 1.0)
    spec = replace(system.components["fmu"], options={"ticks": {"inClock2": [0, 1, 8, 9]}})
    with Simulation(replace(system, components={"fmu": spec})) as simulation:
        simulation.run(9.0)
        names = ("inClock1Ticks", "inClock2Ticks", "inClock3Ticks", "totalInClockTicks", "output3")

        assert [simulation.get(f"fmu.{name}") for name in names] == [10, 4, 1, 15, 1000]


def test_a_binary_output_is_bytes() -> None:
    with Simulation(one("Feedthrough", 3, "CoSimulation", 0.1)) as simulation:
        simulation.set("fmu.Binary_input", b"\x00ab")
        simulation.step()
        assert simulation.get("fmu.Binary_output") == b"\x00ab"
