"""Structural parameters of FMI 3.0 size arrays: in values, connections, SSP, sweeps and one FMU; dx/dt = a x + b u by Euler steps of 1 ms."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_fmus import small_fmu

from fmus.errors import MisfitError
from orchestrator.cosim import ComponentSpec, Connection, RunSettings, System, Value
from orchestrator.cosim.container.package import container_of
from orchestrator.cosim.load import load_system
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.ssp.document import write_ssp
from orchestrator.cosim.toml_file import write_toml

DECAY = {"m": 1, "n": 1, "r": 2, "a": [[-1.0]], "b": [[1.0]], "c": [[1.0], [2.0]], "d": [[0.0]] * 2, "x0": [1.0]}
SUMS = {"m": 2, "n": 2, "r": 2, "a": [[0.0] * 2] * 2, "b": np.eye(2).tolist(), "c": np.eye(2).tolist()}
SUMS |= {"d": [[0.0] * 2] * 2, "x0": [0.0] * 2}


def component(name: str, values: Mapping[str, Any]) -> ComponentSpec:
    return ComponentSpec(name, source=small_fmu("statespace", 3).name, values={n: Value(v) for n, v in values.items()})


def pair() -> System:
    """Two outputs of a decay into two integrals: arrays of two, where the description has arrays of three."""
    parts = {"p": component("p", DECAY | {"u": [0.0]}), "q": component("q", SUMS)}
    run = RunSettings(stop=1.0, step=0.1)
    folder = small_fmu("statespace", 3).parent
    return System("pair", parts, (Connection("p.y", "q.u"),), run=run, folder=folder)


def last(system: System, *addresses: str) -> list[float]:
    with Simulation(system) as simulation:
        simulation.run(1.0)
        return np.ravel([simulation.get(address) for address in addresses]).tolist()


def expected() -> list[float]:
    """The decay takes 1000 steps of its own; the integrals of its outputs hold over each step of 0.1 s."""
    x = 0.999 ** np.arange(0, 1001)
    return [*(x[-1] * np.array([1, 2])), *(0.1 * x[0:1000:100].sum() * np.array([1, 2]))]


def test_arrays_of_connected_fmus_have_the_sizes_that_are_given() -> None:
    np.testing.assert_allclose(last(pair(), "p.y", "q.y"), expected(), rtol=1e-12)


def test_sizes_travel_in_an_ssp_and_in_toml(tmp_path: Path) -> None:
    again = load_system(str(write_ssp(pair(), tmp_path / "pair.ssp")))
    (tmp_path / "pair.toml").write_text(write_toml(replace(pair(), folder=tmp_path)))
    (tmp_path / "statespace.fmu").write_bytes(small_fmu("statespace", 3).read_bytes())
    for system in (again, load_system(str(tmp_path / "pair.toml"))):
        assert last(system, "p.y", "q.y") == last(pair(), "p.y", "q.y")


@pytest.mark.parametrize("version", [0, 1])
def test_one_fmu_of_the_system_sizes_its_arrays(tmp_path: Path, version: int) -> None:
    written, _ = container_of(pair(), "pair", tmp_path)
    names = [f"pair{('', '_fmi3')[version]}.{name}[{k}]" for name in ("p.y", "q.y") for k in (1, 2)]
    np.testing.assert_allclose(last(load_system(str(written[version])), *names), expected(), rtol=1e-12)


def test_a_value_of_the_described_size_no_longer_fits() -> None:
    parts = {"p": component("p", {"n": 2, "x0": [1.0, 2.0, 3.0]})}
    with pytest.raises(MisfitError, match=r"x0 has shape \(2,\), the value .* has shape \(3,\)"):
        last(System("s", parts, run=RunSettings(step=0.1), folder=small_fmu("statespace", 3).parent))


@pytest.mark.parametrize(("size", "words"), [(-1, r"n = -1 is outside \[0, "), (1.5, "n = 1.5 is not of the type")])
def test_a_size_that_is_none_is_refused(size: float, words: str) -> None:
    parts = {"p": component("p", {"n": size})}
    with pytest.raises(MisfitError, match=words):
        last(System("s", parts, run=RunSettings(step=0.1), folder=small_fmu("statespace", 3).parent))


def test_a_size_cannot_change_once_the_system_is_read() -> None:
    with Simulation(pair()) as simulation, pytest.raises(MisfitError, match="q.n says how large arrays are"):
        simulation.set("q.n", 3)
