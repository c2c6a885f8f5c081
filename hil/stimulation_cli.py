"""`misfit hil stimulate`: postures held by emulated muscles alone."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.errors import MisfitError
from hil.arm_options import arm_options
from orchestrator.cli.common import json_option, quiet_option, show, write_json

if TYPE_CHECKING:
    from hil.control.pilot import Decision, Pilot
    from hil.settings import Settings
    from hil.stimulation.controller import Held
    from hil.virtual.direct_bus import DirectBus

# Nobody waits longer than this for a round to end.
LONGEST_S = 3600.0


@click.command()
@click.option("--virtual", is_flag=True, help="Bring a virtual robot with an arm along.")
@click.option("--bench", metavar="FILE", type=click.Path(path_type=Path), help="Bus, robot and limits (TOML).")
@click.option("--rate", "rate_hz", type=float, default=100.0, show_default=True, help="Cycles a second (Hz).")
@click.option("--posture", "wanted", type=(float, float), multiple=True, metavar="Q1 Q2",
              help="Shoulder and elbow (rad), again and again; default: the seven of the study.")  # fmt: skip
@click.option("--rounds", type=click.IntRange(1, 20), default=1, show_default=True,
              help="How often; each round learns from those before it.")  # fmt: skip
@click.option("--integral", type=float, default=1.5, show_default=True,
              help="How fast (1/s) the integrator takes over what feedback holds against; 0: no integrator.")  # fmt: skip
@click.option("--strength", type=(float,) * 6, default=(1.0,) * 6, metavar="S1 ... S6",
              help="Of the emulated muscles, which the controller does not know.")  # fmt: skip
@arm_options
@json_option
@quiet_option
def stimulate(
    virtual: bool,
    bench: Path | None,
    rate_hz: float,
    wanted: tuple[tuple[float, float], ...],
    rounds: int,
    integral: float,
    strength: tuple[float, ...],
    body: str,
    values: tuple[str, ...],
    folder: Path,
    json_file: str | None,
    quiet: bool,
) -> None:
    """Hold postures of the emulated arm by stimulation: the least activations, feedback, and an integrator; on the bus."""
    from hil.stimulation.plan import Plan
    from hil.terminal import robot_with_arm
    from hil.virtual.body import Body, parse_values
    from orchestrator.control.arm import POSTURES

    postures = wanted or tuple((float(q1), float(q2)) for q1, q2 in POSTURES)
    plan = Plan(postures, integral=integral, strength=strength)
    found: list[dict[str, Any]] = []
    for number in range(1, rounds + 1):
        # A virtual robot is a new one in each round.
        settings, inside = robot_with_arm(virtual, bench, rate_hz, Body(body, parse_values(values)))
        if len(settings.limits.joints) != len(settings.stiffness) or settings.robot != "proficio":
            raise MisfitError("stimulation emulates an arm on a Proficio; the bench file names another robot")
        held, document = _round(replace(settings, stimulation=plan), folder / f"round_{number}", inside)
        found.append(_said(held, document))
        if json_file != "-":
            show(_line(number, held, document, virtual), quiet)
        if document["faults"]:
            break
        plan = plan.after(tuple(each.rest for each in held))
    write_json(json_file, {"schema": "misfit.hil-stimulate/1", "rounds": found})
    if any(each["session"]["faults"] for each in found):
        raise SystemExit(1)


def _round(settings: "Settings", folder: Path, inside: "DirectBus | None") -> "tuple[list[Held], dict[str, Any]]":
    """A session through all postures; how they were held, and what it came to."""
    from hil.session.entry import Operator
    from hil.session.session import run_session
    from hil.terminal import questions

    controllers: list[Any] = []

    def watch(pilot: "Pilot", decision: "Decision") -> None:
        if not controllers:
            controllers.append(pilot.controller)

    at_home, may_arm = questions(inside)
    operator = Operator(at_home, may_arm, watch=watch, tell=lambda words: click.echo(words, err=True))
    document = run_session(settings, LONGEST_S, operator, folder, inside=inside)
    return (controllers[0].held if controllers else []), document


def _root_mean_square(held: "list[Held]") -> float | None:
    return (sum(each.error**2 for each in held) / len(held)) ** 0.5 if held else None


def _said(held: "list[Held]", document: Mapping[str, Any]) -> dict[str, Any]:
    """One round as JSON."""
    return {
        "error_rad": _root_mean_square(held),
        "postures": [asdict(each) for each in held],
        "session": dict(document),
    }


def _line(number: int, held: "list[Held]", document: Mapping[str, Any], virtual: bool) -> str:
    """One round in words."""
    from hil.terminal import stopped_by

    lines = [f"round {number}:"]
    for each in held:
        effort = sum(value**2 for value in each.activations)
        lines.append(
            f"  shoulder {each.target[0]:.3g}, elbow {each.target[1]:.3g} rad: off by {1e3 * each.error:.2f} mrad, effort {effort:.4f}"
        )
    error = _root_mean_square(held)
    lines += [f"  root mean square {1e3 * error:.2f} mrad"] if error is not None else []
    stopped = [f"  {line}" for line in stopped_by(document, virtual).splitlines()]
    return "\n".join([*lines, *stopped, f"  recorded in {document['recording']}"])
