"""Every command is killed by `test_no_orphans.py`, or starts no process."""

import json
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

# Runs commands one after another, and prints of each how it ended and the children that it started.
SPY = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
commands, children = json.loads(sys.argv.pop(1)), []
starts = ("subprocess.Popen", "os.fork", "os.forkpty", "os.posix_spawn", "os.exec", "os.system")
sys.addaudithook(lambda event, _: children.append(event) if event in starts else None)
from misfit_start import command
for words in commands:
    sys.argv, said, code = ["misfit", *words], io.StringIO(), None
    children.clear()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            command()
    except SystemExit as end:
        code = end.code
    print(json.dumps([code, children, said.getvalue()]))
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


def test_these_commands_start_no_process(folder: Path) -> None:
    listed = {**CHILDLESS, **LOOKING}
    ends = watched([[*command.split(), *arguments] for command, arguments in listed.items()], folder)
    for command, (code, children, said) in zip(listed, ends, strict=True):
        assert not children, (command, children)
        assert code in ((0,) if command in CHILDLESS else (0, 2)), (command, said)


def test_the_watch_sees_a_process(folder: Path) -> None:
    ((code, children, _),) = watched([["hil", "check", "--virtual", "--rate", "10"]], folder)
    assert code == 0 and "subprocess.Popen" in children


def watched(commands: list[list[str]], folder: Path) -> list[tuple[int, list[str], str]]:
    """Run commands in one process; of each its exit code, the starts of processes that were noted, and what it said."""
    call = [sys.executable, "-c", SPY, json.dumps(commands)]
    done = subprocess.run(
        call, cwd=folder, env=environment_of(folder), capture_output=True, text=True, check=False, timeout=240
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]
