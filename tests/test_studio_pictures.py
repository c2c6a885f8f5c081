"""The documentation shows every page of the studio, in pictures that the build takes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from docs.generator import studio_pictures
from docs.generator.studio_pictures import PICTURES, SIZE
from tests.chromium import program

DOCS = Path(__file__).parents[1] / "docs"


def asked(page: Path) -> list[str]:
    return re.findall(r"<!-- studio: ([\w.]+) -->", page.read_text())


def test_every_picture_is_shown_somewhere_and_every_page_asks_for_one_that_there_is() -> None:
    assert {name for page in DOCS.rglob("*.md") for name in asked(page)} == set(PICTURES)


@pytest.mark.parametrize("page", sorted(path.name for path in (DOCS / "tutorials").glob("*.md")))
def test_every_tutorial_has_a_picture(page: str) -> None:
    assert asked(DOCS / "tutorials" / page)


def test_the_start_page_begins_with_a_picture_that_moves() -> None:
    assert asked(DOCS / "index.md") == ["main_job.webp"]


def test_a_machine_without_a_browser_builds_the_site_without_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(studio_pictures, "program", lambda: None)

    assert studio_pictures.pictures.__wrapped__() == {}


@pytest.mark.skipif(program() is None, reason="no Chromium on this machine: install the package 'chromium'")
def test_the_build_takes_every_picture_of_the_studio(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "docs.generator.studio_pictures", str(tmp_path)]
    subprocess.run(command, cwd=DOCS.parent, check=True, timeout=850)

    for name in PICTURES:
        with Image.open(tmp_path / name) as picture:
            if name.endswith(".webp"):
                assert (picture.size, getattr(picture, "n_frames", 1)) == ((960, 600), 4)
            else:
                assert picture.size == (SIZE["width"], SIZE["height"])
                colours = picture.convert("RGB").getcolors(maxcolors=1 << 20)
                assert colours is not None and len(colours) > 50, f"{name} is blank"
