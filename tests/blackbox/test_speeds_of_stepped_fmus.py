"""An FMU that can only be stepped and shows a speed: forces that go with speed act there, whether or not a position is shown."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource
from orchestrator.cosim import Simulation, load_system
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.measurements import load_measurements
from orchestrator.verdicts.result import Estimate, NamedEffect
from orchestrator.versions import add_effects

CART = (
    'model Cart\n  parameter Real m(unit="{mass}") = 2;\n  input Real F(unit="{force}");\n  output Real v(unit="{speed}", start=0, fixed=true);\n'
    "  {shown}Real x(start=0, fixed=true);\nequation\n  der(x) = v;\n  m*der(v) = F;\nend Cart;\n"
)
TIME = np.arange(0.0, 2.0, 0.01)


def prepared(
    folder: Path,
    *,
    units: tuple[str, str, str] = ("kg", "N", "m/s"),
    shown: bool = False,
    measured: tuple[str, ...] = ("v",),
) -> FmuSource:
    """A cart with three records of whatever motion."""
    data = folder / "data"
    data.mkdir()
    for k in range(3):
        rows = np.column_stack([TIME, *(np.sin((3 + n) * TIME + k) for n in range(1 + len(measured)))])
        header = ",".join(("time", "F", *measured))
        np.savetxt(data / f"run_{k}.csv", rows, delimiter=",", header=header, comments="", fmt="%.9g")
    file = folder / "Cart.mo"
    mass, force, speed = units
    file.write_text(CART.format(mass=mass, force=force, speed=speed, shown="output " if shown else ""))
    fmu = build_fmu(ModelicaModel("Cart", "Cart", file).compile(), folder / "Cart.fmu")
    return FmuSource.prepare(fmu, load_measurements(str(data)), stepped=True)


def sites(source: FmuSource) -> set[tuple[str, str]]:
    return {(c.card.id, c.site) for c in source.candidates()}


def test_a_speed_takes_forces_that_need_no_position(tmp_path: Path) -> None:
    source = prepared(tmp_path)
    found = sites(source)
    assert {("viscous_friction", "v"), ("coulomb_friction", "v"), ("quadratic_drag", "v")} <= found
    assert not {id for id, _ in found} & {"passive_stiffness", "end_stop", "cogging", "hysteresis"}
    assert any("would have to expose the position to v" in line for line in source.refusals())
    b = next(c for c in source.candidates() if (c.card.id, c.site) == ("viscous_friction", "v"))
    compiled = EffectSet(source, [b], ("v",)).model.compiled
    run = compiled.run(TIME, np.ones((len(TIME), 1)), compiled.with_values(np.array([4.0])), np.zeros(2))
    np.testing.assert_allclose(run.outputs[:, 0], 0.25 * (1 - np.exp(-2 * TIME)), atol=1e-3)  # 2 der(v) = 1 - 4 v
    effect = NamedEffect("viscous_friction", "v", {"b[1]": Estimate(4.0, "N.s/m", (4.0, 4.0))})
    version = add_effects(source, [effect], tmp_path / "out")
    with Simulation(load_system(version.file)) as simulation:
        simulation.set("F", 1.0)
        simulation.run(1.0)
        # The friction is one communication step late.
        assert simulation.get("v") == pytest.approx(0.25 * (1 - np.exp(-2)), rel=5e-3)


def test_an_output_that_is_the_speed_of_another_one_stands_for_differences(tmp_path: Path) -> None:
    source = prepared(tmp_path, units=("", "", ""), shown=True, measured=("v", "x"))
    (force,) = source.sites.forces
    assert source.sites.outputs[force.output].name == "x" and not source.sites.wiring.differenced
    assert source.sites.sensed_names[force.speed] == "v"
    assert ("passive_stiffness", "x") in sites(source)


def test_what_grows_like_a_speed_and_is_none_takes_no_force(tmp_path: Path) -> None:
    source = prepared(tmp_path, units=("J/K", "W", "K"))
    assert not source.sites.forces and ("viscous_friction", "v") not in sites(source)
