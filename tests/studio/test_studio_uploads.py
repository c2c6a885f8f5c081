"""What a browser sends is checked before it becomes part of a project, and leaves nothing behind if it is refused."""

import io
import stat
import zipfile
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from coroutines import finished

from fmus.errors import MisfitError
from orchestrator.studio.project import Project
from orchestrator.studio.receive import receive
from orchestrator.studio.workspace import Workspace

CSV = b"time,q\n0,0\n0.1,1\n0.2,2\n"


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Workspace(tmp_path).create("a project")


def send(project: Project, kind: str, name: str, content: bytes) -> str:
    async def chunks() -> AsyncIterator[bytes]:
        for start in range(0, len(content), 1000):
            yield content[start : start + 1000]

    return finished(receive(project, kind, name, chunks()))


def zipped(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()


def link_in_a_zip() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        entry = zipfile.ZipInfo("trial.csv")
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(entry, "/etc/passwd")
    return stream.getvalue()


def files(project: Project) -> set[str]:
    return {str(path.relative_to(project.folder)) for path in project.folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("kind", "name", "content", "why"),
    [
        ("model", "cut.fmu", zipped({"modelDescription.xml": b"<fmiModelDescription/>"})[:60], "cut.fmu is not an FMU"),
        ("model", "text.fmu", b"this is no archive", "text.fmu is not an FMU"),
        ("model", "empty.fmu", zipped({"readme.txt": b""}), "has no modelDescription.xml"),
        ("model", "dtd.fmu", zipped({"modelDescription.xml": b"<!DOCTYPE a><a/>"}), "DOCTYPE"),
        ("model", "bomb.fmu", zipped({"modelDescription.xml": b"<a/>", "b": bytes(2**25)}), "times its size"),
        ("model", "away.fmu", zipped({"../away.so": b"", "modelDescription.xml": b"<a/>"}), "not a relative path"),
        ("model", "trial.csv", CSV, "ends with .fmu"),
        ("measurements", "away.zip", zipped({"../../trial.csv": CSV}), "not a relative path"),
        ("measurements", "link.zip", link_in_a_zip(), "symbolic link"),
        ("measurements", "bomb.zip", zipped({"trial.csv": bytes(2**25)}), "times its size"),
        ("measurements", "other.zip", zipped({"readme.txt": b""}), "holds no measurements"),
        ("measurements", "twice.zip", zipped({"a/t.csv": CSV, "b/t.csv": CSV}), "two files with the same name"),
        ("measurements", "cut.zip", zipped({"trial.csv": CSV})[:-10], "cut.zip is not an archive"),
        ("measurements", "program.exe", b"MZ", "expected case.toml"),
    ],
    # An archive holds the time at which it was made: two workers would not collect the same names.
    ids=lambda value: "content" if isinstance(value, bytes) else None,
)
def test_broken_and_dangerous_files_are_refused_in_one_line_and_leave_nothing(
    project: Project, kind: str, name: str, content: bytes, why: str
) -> None:
    before = files(project)

    with pytest.raises(MisfitError, match=why) as caught:
        send(project, kind, name, content)

    assert "\n" not in str(caught.value) and str(project.folder) not in str(caught.value)
    assert files(project) == before and project.model is None


def test_files_beyond_the_limit_are_refused_with_the_limit(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MISFIT_UPLOAD_MIB", "0.125")

    with pytest.raises(MisfitError, match=r"long.csv is larger than 0.125 MiB, the limit for uploads"):
        send(project, "measurements", "long.csv", bytes(140_000))

    assert project.data_files() == []


def test_names_that_lead_elsewhere_end_in_the_project(project: Project) -> None:
    send(project, "measurements", "../../../outside.csv", CSV)
    send(project, "measurements", "C:\\data\\trial.csv", CSV)

    assert [file.name for file in project.data_files()] == ["outside.csv", "trial.csv"]
    assert all(file.parent == project.measurements for file in project.data_files())


def test_zip_is_taken_from_the_folder_of_its_case_file(project: Project) -> None:
    told = send(project, "measurements", "set.zip", zipped({"set/case.toml": b"", "set/t/1.csv": CSV, "x/2.csv": CSV}))

    found = [str(file.relative_to(project.measurements)) for file in project.data_files()]
    assert found == ["case.toml", "t/1.csv"] and "2 files" in told


def test_another_model_drops_the_results_of_the_former_one(project: Project) -> None:
    (project.results / "comparison.json").write_text("{}")

    program = {"modelDescription.xml": b"<fmiModelDescription/>", "binaries/linux64/new.so": b""}
    send(project, "model", "new.fmu", zipped(program))

    assert project.model == "model/new.fmu"
    assert project.result("comparison.json") is None
