"""A diagnosis remembers its model and where classes were found, so that `misfit add` needs neither `--to` nor `--library`."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from plants import SLIDE

from orchestrator.cli.improve import add

DOCUMENT = {
    "schema": "misfit.diagnosis/1",
    "data": "data",
    "verdict": "named",
    "effects": [
        {
            "id": "parameter_error",
            "site": "m",
            "parameters": {"share": {"value": 0.5, "unit": "1", "ci90": [0.4, 0.6]}},
        }
    ],
}


@pytest.fixture
def diagnosis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A diagnosis of a model that extends a class of a library."""
    monkeypatch.setenv("MODELICAPATH", "")
    library = tmp_path / "libs" / "Lib"
    library.mkdir(parents=True)
    (library / "package.mo").write_text("package Lib\nend Lib;\n")
    (library / "Slide.mo").write_text(f"within Lib;\n{SLIDE}")
    (tmp_path / "Mine.mo").write_text("model Mine\n  extends Lib.Slide(k = 40);\nend Mine;\n")
    document = DOCUMENT | {"model": f"{tmp_path / 'Mine.mo'}:Mine", "libraries": [str(tmp_path / "libs")]}
    (tmp_path / "found.json").write_text(json.dumps(document))
    return tmp_path / "found.json"


def test_an_effect_is_added_without_naming_the_library_again(diagnosis: Path) -> None:
    done = CliRunner().invoke(add, [str(diagnosis), "--out", str(diagnosis.parent / "out")], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "m=3)" in (diagnosis.parent / "out" / "Mine_1.mo").read_text().replace(" ", "")


def test_a_class_alone_in_its_library_is_copied_with_the_effect(diagnosis: Path) -> None:
    """It uses nothing of the package that it stands in, so nothing is imported from there."""
    document = json.loads(diagnosis.read_text())
    size = {"b": {"value": 1.5, "unit": "N.s/m", "ci90": [1.4, 1.6]}}
    document["effects"] = [{"id": "viscous_friction", "site": "x", "parameters": size}]
    diagnosis.write_text(json.dumps(document))
    done = CliRunner().invoke(add, [str(diagnosis), "--out", str(diagnosis.parent / "out")], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "- viscous1_b*v" in (diagnosis.parent / "out" / "Mine_1.mo").read_text()


def test_a_library_that_is_gone_is_named(diagnosis: Path) -> None:
    (diagnosis.parent / "libs").rename(diagnosis.parent / "elsewhere")
    done = CliRunner().invoke(add, [str(diagnosis), "--out", str(diagnosis.parent / "out")])
    assert f"was made with the library folder {diagnosis.parent / 'libs'}, which is not there" in str(done.exception)


@pytest.fixture
def own_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A diagnosis of a model in the working folder, named there by its class alone."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "Slide.mo").write_text(SLIDE)
    (tmp_path / "found.json").write_text(json.dumps(DOCUMENT | {"model": "Slide", "model_file": "Slide.mo:Slide"}))
    return tmp_path


def test_an_effect_is_added_to_the_users_own_file_without_naming_it_again(own_model: Path) -> None:
    done = CliRunner().invoke(add, ["found.json", "--out", "out"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "m=3)" in (own_model / "out" / "Slide_1.mo").read_text().replace(" ", "")


def test_a_model_file_that_is_gone_is_named(own_model: Path) -> None:
    (own_model / "Slide.mo").unlink()
    done = CliRunner().invoke(add, ["found.json", "--out", "out"])
    assert "found.json was made for Slide.mo:Slide, which is not there" in str(done.exception)
