"""Every option that names a place for results is checked before the work begins, not after it."""

from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from fmus.errors import MisfitError
from orchestrator.cli.main import misfit

# Written to by the command itself, or long after its beginning, with a message of its own.
READ_ONLY = {"--library", "--cards", "--bench", "--database", "--mapping", "--swap", "--recorded", "--record"}
ELSEWHERE = {("misfit studio", "--workspace")}


def places(command: click.Command, name: str, context: click.Context) -> Iterator[tuple[str, str]]:
    """Every (command, option) that takes a file or a folder."""
    if isinstance(command, click.Group):
        for sub in command.list_commands(context):
            found = command.get_command(context, sub)
            assert found is not None
            yield from places(found, f"{name} {sub}", context)
    for option in command.params:
        takes_file = option.metavar in ("F", "FILE", "DIR", "OUT") and isinstance(option, click.Option)
        if takes_file and option.opts[-1] not in READ_ONLY and (name, option.opts[-1]) not in ELSEWHERE:
            yield name, option.opts[-1]


PLACES = sorted(places(misfit, "misfit", click.Context(misfit)))


def test_commands_have_many_such_options() -> None:
    assert len(PLACES) > 30
    assert ("misfit compare", "--json") in PLACES
    assert ("misfit hil hold", "--out") in PLACES


@pytest.mark.parametrize(("name", "option"), PLACES)
@pytest.mark.parametrize("place", ["/proc/no-such-folder/x", f"{__file__}/below", "/" + 300 * "x" + "/y"])
def test_a_place_that_cannot_be_written_is_refused_before_anything_is_read(name: str, option: str, place: str) -> None:
    context = click.Context(misfit)
    command: click.Command | None = misfit
    for part in name.split()[1:]:
        assert isinstance(command, click.Group)
        command = command.get_command(context, part)
    assert command is not None

    with pytest.raises(MisfitError, match="cannot be written: .*; choose another place"):
        command.make_context(name, [option, place])


def test_looking_whether_a_place_can_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    found = misfit.get_command(click.Context(misfit), "compare")
    assert found is not None

    with pytest.raises(click.MissingParameter):
        found.make_context("compare", ["--json", str(tmp_path / "new" / "x.json")])

    assert not list(tmp_path.iterdir())
