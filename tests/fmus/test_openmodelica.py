"""The library in OpenModelica, where it is installed, and the reading of its files in any case."""

import re
import shutil
from pathlib import Path

import pytest
from openmodelica import omc_script, read_omc_csv, run_omc
from oracle_cases import NAMES, POINTS, Case, assert_same_course, case

from fmus.catalogue import built_in_models
from fmus.library import library_root

# With constant inputs everything about an isometric muscle is constant, and OpenModelica leaves constants out.
COMPARED = [name for name in NAMES if "Isometric" not in getattr(built_in_models().get(name), "class_name", "")]


def _result(rows: list[str], header: str = '"time","plant.x","der(plant.x)","plant.q[1]","mode"') -> str:
    return "\n".join([header, *rows]) + "\n"


def test_all_classes_take_the_course_that_openmodelica_computes(tmp_path: Path) -> None:
    omc = shutil.which("omc")
    if omc is None:
        pytest.skip("OpenModelica's compiler omc is not on the PATH")
    cases = [case(name) for name in COMPARED]
    for chosen, expected in zip(cases, run_omc(omc, library_root(), cases, tmp_path), strict=True):
        # It keeps protected variables and constants to itself.
        assert_same_course(chosen, expected, tmp_path, least_share=0.05)


def test_the_script_simulates_every_case_with_its_own_stop_time_and_file() -> None:
    cases = [case("pendulum"), case("TankEmpties")]

    script = omc_script(Path("/some where/library"), cases, Path("/tmp/wrappers.mo"))

    assert 'loadFile("/some where/library/FESArm/package.mo");' in script
    calls = re.findall(r"simulate\(([\w.]+), startTime=0.0, stopTime=([\d.]+), .*fileNamePrefix=\"(\w+)\"", script)
    assert calls == [("Driven_pendulum", "0.05", "case0"), ("FESArm.Test.TankEmpties", "5.0", "case1")]
    assert script.count("getErrorString();") == 4
    assert [line for line in script.splitlines() if not line.endswith(";")] == []


def test_wrapping_models_set_every_input_of_the_plant() -> None:
    chosen: Case = case("arm")
    assert chosen.source is not None
    assert chosen.source.startswith("model Driven_arm\n  FESArm.Arms.Arm plant;\nequation\n")
    assert re.findall(r"plant\.(\w+) = ([\d.]+);", chosen.source) == [(n, repr(v)) for n, v in chosen.inputs.items()]
    assert len(chosen.inputs) == 10


def test_reads_values_after_events_and_leaves_out_strings() -> None:
    # As OpenModelica's C runtime writes it: names in quotes, numbers with %.16g, strings in quotes.
    rows = [f'{0.1 * i:.16g},{i * i},0.30000000000000004,{-i},"on"' for i in range(POINTS + 1)]
    rows.insert(2, '0.2,77,0.3,77,"off"')  # from before the event at 0.2
    rows.insert(10, '0.7512345678901234,5,0.3,5,"on"')  # between the points

    columns = read_omc_csv(_result(rows), 0.1 * POINTS)

    assert columns["plant.x"] == [i * i for i in range(POINTS + 1)]
    assert columns["plant.q[1]"] == [-i for i in range(POINTS + 1)]
    assert columns["der(plant.x)"] == [0.30000000000000004] * (POINTS + 1)
    assert set(columns) == {"time", "plant.x", "der(plant.x)", "plant.q[1]"}


def test_a_simulation_that_stopped_early_is_no_result() -> None:
    rows = [f'{0.1 * i},1,1,1,"on"' for i in range(POINTS // 2)]
    with pytest.raises(ValueError, match=r"no row for t = 2\.5 s; the file has 25 rows up to 2\.4 s"):
        read_omc_csv(_result(rows), 0.1 * POINTS)
