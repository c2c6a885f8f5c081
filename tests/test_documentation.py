"""What the documentation tells people to type works, and its links lead somewhere."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from orchestrator.cli.main import misfit

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def commands(page: Path) -> list[str]:
    blocks = re.findall(r"```console\n(.*?)```", page.read_text(), re.DOTALL)
    return [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ ")]


def examples(page: Path) -> list[str]:
    """Every command of misfit in any block of a page, also where the block says in words behind it what the command does."""
    blocks = re.findall(r"^ *```\w*[^\n]*\n(.*?)^ *```", page.read_text(), re.DOTALL | re.MULTILINE)
    lines = [line.strip().removeprefix("$ ").removeprefix("- run: ") for block in blocks for line in block.splitlines()]
    return [re.split(r"  +| #|;|\\$", line)[0] for line in lines if line.startswith("misfit ")]


def files(page: Path) -> dict[str, str]:
    """Files that a page asks its reader to write: blocks with a title, by name."""
    return dict(re.findall(r"^```\w+ title=\"([^\"]+)\"\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE))


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.name)
def test_commands_of_a_page_run_one_after_another(page: Path, tmp_path: Path) -> None:
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    for name, text in files(page).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    for line in commands(page):
        command, _, code = line.partition("  # exits ")
        program, *arguments = shlex.split(command)
        assert program == "misfit"

        done = subprocess.run(
            [str(Path(sys.executable).with_name("misfit")), *arguments],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )

        assert done.returncode == int(code or 0), f"{command}: {done.stderr}"


@pytest.mark.parametrize("page", [page for page in PAGES if examples(page)], ids=lambda page: page.name)
def test_commands_of_a_page_exist_and_have_the_options_that_it_names(page: Path) -> None:
    for line in examples(page):
        program, *words = shlex.split(re.sub(r"[][]", "", line))
        found: click.Command = misfit
        while isinstance(found, click.Group) and words:
            context = click.Context(found)
            # `misfit regress PATH` is short for its command for cases.
            name = words.pop(0) if words[0] in found.list_commands(context) else "cases"
            command = found.get_command(context, name)
            assert command is not None, line
            found = command
        known = {name for parameter in found.params for name in (*parameter.opts, *parameter.secondary_opts)}

        assert program == "misfit"
        assert {word.partition("=")[0] for word in words if re.match("-{1,2}[a-z]", word)} <= known, line


def test_links_of_the_readme_lead_to_files_that_exist() -> None:
    """Those of all other pages are followed in the built site."""
    for target in re.findall(r"\]\((?!http)([^)#]+)[^)]*\)", (ROOT / "README.md").read_text()):
        assert (ROOT / target).exists(), target


def test_every_effect_and_model_is_in_the_documentation() -> None:
    from fmus.catalogue import built_in_models
    from orchestrator.library.cards import effect_library

    text = (ROOT / "docs" / "models.md").read_text()
    for name in [*built_in_models(), *(card.id for card in effect_library())]:
        assert f"`{name}`" in text
