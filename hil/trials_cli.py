"""`misfit hil record`: a session of trials."""

import contextlib
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.errors import MisfitError
from hil.arm_options import arm_options
from orchestrator.cli.common import json_option, quiet_option, show, write_json

if TYPE_CHECKING:
    from hil.robots.base import Robot
    from hil.session.entry import Operator
    from hil.virtual.direct_bus import DirectBus

# Nobody waits longer than this for a session to end.
LONGEST_S = 6 * 3600.0
# The thread that takes each Enter for a confirmation.
LISTENER = "confirmations"


@click.command()
@click.argument("protocol", metavar="PROTOCOL")
@click.option("--virtual", is_flag=True, help="Bring a virtual robot with an arm and a caregiver along.")
@click.option(
    "--robot",
    "kind",
    type=click.Choice(["proficio", "cia402"]),
    default="proficio",
    show_default=True,
    help="Which virtual robot; a bench file says so itself ([robot] kind).",
)
@click.option("--bench", metavar="FILE", type=click.Path(path_type=Path), help="Bus, robot and limits (TOML).")
@click.option("--rate", "rate_hz", type=float, default=500.0, show_default=True, help="Cycles a second (Hz).")
@click.option("--trials", "most", type=click.IntRange(1), help="Only so many of the trials.")
@click.option(
    "--first",
    metavar="K",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    help="Begin with trial K, where a session was broken off; its files bear the trials' numbers.",
)
@arm_options
@json_option
@quiet_option
def record(
    protocol: str,
    virtual: bool,
    kind: str,
    bench: Path | None,
    rate_hz: float,
    most: int | None,
    first: int,
    body: str,
    values: tuple[str, ...],
    folder: Path,
    json_file: str | None,
    quiet: bool,
) -> None:
    """Run the trials of PROTOCOL (a TOML file, or `study`) and record them as a measurement set.

    The arm of the model library is emulated: its muscles push through the robot, a person at the wrist pushes back.
    """
    from hil.emulation.anatomy import anatomy
    from hil.emulation.muscles import Muscles
    from hil.robots.absent import SENSOR
    from hil.session.session import run_session
    from hil.terminal import robot_with_arm
    from hil.trials.protocol import read_protocol
    from hil.virtual.body import Body, parse_values

    trials = read_protocol(protocol)
    chosen = trials.trials if most is None else trials.trials[: first - 1 + most]
    trials = replace(trials, trials=chosen, confirm=trials.confirm and not virtual)
    wanted = Body(body, parse_values(values))
    with contextlib.ExitStack() as stack:
        settings, inside = robot_with_arm(virtual, bench, rate_hz, wanted, kind)
        settings = replace(settings, protocol=trials, first_trial=first)
        Muscles(anatomy())  # builds what is missing before anything moves
        operator = _operator(inside, trials.confirm, SENSOR not in settings.waived, quiet or json_file == "-", stack)
        document = run_session(settings, LONGEST_S, operator, folder, inside=inside)
    write_json(json_file, document)
    if json_file != "-":
        show(said_of(document, range(first, len(trials.trials) + 1), folder, virtual), quiet)
    if document["faults"]:
        raise SystemExit(1)


def said_of(document: Mapping[str, Any], wanted: range, folder: Path, virtual: bool) -> str:
    """Lines on what came of a session of the trials with these numbers."""
    from hil.terminal import stopped_by
    from hil.trials.files import TRIAL

    done = [number for number in wanted if (folder / TRIAL.format(number)).exists()]
    left = range(max(done, default=wanted.start - 1) + 1, wanted.stop)
    return (
        f"{document['cycles']} cycles at {document['rate_hz']:g} Hz, {document['missed']} missed,"
        f" {document['answers_late']} answers late, {document['frames_lost']} lost\n"
        f"{stopped_by(document, virtual)}{len(done)} of {len(wanted)} trials recorded in {folder}"
        + (f"; the others: --first {left.start} and another --out" if left else "")
        + (f"; to go on: misfit compare arm {folder}" if done else "")
    )


def _operator(
    inside: "DirectBus | None", confirm: bool, held: bool, quiet: bool, stack: contextlib.ExitStack
) -> "Operator":
    """Who is asked and told: people at the terminal, or the virtual caregiver; nobody holds an arm whose force is not measured."""
    from hil.session.entry import Operator
    from hil.terminal import questions
    from hil.trials.assistant import Assistant, words_of
    from hil.trials.phases import Phase
    from hil.virtual.control import Control

    def tell(trial: int, count: int, phase: Phase) -> None:
        # Not by rich: to load it takes 80 ms, in which the loop of this process gets its answers late.
        if (words := words_of(trial, count, phase, confirm, held)) and not quiet:
            click.echo(words)

    def hands(phase: Phase) -> None:
        if inside is not None and held and phase in (Phase.ANNOUNCE, Phase.RETURN):
            Control(inside.robot, inside.faults).follow(
                ["hold" if phase is Phase.ANNOUNCE else "relax"], inside.time_ns
            )

    assistant = Assistant(tell, hands)
    stack.enter_context(assistant.at_work())
    at_home, may_arm = questions(inside)
    operator = Operator(at_home, may_arm, watch=assistant.watch, tell=lambda words: click.echo(words, err=True))
    if not confirm:
        return operator
    if not sys.stdin.isatty():
        raise MisfitError("each trial is confirmed at a terminal; with confirm = false in the protocol none is")
    return replace(operator, may_arm=_then_listen(may_arm, operator.confirm))


def _then_listen(may_arm: Callable[["Robot"], bool], confirm: threading.Event) -> Callable[["Robot"], bool]:
    """The question, and from its answer on each Enter confirms; before, a listener would take what answers the questions."""

    def ask(robot: "Robot") -> bool:
        armed = may_arm(robot)
        threading.Thread(target=_listen, args=(confirm,), name=LISTENER, daemon=True).start()
        return armed

    return ask


def _listen(confirm: threading.Event) -> None:
    """Each Enter confirms."""
    for _ in sys.stdin:
        confirm.set()
