"""Names from a browser become names of files and nothing else."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.studio.names import safe_name


@given(st.text())
def test_any_name_is_one_part_of_a_path_that_stays_in_its_folder(text: str) -> None:
    name = safe_name(text)

    assert name not in ("", ".", "..") and Path(name).name == name
    assert (Path("/here") / name).parent == Path("/here")
    assert len(name.encode()) < 255 and name.isprintable() and name[0] not in ".-~"


@pytest.mark.parametrize("name", ["trial_01.csv", "Kraft (3).mf4", "größe #2, links.parquet", "case.toml"])
def test_ordinary_names_stay_as_they_are(name: str) -> None:
    assert safe_name(name) == name


@pytest.mark.parametrize(
    ("given_name", "kept"),
    [
        ("../../etc/passwd", "passwd"),
        ("..\\..\\x.fmu", "x.fmu"),
        ("a\0b.csv", "a_b.csv"),
        (".bashrc", "bashrc"),
        ("con.csv", "_con.csv"),
    ],
)
def test_dangerous_names_lose_their_danger(given_name: str, kept: str) -> None:
    assert safe_name(given_name) == kept
