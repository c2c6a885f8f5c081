"""What the documentation tells people to type works, and its links lead somewhere."""

import re
import shlex
from importlib.util import find_spec
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


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md"], ids=lambda page: page.name)
def test_links_of_a_page_of_the_repository_lead_to_files_that_exist(page: Path) -> None:
    """Those of all other pages are followed in the built site."""
    for target in re.findall(r"\]\((?!http)([^)#]+)[^)]*\)", page.read_text()):
        assert (ROOT / target).exists(), target


TARGETS = re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE)
TEST_FILES = {path.stem for path in (ROOT / "tests").rglob("test_*.py")}


def _is_there(path: str) -> bool:
    return any(ROOT.glob(path)) if "*" in path else (ROOT / path).exists()


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CONTRIBUTING.md"], ids=lambda page: page.name)
def test_targets_of_make_modules_and_files_of_the_repository_that_a_page_names_exist(page: Path) -> None:
    code = "\n".join(re.findall(r"```.*?```|`[^`\n]+`", page.read_text(), re.DOTALL)).replace("`", "\n")
    targets = re.findall(r"(?:^|&& |\$ )make ([a-z][a-z-]*)", code, re.MULTILINE)
    modules = re.findall(r"python3? -m ([a-z_][\w.]*)", code)
    # Words in capitals stand for a name; FMUs are the reader's own.
    found = re.findall(r"(?<![\w/.])(?:tests|docs|orchestrator|hil|fmus|modelica)/[\w./*-]+", code)
    paths = [path.rstrip("./") for path in found if not re.search(r"/[A-Z]+\b|\.fmu$", path)]
    files_of_tests = re.findall(r"(?<![\w/])(test_\w+)(?:\.py)?(?![\w(])", code)

    assert [name for name in targets if name not in TARGETS] == []
    assert [name for name in modules if find_spec(name) is None] == []
    assert [path for path in paths if not _is_there(path)] == []
    assert [name for name in files_of_tests if name not in TEST_FILES] == []


def test_every_effect_and_model_is_in_the_documentation() -> None:
    from fmus.catalogue import built_in_models
    from orchestrator.library.cards import effect_library

    text = (ROOT / "docs" / "models.md").read_text()
    for name in [*built_in_models(), *(card.id for card in effect_library())]:
        assert f"`{name}`" in text
