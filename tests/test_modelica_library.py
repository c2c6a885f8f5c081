"""The Modelica library: every class with a known answer gives it, in the built FMU."""

import re
from pathlib import Path

import fmpy
import numpy as np
import pytest

from fmus.build import Target, build_all
from fmus.catalogue import ModelicaModel
from fmus.frontend.lint.parser import parse
from fmus.frontend.lint.tree import ClassDef, Component, Extends
from fmus.library import library_root

FOLDER = library_root() / "FESArm"
TESTS = [line for line in (FOLDER / "Test" / "package.order").read_text().split() if line]
# The integrator keeps the relative error of a step below 1e-10, and answers are of the order of one.
TOLERANCE = 1e-8
# Laws that smooth a corner differ from the plain formula by as much as their documentation says.
SMOOTHED = {"MuscleTendonEquilibrium": 2e-6}  # N, of up to 100 N


def _run(name: str, folder: Path, output: list[str] | None = None) -> np.ndarray:
    """The class from 0 to the stop time of its experiment, at 101 points."""
    target = Target(ModelicaModel(name, f"FESArm.Test.{name}"), "2.0", folder / f"{name}.fmu")
    build_all([target], workers=1)
    source = (FOLDER / "Test" / f"{name}.mo").read_text()
    (stop,) = (float(text) for text in re.findall(r"experiment\(StopTime=([\d.]+)\)", source))
    points = {"stop_time": stop, "step_size": stop / 100, "output_interval": stop / 100}
    result = fmpy.simulate_fmu(str(target.path), relative_tolerance=1e-10, output=output, **points)
    assert len(result) == 101
    assert result["time"][-1] == pytest.approx(stop)
    return result


@pytest.mark.parametrize("name", TESTS)
def test_error_variables_of_the_test_models_stay_at_zero(name: str, tmp_path: Path) -> None:
    result = _run(name, tmp_path)

    errors = [column for column in result.dtype.names if column.lower().endswith("error")]
    assert errors
    for column in errors:
        assert np.abs(result[column]).max() < SMOOTHED.get(name, TOLERANCE), column


def test_the_free_linkage_keeps_its_energy_to_eight_digits(tmp_path: Path) -> None:
    result = _run("FreeLinkageKeepsItsEnergy", tmp_path, ["energyError", "energy", "start"])

    assert result["time"][-1] == 10.0
    assert result["energy"].min() > 0.1  # J
    assert np.abs(result["energyError"] / result["start"]).max() < 1e-8


def test_every_file_of_the_test_package_is_in_its_order() -> None:
    files = {path.stem for path in (FOLDER / "Test").glob("*.mo")} - {"package"}
    assert files == set(TESTS)


def test_every_law_has_a_model_with_a_known_answer() -> None:
    sources = {path.stem: path.read_text() for path in FOLDER.rglob("*.mo")}
    # Other files are packages, contracts, and sets of parameters.
    law = re.compile(r"^(equation|algorithm)\b|^\s*extends Partial", re.MULTILINE)
    laws = {
        path.stem
        for package in ("Effects", "Muscles", "Isometric", "Linkage", "Plants")
        for path in (FOLDER / package).rglob("*.mo")
        if not re.search(r"^\s*partial ", sources[path.stem], re.MULTILINE) and law.search(sources[path.stem])
    }
    assert len(laws) > 30
    reached = set(TESTS)
    # What a test uses is tested with it: a muscle's functions, a plant's parts.
    while more := {
        name
        for name in sources.keys() - reached
        if any(re.search(rf"\b{name}\b", sources[user]) for user in reached if user != "package")
    }:
        reached |= more
    assert laws - reached == set()


@pytest.mark.parametrize(
    "order",
    sorted((library_root() / "FESArm").rglob("package.order")),
    ids=lambda path: str(path.parent.relative_to(library_root())),
)
def test_package_order_names_every_class_of_its_folder_once(order: Path) -> None:
    files = {path.stem for path in order.parent.glob("*.mo")} - {"package"}
    folders = {path.parent.name for path in order.parent.glob("*/package.mo")}

    assert sorted(order.read_text().split()) == sorted(files | folders)


CLASS_FILES = sorted(FOLDER.rglob("*.mo"))


def _name(path: Path) -> str:
    return str(path.relative_to(FOLDER).with_suffix(""))


@pytest.mark.parametrize("path", CLASS_FILES, ids=_name)
def test_every_class_says_what_it_is(path: Path) -> None:
    found = re.search(r'annotation\s*\((?s:.*)Documentation\(info="<html>\s*<p>((?s:.*?))</p>', path.read_text())

    assert found, "there is no Documentation"
    assert len(found.group(1).split()) > 2


def _is_effect_law(path: Path) -> bool:
    contract = re.compile(r"^\s*(partial model|package) |present=false", re.MULTILINE)
    return "Effects" in path.parts and not contract.search(path.read_text())


@pytest.mark.parametrize("path", [path for path in CLASS_FILES if _is_effect_law(path)], ids=_name)
def test_every_law_of_an_effect_states_its_equation_and_where_it_comes_from(path: Path) -> None:
    text = path.read_text()
    information = text[text.index("Documentation(") :]

    words = re.sub(r"Documentation\(info=|<[^>]*>", "", information)

    assert " = " in words
    assert re.search(r"\b[Ss]ource\b|\bDerived here\b", words)


def _without_unit(definition: ClassDef) -> list[str]:
    """Names of the Real variables and types of a class and of the classes in it that state no unit."""

    def is_bare(declared: Component | Extends) -> bool:
        units = [m.value for m in declared.modifiers if m.name == ("unit",)]
        return declared.type_name == ("Real",) and not any(
            value is not None and value.text.strip('"') for value in units
        )

    found = [component.name for component in definition.components.values() if is_bare(component)]
    found += [definition.name] if definition.short is not None and is_bare(definition.short) else []
    return found + [name for nested in definition.classes.values() for name in _without_unit(nested)]


def test_a_real_variable_or_type_without_unit_is_found() -> None:
    (definition,) = parse(
        """model M
          type Bare = Real(min=0);
          type Length = Real(final unit="m");
          parameter Real a = 1;
          Real b[2](each unit="1"), c(unit="") "Empty";
          Length d;
          Integer n;
        end M;""",
        "M.mo",
    )
    assert _without_unit(definition) == ["a", "c", "Bare"]


@pytest.mark.parametrize("path", CLASS_FILES, ids=_name)
def test_every_variable_of_the_library_has_a_unit(path: Path) -> None:
    (definition,) = parse(path.read_text(), path.name)

    assert _without_unit(definition) == []
