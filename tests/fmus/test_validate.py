"""What is said about broken FMUs, and that unpacking them cannot do harm."""

import stat
import zipfile
from pathlib import Path

import pytest
from helpers_systems import pendulum

from fmus.archive import extract_fmu, read_archive
from fmus.errors import FmuError
from fmus.package import build_fmu
from fmus.validate import validate_fmu

XML = b'<?xml version="1.0"?><fmiModelDescription/>'
BOMB = b'<!DOCTYPE x [<!ENTITY a "aaaa">]><fmiModelDescription>&a;</fmiModelDescription>'


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return read_archive(build_fmu(pendulum(), tmp_path_factory.mktemp("good") / "pendulum.fmu"))


def pack(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return path


BROKEN = {
    "no modelDescription.xml at the top": {"model/modelDescription.xml": XML},
    r"'\.\./evil' is not a relative path inside the archive": {
        "modelDescription.xml": XML,
        "../evil": b"",
    },
    "'/evil' is not a relative path": {"modelDescription.xml": XML, "/evil": b""},
    "'C:evil' is not a relative path": {"modelDescription.xml": XML, "C:evil": b""},
    "is not a relative path inside": {
        "modelDescription.xml": XML,
        "a\\..\\..\\evil": b"",
    },
    "modelDescription.xml is not well-formed XML": {"modelDescription.xml": b"<a><b></a>"},
    "modelDescription.xml has a DOCTYPE, which FMI does not use": {"modelDescription.xml": BOMB},
    "times its size; the limit is 300 times": {
        "modelDescription.xml": XML,
        "resources/zeros": bytes(2**25),
    },
}


@pytest.mark.parametrize("message", BROKEN)
def test_a_file_that_is_no_fmu_gives_one_line(tmp_path: Path, message: str) -> None:
    path = pack(tmp_path / "broken.fmu", BROKEN[message])
    with pytest.raises(FmuError, match=message) as caught:
        validate_fmu(path)
    assert "broken.fmu" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_more_than_a_gibibyte_is_refused_before_unpacking(tmp_path: Path) -> None:
    path = pack(tmp_path / "big.fmu", {"modelDescription.xml": XML, "big": b"1234"})
    content = path.read_bytes()
    # The size in the central directory is what a reader goes by, so a forged one must not pass either.
    entry = content.rindex(b"PK\x01\x02")
    size = (2**31).to_bytes(4, "little")
    path.write_bytes(content[: entry + 24] + size + content[entry + 28 :])
    with pytest.raises(FmuError, match="unpacks to 2048 MiB; the limit is 1024 MiB"):
        extract_fmu(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_symbolic_link_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "link.fmu"
    link = zipfile.ZipInfo("resources/link")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", XML)
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(FmuError, match="entry 'resources/link' is a symbolic link"):
        extract_fmu(path, tmp_path / "out")


def test_a_repeated_entry_of_other_content_is_refused(tmp_path: Path) -> None:
    path = pack(tmp_path / "twice.fmu", {"modelDescription.xml": XML})
    with (
        zipfile.ZipFile(path, "a") as archive,
        pytest.warns(UserWarning, match="Duplicate"),
    ):
        archive.writestr("modelDescription.xml", XML + b" ")
    with pytest.raises(FmuError, match=r"'modelDescription\.xml' occurs twice"):
        validate_fmu(path)


def test_missing_files_folders_and_texts_are_told_apart(tmp_path: Path) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("no archive")
    with pytest.raises(FmuError, match=r"none\.fmu does not exist"):
        validate_fmu(tmp_path / "none.fmu")
    with pytest.raises(FmuError, match="is not a file"):
        validate_fmu(tmp_path)
    with pytest.raises(FmuError, match=r"text\.fmu is not an FMU: it cannot be read as a zip archive"):
        validate_fmu(text)


def test_damaged_content_is_reported_with_its_entry(tmp_path: Path, good: dict[str, bytes]) -> None:
    path = pack(tmp_path / "damaged.fmu", good)
    content = bytearray(path.read_bytes())
    content[60:90] = bytes(30)
    path.write_bytes(content)
    with pytest.raises(FmuError, match=r"entry 'modelDescription\.xml' is damaged"):
        validate_fmu(path)


def test_an_fmu_for_no_machine_is_a_finding(tmp_path: Path, good: dict[str, bytes]) -> None:
    bare = {name: content for name, content in good.items() if name == "modelDescription.xml"}
    findings = validate_fmu(pack(tmp_path / "bare.fmu", bare))
    assert "source file 'core.c' is listed but missing" in findings
    assert "no binary of 'Pendulum' for any platform and no sources" in findings
    sources = {name: content for name, content in good.items() if not name.startswith("binaries/")}
    assert validate_fmu(pack(tmp_path / "sources.fmu", sources)) == []


def test_a_wrong_description_is_a_list_of_findings(tmp_path: Path, good: dict[str, bytes]) -> None:
    xml = good["modelDescription.xml"].replace(b'name="w"', b'name="q"')
    findings = validate_fmu(pack(tmp_path / "wrong.fmu", {**good, "modelDescription.xml": xml}))
    assert any('"q"' in finding and "not unique" in finding for finding in findings)
    assert all("\n" not in finding for finding in findings)
