"""Descriptions that say what cannot be: one line that names the variable, before anything is run or allocated."""

import shutil
import zipfile
from pathlib import Path

import pytest
from small_fmus import small_fmu

from fmus.errors import FmuError
from orchestrator.cosim.fmu import read_description

STRANGE = {
    "a number with a comma": (2, 'start="1"', 'start="1,5"', "'k' has the start value '1,5', which is no Float64"),
    "a number in words": (3, 'start="1"', 'start="one"', "'k' has the start value 'one', which is no Float64"),
    "a unit that is no number": (2, 'm="1"', 'm="1.5x"', "the model description cannot be read"),
}


def changed(folder: Path, fmu: Path, old: str, new: str) -> Path:
    target = Path(shutil.copy(fmu, folder / "x.fmu"))
    with zipfile.ZipFile(fmu) as before, zipfile.ZipFile(target, "w") as after:
        for name in before.namelist():
            content = before.read(name)
            if name == "modelDescription.xml":
                assert old.encode() in content
                content = content.replace(old.encode(), new.encode(), 1)
            after.writestr(name, content)
    return target


@pytest.mark.parametrize("case", STRANGE.values(), ids=STRANGE)
def test_a_text_where_a_number_belongs_is_named(case: tuple[int, str, str, str], tmp_path: Path) -> None:
    version, old, new, words = case
    name = "decay" if "start" in old else "mass"
    with pytest.raises(FmuError, match=words):
        read_description(changed(tmp_path, small_fmu(name, version), old, new))


@pytest.mark.parametrize("size", ["-3", "1000000000000"])
def test_an_array_that_nothing_can_hold_is_refused(size: str, tmp_path: Path) -> None:
    fmu = changed(
        tmp_path, small_fmu("statespace", 3), 'variability="tunable" start="3"', f'variability="tunable" start="{size}"'
    )
    with pytest.raises(FmuError, match=rf"x.fmu: array '.' has the sizes \(.*{size}"):
        read_description(fmu)
