"""Every command is killed by `test_no_orphans.py`, or starts no process."""

import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest
from commands import COMMANDS, MISFIT, OTHERS, OTHERS_WITH_MODELS, environment_of, start

from orchestrator.cli.main import misfit
from orchestrator.compare.result import SetErrors
from orchestrator.gp.block import Block, Output, Term
from orchestrator.gp.covariance import Latent
from orchestrator.gp.kernels import SquaredExponential
from orchestrator.gp.observations import observe
from orchestrator.gp.posterior import condition
from orchestrator.gp.saved import write_block
from orchestrator.ledger import LedgerEntry
from orchestrator.ledger import append as append_version
from orchestrator.regress.history import append as append_run
from orchestrator.regress.outcome import Outcome

# Notes each child that a command starts in a file.
SPY = """
import sys
marker = sys.argv.pop(1)
starts = ("subprocess.Popen", "os.fork", "os.forkpty", "os.posix_spawn", "os.exec", "os.system")
sys.addaudithook(lambda event, _: open(marker, "a").write(event) if event in starts else None)
from misfit_start import command
command()
"""
CHILDLESS = {
    "blocks": ["block.json"],
    "ledger": ["."],
    "regress trend": ["history"],
    "hil dbc": ["proficio", "messages.dbc"],
    "hil decode": ["recorded/frames.blf", "--database", "proficio", "--out", "decoded"],
    "hil export": ["recorded", "frames.log"],
    "hil finish": ["recorded"],
    "hil replay": ["recorded"],
}
# These look for a robot or a session, and go on or end the same way: without a process.
LOOKING = {"hil tell": ["heal", "--port", "1"], "hil view": ["--seconds", "0.1"]}


def test_every_command_of_the_command_line_is_in_a_list() -> None:
    listed = {*COMMANDS, *OTHERS_WITH_MODELS, *OTHERS, *CHILDLESS, *LOOKING}
    assert listed - {"pytest"} == set(commands_of(misfit, ""))


def commands_of(command: click.Command, name: str) -> list[str]:
    """Names of all commands below one, such as `hil check`."""
    if not isinstance(command, click.Group):
        return [name]
    context = click.Context(command)
    below = {each: command.get_command(context, each) for each in command.list_commands(context)}
    return [found for each, leaf in below.items() if leaf for found in commands_of(leaf, f"{name} {each}".strip())]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recorded session, a block, a ledger and the history of a regression test."""
    folder = tmp_path_factory.mktemp("childless") / "working"
    folder.mkdir()
    hold = ["hil", "hold", "--virtual", "--seconds", "0.2", "--rate", "50", "--out", "recorded", "--quiet"]
    with start([str(MISFIT), *hold], folder) as session:
        _, errors = session.communicate(timeout=60)
    assert session.returncode == 0, errors
    latents = {"f": Latent(SquaredExponential(4.0, (2.0,)))}
    seen = (observe("bench", np.linspace(-3.0, 3.0, 5), "f", np.ones(5), 0.05),)
    write_block(
        Block(condition(latents, seen), {"w": "rad/s"}, [Output("tau", "N.m", (Term("f"),))], seen),
        folder / "block.json",
    )
    errors_of = SetErrors({"q": 0.1}, 2.0)
    append_version(
        folder,
        LedgerEntry(
            0, "A", "a.fmu", (), errors_of, None, {"q": 0.1}, {"q": "rad"}, "a", "b", "2025-01-02T03:04:05Z", "1"
        ),
    )
    append_run(folder / "history", [Outcome("ball", "ball.regress.toml", "passed", seconds=0.1)])
    return folder


@pytest.mark.parametrize("command", [*CHILDLESS, *LOOKING])
def test_these_commands_start_no_process(command: str, folder: Path, tmp_path: Path) -> None:
    arguments = CHILDLESS.get(command) or LOOKING[command]
    done, children = watched([*command.split(), *arguments], folder, tmp_path)
    assert not children, children
    assert done.returncode in ((0,) if command in CHILDLESS else (0, 2)), done.stderr


def test_the_watch_sees_a_process(folder: Path, tmp_path: Path) -> None:
    done, children = watched(["hil", "check", "--virtual", "--rate", "10"], folder, tmp_path)
    assert done.returncode == 0 and "subprocess.Popen" in children


def watched(arguments: list[str], folder: Path, marked: Path) -> "tuple[subprocess.CompletedProcess[str], str]":
    """Run a command; what it did, and the starts of processes that were noted."""
    marker = marked / "children"
    marker.touch()
    call = [sys.executable, "-c", SPY, str(marker), *arguments]
    done = subprocess.run(
        call, cwd=folder, env=environment_of(folder), capture_output=True, text=True, check=False, timeout=120
    )
    return done, marker.read_text()
