"""Building models to files: both versions, in parallel, and nothing twice."""

from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import pytest

from fmus import build
from fmus.build import build_all, targets_of
from fmus.catalogue import ModelicaModel
from fmus.errors import FmuError, ModelicaError

DECAY = "model {name} Real x(start=1, fixed=true); output Real y = x; equation der(x) = -{rate}*x; end {name};"


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MISFIT_CACHE", str(tmp_path / "cache"))


def decay(folder: Path, name: str = "Decay", rate: float = 2.0) -> ModelicaModel:
    file = folder / f"{name}.mo"
    file.write_text(DECAY.format(name=name, rate=rate))
    return ModelicaModel(name, name, file)


def only_the_model_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Someone may be editing the library or the factory while the tests run."""
    monkeypatch.setattr(build, "_shared_ingredients", lambda: [])


def forbid_builds(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("built again")

    monkeypatch.setattr(build, "build_fmu", refuse)


def test_both_versions_of_all_models_are_built_side_by_side(tmp_path: Path) -> None:
    models = [decay(tmp_path, name) for name in ("One", "Two")]

    build_all(targets_of(models, tmp_path / "out"), workers=2)

    versions = {p.name: fmpy.read_model_description(str(p)).fmiVersion for p in (tmp_path / "out").iterdir()}
    assert versions == {"One.fmu": "2.0", "One.fmi3.fmu": "3.0", "Two.fmu": "2.0", "Two.fmi3.fmu": "3.0"}


def test_an_unchanged_model_is_not_built_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_the_model_counts(monkeypatch)
    targets = targets_of([decay(tmp_path)], tmp_path / "out")
    build_all(targets, workers=1)
    before = {t.path: (t.path.read_bytes(), t.path.stat().st_mtime_ns) for t in targets}

    forbid_builds(monkeypatch)
    build_all(targets, workers=1)
    assert {t.path: (t.path.read_bytes(), t.path.stat().st_mtime_ns) for t in targets} == before

    targets[0].path.unlink()
    targets[1].path.write_bytes(b"damaged")
    build_all(targets, workers=1)
    assert [t.path.read_bytes() for t in targets] == [content for content, _ in before.values()]


def test_a_changed_source_is_built_again(tmp_path: Path) -> None:
    targets = targets_of([decay(tmp_path)], tmp_path / "out")
    build_all(targets, workers=1)
    first = fmpy.read_model_description(str(targets[0].path)).guid

    decay(tmp_path, rate=3.0)
    build_all(targets, workers=1)

    assert fmpy.read_model_description(str(targets[0].path)).guid != first


def test_two_models_for_one_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "p").mkdir()
    models = [decay(tmp_path), decay(tmp_path / "p")]
    with pytest.raises(FmuError, match=r"Decay and Decay both build Decay\.fmu; use two --out folders"):
        targets_of(models, tmp_path)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_model_that_cannot_be_compiled_says_why(tmp_path: Path, workers: int) -> None:
    broken = tmp_path / "Broken.mo"
    broken.write_text("model Broken Real x; equation der(x) = ; end Broken;")
    models = [decay(tmp_path), ModelicaModel("Broken", "Broken", broken)]
    with pytest.raises(ModelicaError, match="Broken"):
        build_all(targets_of(models, tmp_path / "out"), workers)
