"""SSPs that go to other tools and come from them: FMPy and FMUContainer run ours, ours runs those of pyssp_standard."""

from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssv
from small_fmus import small_fmu
from systems import PAIR_EXACT, pair, recorded, spec, system

from orchestrator.cosim import System, Value
from orchestrator.cosim.load import load_system
from orchestrator.cosim.ssp import write_ssp

STEP = 0.01


def forward(**mass: float) -> System:
    """A falling mass that two gains look at: nothing goes back, so that all orders of evaluation agree but for delays."""
    parts = [spec("mass", "mass", **mass), spec("half", "gain"), spec("minus", "gain", **({"a": -1.0} if mass else {}))]
    made = system(parts, [("mass.x", "half.u"), ("half.y", "minus.u")], step=STEP)
    outputs = {"place": "mass.x", "first": "half.y", "second": "minus.y"}
    return replace(made, name="forward", inputs={"push": ("mass.fb",)}, outputs=outputs)


def pushed(made: System, force: float, until: float):
    return recorded(made.with_values({"mass.fb": Value(force)}), until)


def test_fmpy_runs_an_export_unchanged_and_gets_the_same_numbers_later(tmp_path):
    made = forward(m=2.0, x0=3.0)
    path = str(write_ssp(made, tmp_path / "forward.ssp"))
    theirs = simulate_ssp(
        path,
        stop_time=1.0 - STEP / 2,
        step_size=STEP,
        parameter_set=read_ssv(path, resource="resources/parameters.ssv"),
        input={"push": lambda time: 1.5},
    )
    ours = pushed(made, 1.5, 1.0)
    # Its rows bear the time at which a step began; a connection reaches its target a step later, and the push as well.
    assert np.allclose(theirs["mass.x"][1:], ours["mass.x"][1:-1], rtol=1e-12)
    assert np.allclose(theirs["half.y"][2:], ours["half.y"][1:-2], rtol=1e-12)
    assert np.allclose(theirs["minus.y"][3:], ours["minus.y"][1:-3], rtol=1e-12)


def test_fmpy_comes_to_the_same_oscillation_as_its_steps_shrink(tmp_path):
    """With a force that goes back, delays are errors of first order; the dependency-ordered master has fewer of them."""
    path = str(write_ssp(pair(), tmp_path / "pair.ssp"))
    steps = (1e-3, 5e-4)
    errors = [abs(simulate_ssp(path, stop_time=10.0 - h / 2, step_size=h)["mass.x"][-1] - PAIR_EXACT) for h in steps]
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.1)
    assert abs(recorded(pair(step=1e-3), 10.0)["mass.x"][-1] - PAIR_EXACT) < errors[0] / 2


def test_a_container_made_of_an_export_gets_the_same_numbers_later(tmp_path):
    from fmu_manipulation_toolbox.assembly import Assembly

    write_ssp(forward(), tmp_path / "forward.ssp")
    Assembly("forward.ssp", default_step_size=STEP, default_auto_link=False, fmu_directory=tmp_path).make_fmu()
    theirs = fmpy.simulate_fmu(
        str(tmp_path / "forward.fmu"), stop_time=1.0, step_size=STEP, output_interval=STEP, start_values={"push": 1.5}
    )
    ours = pushed(forward(), 1.5, 1.0)
    assert np.allclose(theirs["place"], ours["mass.x"], rtol=1e-9)
    assert np.allclose(theirs["first"][1:], ours["half.y"][:-1], rtol=1e-9)
    assert np.allclose(theirs["second"][2:], ours["minus.y"][:-2], rtol=1e-9)


def test_a_package_of_pyssp_standard_runs_as_the_same_system_written_here(tmp_path):
    from pyssp_standard.common_content_ssc import TypeReal
    from pyssp_standard.ssd import Component, Connection, Connector, ParameterBinding
    from pyssp_standard.ssd import System as TheirSystem
    from pyssp_standard.ssp import SSP
    from pyssp_standard.ssv import SSV

    values = tmp_path / "values.ssv"
    with SSV(values, mode="w") as found:
        found.add_parameter("mass.m", value=2000.0, unit="g")
        found.add_unit("g", {"kg": 1, "factor": 0.001})
    path = tmp_path / "theirs.ssp"
    with SSP(path, mode="w") as package:
        for file in (small_fmu("mass"), small_fmu("spring"), values):
            package.add_resource(file)
        with package.system_structure as structure:
            structure.name, structure.version = "pair", "1.0"
            structure.system = TheirSystem(None, "pair")
            structure.system.parameter_bindings.append(ParameterBinding(source="resources/values.ssv"))
            for name, ports in (("mass", "<fa >x >v"), ("spring", "<x2 <v2 >f2")):
                part = Component()
                part.name, part.source = name, f"resources/{name}.fmu"
                part.component_type = "application/x-fmu-sharedlibrary"
                for port in ports.split():
                    part.connectors.append(
                        Connector(None, port[1:], {"<": "input", ">": "output"}[port[0]], TypeReal(None))
                    )
                structure.system.elements.append(part)
            for ends in (("mass", "x", "spring", "x2"), ("mass", "v", "spring", "v2"), ("spring", "f2", "mass", "fa")):
                names = ("start_element", "start_connector", "end_element", "end_connector")
                structure.add_connection(Connection(**dict(zip(names, ends, strict=True))))
    theirs = recorded(load_system(path), 1.0, step=STEP)
    ours = recorded(pair(step=STEP).with_values({"mass.m": Value(2.0)}), 1.0)
    assert np.array_equal(theirs["mass.x"], ours["mass.x"])


def test_an_export_read_back_runs_to_the_same_bits(tmp_path):
    made = pair(step=STEP).with_values({"spring.d": Value(0.25), "mass.x0": Value(40.0, "cm")})
    again = load_system(Path(write_ssp(made, tmp_path / "pair.ssp")))
    one, other = recorded(made, 2.0), recorded(again, 2.0)
    assert one.names == other.names
    assert all(np.array_equal(one[name], other[name]) for name in one.names)
