"""A coupled system as one FMU gives what the co-simulation of its parts gives, here and in FMPy."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from small_fmus import small_fmu
from systems import chain, pair, recorded, ring, spec, system

from fmus.errors import ComponentError, MisfitError
from fmus.validate import examine_fmu
from orchestrator.cosim import ComponentSpec, Connection, Simulation, System, Value
from orchestrator.cosim.container import container_of
from orchestrator.cosim.load import load_system

# Results may differ by the rounding of a few sums in another order.
ROUNDING = 1e-12


def built(what: System, folder: Path) -> list[Path]:
    return container_of(what, "coupled", folder)[0]


def distance(what: System, fmu: Path, until: float) -> float:
    """The largest difference of all outputs between the system and its FMU, as a share of their sizes."""
    apart = recorded(what, until, stop=until)
    inside = load_system(fmu)
    (component,) = inside.components
    together = recorded(inside, until, stop=until, step=what.run.step)
    assert len(apart.time) == len(together.time)
    assert apart.names
    return max(
        float(np.max(np.abs(apart[name] - together[f"{component}.{name}"])) / max(1.0, np.max(np.abs(apart[name]))))
        for name in apart.names
    )


def controlled(**options: Any) -> System:
    """A mass on a spring, held by a controller that sees its place in mm."""
    parts = [spec("mass", "mass"), spec("spring", "spring")]
    parts.append(ComponentSpec("hold", "controller", options=options))
    what = system(parts, [("mass.x", "spring.x2"), ("mass.v", "spring.v2"), ("spring.f2", "mass.fa")], step=1e-3)
    wires = (Connection("mass.x", "hold.u", factor=-1.0, offset=0.5), Connection("hold.y", "mass.fb"))
    return replace(what, connections=(*what.connections, *wires))


CONTINUOUS = {"a": [[-3.0, 1.0], [0.0, -1.0]], "b": [[0.0], [2.0]], "c": [[4.0, 1.0]]}
SAMPLED = {"a": [[0.9]], "b": [[0.1]], "c": [[2.0]], "d": [[0.5]], "sample_time": 4e-3}
SYSTEMS = {
    "pair": pair(),
    "pair, FMI 3": pair(3),
    "versions mixed": replace(pair(), components={**pair().components, "spring": spec("spring", "spring", 3)}),
    "chain": chain(2, 3),
    "jacobi": pair(master="jacobi"),
    "gauss_seidel": pair(master="gauss_seidel"),
    "extrapolation": chain(2, 2, options={"extrapolation": 1}),
    "smoothing": chain(3, 2, options={"extrapolation": 1, "smoothing_s": 0.02}),
    "slow spring": replace(pair(), components={"mass": spec("mass", "mass"), "spring": replace(spec("spring", "spring"), step=4e-3)}),
    "quick mass": replace(pair(), components={"mass": replace(spec("mass", "mass"), step=2.5e-4), "spring": spec("spring", "spring")}),
    "continuous controller": controlled(**CONTINUOUS),
    "sampled controller": controlled(**SAMPLED),
    "algebraic loop": ring({"a": 0.5, "b": 1.0}, {"a": -0.4, "b": 2.0}, {"a": 0.9, "b": 0.1}),
}  # fmt: skip


@pytest.mark.parametrize("name", SYSTEMS)
def test_one_fmu_gives_what_its_parts_give_apart(name: str, tmp_path: Path) -> None:
    what = SYSTEMS[name]

    for fmu in built(what, tmp_path):
        assert distance(what, fmu, 0.3) <= ROUNDING


@pytest.mark.parametrize("name", ["pair, FMI 3", "algebraic loop", "sampled controller"])
def test_fmpy_agrees_and_finds_nothing_wrong(name: str, tmp_path: Path) -> None:
    what = SYSTEMS[name]
    apart = recorded(what, 0.3, stop=0.3)

    for fmu in built(what, tmp_path):
        found = simulate_fmu(str(fmu), stop_time=0.3, output_interval=what.run.step, output=apart.names)

        assert not validate_fmu(str(fmu))
        assert not examine_fmu(fmu).findings
        for column in apart.names:
            np.testing.assert_allclose(found[column], apart[column], rtol=ROUNDING, atol=ROUNDING)


def test_steps_of_the_importer_do_not_change_the_coupling(tmp_path: Path) -> None:
    what = pair()
    apart = recorded(what, 0.3, stop=0.3)

    for fmu in built(what, tmp_path):
        coarse = simulate_fmu(str(fmu), stop_time=0.3, output_interval=0.05, output=["mass.x"])

        np.testing.assert_allclose(coarse["mass.x"], np.interp(coarse["time"], apart.time, apart["mass.x"]), rtol=1e-12)


def test_inputs_parameters_and_units_reach_the_parts(tmp_path: Path) -> None:
    what = replace(pair(), inputs={"push": ("mass.fb",)}, outputs={"way": "mass.x"}, units={"push": "kN", "way": "mm"})
    given = what.with_values({"push": Value(2e-3), "mass.m": Value(2.5), "spring.k": Value(30.0)})
    apart = recorded(given, 0.3, stop=0.3)

    for fmu in built(what, tmp_path):
        values = {"push": 2e-3, "mass.m": 2.5, "spring.k": 30.0}
        found = simulate_fmu(
            str(fmu), stop_time=0.3, output_interval=1e-3, start_values=values, output=["mass.x", "way"]
        )

        np.testing.assert_allclose(found["mass.x"], apart["mass.x"], rtol=1e-12)
        np.testing.assert_allclose(found["way"], 1000.0 * apart["mass.x"], rtol=1e-12)


def test_a_system_goes_on_from_a_saved_state(tmp_path: Path) -> None:
    for fmu in built(controlled(**CONTINUOUS), tmp_path):
        with Simulation(load_system(fmu), step=1e-3, stop=0.3) as run:
            run.run(0.1)
            point = run.save()
            run.run(0.3)
            once = run.get("coupled.mass.x") if "coupled" in run.system.components else run.get("coupled_fmi3.mass.x")
            run.restore(point)
            run.run(0.3)

            assert run.get(f"{next(iter(run.system.components))}.mass.x") == once


def test_an_output_follows_an_input_without_a_step_in_between(tmp_path: Path) -> None:
    what = system(
        [spec("one", "gain", a=2.0, b=0.0), spec("two", "gain", a=3.0, b=0.0)], [("one.y", "two.u")], step=0.1
    )

    for fmu in built(what, tmp_path):
        with Simulation(load_system(fmu), step=0.1, stop=1.0) as run:
            (name,) = run.system.components
            run.run(0.2)
            run.set(f"{name}.one.u", 1.5)

            assert run.get(f"{name}.two.y") == 9.0


@pytest.mark.parametrize(
    ("component", "words"),
    [
        (ComponentSpec("odd", "python", "x.py:Odd"), "component 'odd' is a Python component, which cannot be put into an FMU"),
        (ComponentSpec("odd", "robot", "r.toml"), "component 'odd' is of the kind 'robot', which cannot"),
        (replace(spec("odd", "mass"), options={"interface": "ModelExchange"}), "component 'odd': mass.fmu is run by model exchange"),
    ],
)  # fmt: skip
def test_what_cannot_be_in_an_fmu_is_refused_by_name(component: ComponentSpec, words: str, tmp_path: Path) -> None:
    what = system([component], [], step=0.1)

    with pytest.raises(MisfitError, match=words):
        built(what, tmp_path)


def test_a_foreign_fmu_without_a_binary_for_a_platform_is_refused_by_name(tmp_path: Path) -> None:
    pytest.importorskip("ziglang")
    from fmus.platforms import find_platforms

    with pytest.raises(MisfitError, match="component 'mass': mass.fmu has no binary for x86_64-windows"):
        container_of(pair(), "coupled", tmp_path, find_platforms("x86_64-windows"))


def test_a_loop_without_a_solution_is_named(tmp_path: Path) -> None:
    what = ring({"a": 1.0, "b": 1.0}, {"a": 1.0, "b": 0.0})

    for fmu in built(what, tmp_path):
        with pytest.raises(ComponentError, match="algebraic loop g.*has no unique solution"):
            recorded(load_system(fmu), 0.3, step=0.1, stop=0.3)


def test_equal_systems_give_equal_bytes(tmp_path: Path) -> None:
    once, again = (built(pair(), tmp_path / name) for name in "ab")

    assert [path.read_bytes() for path in once] == [path.read_bytes() for path in again]


def test_command_writes_both_versions(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from orchestrator.cli.factory import build

    file = tmp_path / "gains.toml"
    file.write_text(
        f'[run]\nstep = 0.1\nstop = 1.0\n[components]\none = "{small_fmu("gain")}"\ntwo = "{small_fmu("gain", 3)}"\n'
        '[[connections]]\nfrom = "one.y"\nto = "two.u"\n'
    )

    done = CliRunner().invoke(build, [str(file), "--out", str(tmp_path / "made")])

    assert done.exit_code == 0, done.output
    names: Sequence[str] = sorted(path.name for path in (tmp_path / "made").iterdir())
    assert names == ["gains.fmi3.fmu", "gains.fmu"]
