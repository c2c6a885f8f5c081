"""Archives as tools write them: backslashes, an entry twice, names that no disk takes."""

import warnings
import zipfile
from pathlib import Path

import pytest

from fmus.archive import extract_fmu
from fmus.errors import FmuError

XML = "<fmiModelDescription/>"


def archive(path: Path, *entries: tuple[str, str]) -> Path:
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w") as file:
        warnings.simplefilter("ignore")  # of an entry that occurs twice
        for name, content in (("modelDescription.xml", XML), *entries):
            file.writestr(name, content)
    return path


def test_backslashes_are_folders(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.fmu", ("binaries\\win64\\", ""), ("binaries\\win64\\a.dll", "code"))
    folder = extract_fmu(path, tmp_path / "out")
    assert (folder / "binaries/win64/a.dll").read_text() == "code"


@pytest.mark.parametrize("name", ["..\\x", "a\\..\\..\\x", "C:\\x", "\\x", "../x"])
def test_no_name_leads_out_of_the_archive(tmp_path: Path, name: str) -> None:
    with pytest.raises(FmuError, match="is not a relative path inside the archive"):
        extract_fmu(archive(tmp_path / "a.fmu", (name, "x")), tmp_path / "out")
    assert not (tmp_path / "x").exists()


def test_an_entry_may_occur_twice_if_both_are_the_same(tmp_path: Path) -> None:
    folder = extract_fmu(archive(tmp_path / "a.fmu", ("a.txt", "x"), ("a.txt", "x")), tmp_path / "out")
    assert (folder / "a.txt").read_text() == "x"
    with pytest.raises(FmuError, match="'a.txt' occurs twice, with different contents"):
        extract_fmu(archive(tmp_path / "b.fmu", ("a.txt", "x"), ("a.txt", "y")), tmp_path / "other")


@pytest.mark.parametrize("name", ["n" * 256, "/".join(["folder"] * 600)])
def test_names_that_no_disk_takes_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(FmuError, match="bytes; the limits are 255 bytes a name and 3000 a path") as caught:
        extract_fmu(archive(tmp_path / "a.fmu", (name, "x")), tmp_path / "out")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300
