"""What the documentation tells people to type works, and its links lead somewhere."""

import re
import shlex
from pathlib import Path

import click
import pytest

from orchestrator.cli.main import misfit
from tests.documented_commands import ADDED, BESIDE, ENDLESS, KEEPS, NOT_RUN, blocks, files, run
from tests.documented_folders import BEFORE

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


# A page's diagnoses and sessions in real time take minutes, on a busy machine many.
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=lambda page: page.name)
def test_commands_of_a_page_run_one_after_another(page: Path, tmp_path: Path) -> None:
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    for name, text in files(page).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    if page.name in BEFORE:
        BEFORE[page.name](tmp_path)
    for block in blocks(page):
        run(block, tmp_path)


def test_every_command_that_is_not_run_or_not_run_as_written_is_on_a_page() -> None:
    lines = [command.line for page in PAGES for block in blocks(page) for command in block]

    assert all(any(line.startswith(name) for line in lines) for name in (*NOT_RUN, *ADDED, *ENDLESS, *BESIDE, *KEEPS))


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=lambda page: page.name)
def test_commands_of_a_page_exist_and_have_the_options_that_it_names(page: Path) -> None:
    for line in [command.line for block in blocks(page) for command in block if command.begins("misfit ")]:
        _, *words = shlex.split(re.sub(r"[][]", "", line))
        found: click.Command = misfit
        while isinstance(found, click.Group) and words:
            context = click.Context(found)
            # `misfit regress PATH` is short for its command for cases.
            name = words.pop(0) if words[0] in found.list_commands(context) else "cases"
            command = found.get_command(context, name)
            assert command is not None, line
            found = command
        known = {name for parameter in found.params for name in (*parameter.opts, *parameter.secondary_opts)}

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
