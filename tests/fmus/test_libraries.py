"""Libraries beside the user's file: found, linted, in the cache key, and compiled file by file."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.frontend.closure import library_files
from fmus.library import libraries
from orchestrator.cli.main import misfit

LAW = "within Lib;\npartial model Law\n  Real x;\n  Real f;\nend Law;\n"
LINEAR = "within Lib;\nmodel Linear\n  extends Law;\n  parameter Real k = {k};\nequation\n  f = -k*x;\nend Linear;\n"
BASE = (
    "within Lib;\nmodel Base\n  replaceable model L = Linear constrainedby Law;\n  L law;\n  Real x(start=1, fixed=true);\n"
    "equation\n  law.x = x;\n  der(x) = law.f;\nend Base;\n"
)


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A library of three classes, in a folder that MODELICAPATH names."""
    write_library(tmp_path / "libs" / "Lib", k=2)
    monkeypatch.setenv("MODELICAPATH", str(tmp_path / "libs"))
    return tmp_path / "libs" / "Lib"


def write_library(folder: Path, k: int) -> None:
    folder.mkdir(parents=True)
    (folder / "package.mo").write_text("package Lib\nend Lib;\n")
    (folder / "Law.mo").write_text(LAW)
    (folder / "Linear.mo").write_text(LINEAR.format(k=k))
    (folder / "Base.mo").write_text(BASE)


def users_model(tmp_path: Path, text: str = "model M\n  extends Lib.Base;\nend M;\n") -> ModelicaModel:
    (tmp_path / "M.mo").write_text(text)
    return ModelicaModel("M", "M", tmp_path / "M.mo")


def stiffness(model: ModelicaModel) -> float | None:
    return next(v.start for v in model.compile().parameters if v.name == "law.k")


def test_modelicapath_names_libraries(library: Path, tmp_path: Path) -> None:
    assert stiffness(users_model(tmp_path)) == 2.0


def test_a_library_that_was_edited_is_compiled_again(library: Path, tmp_path: Path) -> None:
    model = users_model(tmp_path)
    assert stiffness(model) == 2.0
    (library / "Linear.mo").write_text(LINEAR.format(k=7))
    assert stiffness(model) == 7.0


def test_files_that_a_class_does_not_need_are_not_read(library: Path, tmp_path: Path) -> None:
    (library / "Broken.mo").write_text("within Lib;\nmodel Broken\n  Real x\nend;\n")
    assert stiffness(users_model(tmp_path)) == 2.0
    found = library_files("M", tmp_path / "M.mo")
    assert {".".join(name) for name in found} == {"Lib", "Lib.Base", "Lib.Law", "Lib.Linear"}


def test_the_highest_of_several_versions_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_library(tmp_path / "libs" / "Lib 1.0", k=3)
    write_library(tmp_path / "libs" / "Lib 2.0", k=4)
    monkeypatch.setenv("MODELICAPATH", str(tmp_path / "libs"))
    assert libraries()["Lib"].name == "Lib 2.0"
    assert stiffness(users_model(tmp_path)) == 4.0


def test_the_folder_of_a_package_itself_may_be_named(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MODELICAPATH", str(library))
    assert stiffness(users_model(tmp_path)) == 2.0


def test_a_modifier_that_would_be_dropped_inside_a_library_is_refused_with_its_place(
    library: Path, tmp_path: Path
) -> None:
    (library / "Strong.mo").write_text(
        "within Lib;\nmodel Strong\n  extends Base(redeclare model L = Linear(k=5));\nend Strong;\n"
    )
    model = users_model(tmp_path, "model M\n  extends Lib.Strong;\nend M;\n")
    with pytest.raises(ModelicaError, match=r"^Strong\.mo:3: the modifiers of 'redeclare model L = Linear"):
        model.compile()


def test_a_missing_standard_library_is_told_with_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MODELICAPATH", raising=False)
    model = users_model(tmp_path, "model M\n  Modelica.Blocks.Continuous.Integrator i;\nend M;\n")
    with pytest.raises(
        ModelicaError,
        match=r"^M\.mo:2: Modelica\.Blocks\.Continuous\.Integrator is of the Modelica Standard Library, which is not found; .*--library DIR",
    ) as caught:
        model.compile()
    assert "\n" not in str(caught.value)


ROOM = """model Room
  import Modelica.Units.SI;
  import Modelica.Units.Conversions.from_degC;
  parameter SI.Temperature T0 = from_degC(20);
  parameter Modelica.SIunits.HeatCapacity C = 1000*Modelica.Constants.pi;
  Modelica.Blocks.Interfaces.RealInput P(unit="W");
  output SI.Temperature T(start = T0, fixed = true);
equation
  C*der(T) = P;
end Room;
"""


def test_units_constants_and_signals_need_no_standard_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MODELICAPATH", "")

    (tmp_path / "Room.mo").write_text(ROOM)
    system = ModelicaModel("Room", "Room", tmp_path / "Room.mo").compile()

    values = {v.name: v.start for v in system.parameters}
    assert values == {"T0": 293.15, "C": pytest.approx(3141.592653589793)}
    assert (system.states[0].unit, system.inputs[0].unit) == ("K", "W")


def test_a_standard_library_of_ones_own_goes_before_the_subset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "libs" / "Modelica"
    package.mkdir(parents=True)
    (package / "package.mo").write_text("package Modelica\n  constant Real pi = 3;\nend Modelica;\n")
    monkeypatch.setenv("MODELICAPATH", str(tmp_path / "libs"))
    text = "model M\n  output Real x(start=Modelica.pi, fixed=true);\nequation\n  der(x) = -x;\nend M;\n"
    assert users_model(tmp_path, text).compile().states[0].start == 3.0


def test_a_class_of_a_package_folder_sees_a_change_in_an_outer_package(tmp_path: Path) -> None:
    inner = tmp_path / "Own" / "Inner"
    inner.mkdir(parents=True)
    outer = tmp_path / "Own" / "package.mo"
    outer.write_text("package Own\n  constant Real g = 3;\nend Own;\n")
    (inner / "package.mo").write_text("within Own;\npackage Inner\nend Inner;\n")
    (inner / "M.mo").write_text(
        "within Own.Inner;\nmodel M\n  output Real x(start=g, fixed=true);\nequation\n  der(x) = -x;\nend M;\n"
    )
    model = ModelicaModel("M", "Own.Inner.M", inner / "M.mo")
    assert model.compile().states[0].start == 3.0
    outer.write_text("package Own\n  constant Real g = 4;\nend Own;\n")
    assert model.compile().states[0].start == 4.0


def test_the_command_line_takes_libraries_and_says_what_is_no_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MODELICAPATH", "")
    write_library(tmp_path / "libs" / "Lib", k=2)
    users_model(tmp_path)
    (tmp_path / "empty").mkdir()
    runner = CliRunner()
    refused = runner.invoke(misfit, ["build", f"{tmp_path}/M.mo:M", "--library", str(tmp_path / "empty")])
    assert "holds no Modelica package" in str(refused.exception)
    refused = runner.invoke(misfit, ["build", f"{tmp_path}/M.mo:M", "--library", str(tmp_path / "nothing")])
    assert "there is no such folder" in str(refused.exception)
    built = runner.invoke(
        misfit, ["build", f"{tmp_path}/M.mo:M", "--library", str(tmp_path / "libs"), "--out", str(tmp_path / "out")]
    )
    assert built.exit_code == 0, built.output


def test_units_of_the_standard_library_are_told_and_not_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its Thyristor adds 10000*(i - i0)*v to a voltage; in one's own file, too, a number may have a unit, and what has none is refused."""
    law = 'model Part\n  Real v(unit="V");\n  Real i(unit="A") = 2;\nequation\n  v = {};\nend Part;\n'
    package = tmp_path / "libs" / "Modelica"
    package.mkdir(parents=True)
    (package / "package.mo").write_text("package Modelica\nend Modelica;\n")
    (package / "Part.mo").write_text("within Modelica;\n" + law.format("10*i"))
    monkeypatch.setenv("MODELICAPATH", str(tmp_path / "libs"))
    user = tmp_path / "M.mo"
    user.write_text(
        "model M\n  Modelica.Part part;\n  output Real x(start=1);\nequation\n  der(x) = -part.v;\nend M;\n"
    )

    notes = ModelicaModel("M", "M", user).compile().notes

    assert any("constants without units: Part.mo:6" in note for note in notes)
    user.write_text(
        law.format("i") + "model M\n  Part part;\n  output Real x(start=1);\nequation\n  der(x) = -part.v;\nend M;\n"
    )
    with pytest.raises(ModelicaError, match=r"M\.mo:5: the units of the equation differ"):
        ModelicaModel("M", "M", user).compile()


@pytest.mark.parametrize(
    "text",
    [
        "model M\n  import L = Lib;\n  extends L.Base;\nend M;\n",
        "model M\n  import Start = Lib.Base;\n  extends Start;\nend M;\n",
        "model M\n  import Lib.{Base, Law};\n  extends Base;\nend M;\n",
        "model M\n  import Lib.*;\n  extends Base;\nend M;\n",
        'model M\n  import Lib.Base "the start";\n  extends Base;\nend M;\n',
    ],
)
def test_a_class_of_a_library_is_found_by_every_kind_of_import(text: str, library: Path, tmp_path: Path) -> None:
    assert stiffness(users_model(tmp_path, text)) == 2.0
