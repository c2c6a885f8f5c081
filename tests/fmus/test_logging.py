"""Messages come in declared categories, which an importer can switch; tolerances are kept to."""

import ctypes
import math
from collections.abc import Iterator
from ctypes import byref, c_char_p, c_double, c_size_t
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import pytest
from helpers_relations import tank
from helpers_slave import DISCARD, ERROR, MODEL_EXCHANGE, OK, Slave
from helpers_systems import oscillator, root

from fmus.package import build_fmu
from fmus.symbolic.system import SymbolicSystem

SYSTEMS = {"tank": tank, "root": root, "oscillator": oscillator}
EVENT = "the relation relation 1 becomes false at t = 1 s"


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    made: dict[str, SymbolicSystem] = {name: make() for name, make in SYSTEMS.items()}
    return {name: build_fmu(system, folder / f"{name}.fmu") for name, system in made.items()}


@pytest.fixture
def filling(fmus: dict[str, Path], tmp_path: Path) -> Iterator[Slave]:
    with Slave(fmus["tank"], tmp_path / "tank") as slave:
        yield slave.start()


def switch(slave: Slave, on: int, *names: bytes) -> int:
    return slave.call("fmi2SetDebugLogging", on, c_size_t(len(names)), (c_char_p * len(names))(*names))


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_categories_are_declared(tmp_path: Path, version: str) -> None:
    fmu = build_fmu(tank(), tmp_path / "tank.fmu", fmi_version=version)
    found = {category.name for category in fmpy.read_model_description(str(fmu)).logCategories}
    assert found == {"logEvents", "logStatusDiscard", "logStatusError", "logAll"}


def test_without_a_wish_only_failures_are_reported(filling: Slave) -> None:
    filling.step(2.0)
    assert filling.messages == []
    assert filling.call("fmi2DoStep", c_double(7.0), c_double(0.1), 1) == ERROR
    assert filling.logged == [(ERROR, "logStatusError")]


@pytest.mark.parametrize("names", [(), (b"logEvents",), (b"logAll",)])
def test_events_are_reported_when_asked_for(filling: Slave, names: tuple[bytes, ...]) -> None:
    assert switch(filling, 1, *names) == OK
    filling.step(2.0)
    assert (filling.messages, filling.logged) == ([EVENT], [(OK, "logEvents")])


def test_a_category_can_be_switched_off(filling: Slave) -> None:
    assert switch(filling, 1, b"logAll") == OK
    assert switch(filling, 0, b"logStatusError") == OK
    assert filling.call("fmi2DoStep", c_double(7.0), c_double(0.1), 1) == ERROR
    assert filling.messages == []
    filling.step(2.0)
    assert filling.messages == [EVENT]


def test_an_unknown_category_switches_nothing(filling: Slave) -> None:
    assert switch(filling, 1, b"logEvents", b"nonsense") == ERROR
    assert filling.messages == [
        "fmi2SetDebugLogging: category 'nonsense' is unknown; there are logEvents, logStatusDiscard, logStatusError and "
        "logAll"
    ]
    filling.step(2.0)
    assert len(filling.messages) == 1


def test_a_discarded_evaluation_has_its_own_category(fmus: dict[str, Path], tmp_path: Path) -> None:
    with Slave(fmus["root"], tmp_path / "root", MODEL_EXCHANGE).start() as slave:
        slave.insist("fmi2SetContinuousStates", byref(c_double(-1.0)), c_size_t(1))
        assert slave.call("fmi2GetDerivatives", byref(c_double()), c_size_t(1)) == DISCARD
        assert slave.logged == [(DISCARD, "logStatusDiscard")]


def test_logging_belongs_to_the_instance(fmus: dict[str, Path], tmp_path: Path) -> None:
    with Slave(fmus["tank"], tmp_path / "t").start() as one, Slave(fmus["tank"], tmp_path / "t").start() as other:
        assert ctypes.addressof(one.callbacks) != ctypes.addressof(other.callbacks)
        assert switch(one, 1) == OK
        one.step(2.0)
        other.step(2.0)
        assert (one.messages, other.messages) == ([EVENT], [])


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_the_tolerance_of_the_importer_counts(fmus: dict[str, Path], tmp_path: Path, tolerance: float) -> None:
    """A free swing of 3 rad/s, damped by 0.1, for ten seconds: its closed form is met within some tolerances."""
    with Slave(fmus["oscillator"], tmp_path / "o").start(tolerance) as slave:
        slave.step(10.0)
        decay, rate = 0.3, 3.0 * math.sqrt(1 - 0.1**2)
        exact = 0.5 * math.exp(-decay * 10) * (math.cos(rate * 10) + decay / rate * math.sin(rate * 10))
        error = abs(slave.get("q") - exact)
        assert error < 30 * tolerance
        assert error > 1e-4 * tolerance  # and no effort is wasted
