"""`misfit convert`: systems between TOML and SSP."""

import numpy as np
import pytest
from click.testing import CliRunner
from small_fmus import small_fmu
from systems import pair, recorded

from fmus.errors import MisfitError
from orchestrator.cli.convert import convert
from orchestrator.cosim import Value
from orchestrator.cosim.load import load_system
from orchestrator.cosim.ssp import write_ssp


def converted(*arguments: object) -> str:
    result = CliRunner().invoke(convert, [str(each) for each in arguments], catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_a_system_goes_to_toml_and_back_and_runs_to_the_same_bits(tmp_path):
    made = pair(step=0.01).with_values({"mass.x0": Value(40.0, "cm")})
    (tmp_path / "there").mkdir()
    first = write_ssp(made, tmp_path / "one.ssp")
    converted(first, tmp_path / "there" / "two.toml")
    converted(tmp_path / "there" / "two.toml", tmp_path / "three.ssp")
    assert sorted(each.name for each in (tmp_path / "there" / "resources").iterdir()) == ["mass.fmu", "spring.fmu"]
    results = [recorded(system, 1.0)["mass.x"] for system in (made, load_system(tmp_path / "three.ssp"))]
    assert np.array_equal(*results)


def test_files_of_the_same_name_stay_apart(tmp_path):
    for name, model in (("a", "gain"), ("b", "mass")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "m.fmu").write_bytes(small_fmu(model).read_bytes())
    (tmp_path / "s.toml").write_text('[components]\na = "a/m.fmu"\nb = "b/m.fmu"\n')
    (tmp_path / "out").mkdir()
    converted(tmp_path / "s.toml", tmp_path / "out" / "s.toml")
    again = load_system(tmp_path / "out" / "s.toml")
    contents = [(again.folder / again.components[name].source).read_bytes() for name in "ab"]
    assert contents == [small_fmu("gain").read_bytes(), small_fmu("mass").read_bytes()]


def test_python_components_keep_their_names(tmp_path):
    (tmp_path / "code.py").write_text("def double(u):\n    return 2 * u\n")
    (tmp_path / "s.toml").write_text(
        '[run]\nstep = 0.1\n[components.f]\nfunction = "code.py:double"\nparameters = { u = 3.0 }\n'
    )
    (tmp_path / "out").mkdir()
    converted(tmp_path / "s.toml", tmp_path / "out" / "s.toml")
    assert recorded(load_system(tmp_path / "out" / "s.toml"), 0.1)["f.y"][-1] == 6.0


def test_other_endings_are_refused(tmp_path):
    write_ssp(pair(), tmp_path / "one.ssp")
    with pytest.raises(MisfitError, match="ending '.csv'; expected .ssp or .toml"):
        converted(tmp_path / "one.ssp", tmp_path / "x.csv")
