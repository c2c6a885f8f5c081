"""`misfit hil robot` and `misfit hil tell`: a virtual robot for any CAN tool, and what happens to it."""

from typing import Literal

import click


@click.command()
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=29536,
    show_default=True,
    help="TCP port on 127.0.0.1: of the bus, or where `misfit hil tell` is heard beside one.",
)
@click.option("--kind", type=click.Choice(["proficio", "cia402"]), default="proficio", show_default=True)
@click.option("--side", type=click.Choice(["left", "right"]), default="right", show_default=True)
@click.option("--pendant", type=click.Choice(["idle", "active"]), default="active", show_default=True)
@click.option("--interface", help="Serve on an interface of python-can instead of TCP, such as socketcan.")
@click.option("--channel", help="Channel of that interface, such as vcan0.")
@click.option("--slcan", is_flag=True, help="Serve as a serial adapter, on a pseudo-terminal.")
@click.option("--body", metavar="MODEL", help="Strap an arm to it: `arm`, or FILE.mo:Class with the same ports.")
@click.option(
    "--set",
    "values",
    metavar="NAME=NUMBER",
    multiple=True,
    help="A parameter of that arm; without one of the joints: friction, dry, payload, delay, noise.",
)
@click.option(
    "--counts", metavar="N", default="4096", show_default=True, help="Counts a motor turn (CTS); N,N,N by motor."
)
@click.option(
    "--torque-units", metavar="N", default="2700", show_default=True, help="Units per N.m (IPNM); N,N,N by motor."
)
@click.option(
    "--heartbeat",
    "heartbeat_s",
    metavar="S",
    type=click.FloatRange(0.001),
    default=0.2,
    show_default=True,
    help="Without a word to the motors for so many seconds an active arm is let go.",
)
@click.option(
    "--firmware",
    type=click.IntRange(61, 999),
    default=200,
    show_default=True,
    help="Version of the motors' firmware (VERS), which numbers their properties.",
)
def robot(
    port: int,
    kind: str,
    side: Literal["left", "right"],
    pendant: str,
    interface: str | None,
    channel: str | None,
    slcan: bool,
    body: str | None,
    values: tuple[str, ...],
    counts: str,
    torque_units: str,
    heartbeat_s: float,
    firmware: int,
) -> None:
    """Run a virtual robot that any CAN tool can talk to (python-can: interface socketcand)."""
    from hil.virtual.__main__ import serve, serve_on, serve_slcan
    from hil.virtual.body import Body, Burden, parse_values
    from hil.virtual.made import Made, controllers

    given = parse_values(values)
    burden = Burden.of(given) if given and body is None else None
    arm = Body(burden=burden) if burden is not None else Body(body, given) if body is not None else None
    made = Made(side, pendant == "active", arm, controllers(counts, torque_units), heartbeat_s, firmware, kind)
    name = "virtual Proficio" if kind == "proficio" else "virtual CiA 402 drives"
    if slcan:
        click.echo(f"{name} ({side}) behind a serial adapter (slcan) at (Ctrl-C ends it):", err=True)
        serve_slcan(port, made)
        return
    if interface is not None:
        click.echo(f"{name} ({side}) on {interface} {channel or ''} (Ctrl-C ends it)", err=True)
        serve_on({"interface": interface, "channel": channel}, port, made)
        return
    click.echo(f"{name} ({side}) at 127.0.0.1, port (Ctrl-C ends it):", err=True)
    serve(port, made)


@click.command()
@click.argument("words", nargs=-1, required=True, metavar="WORDS")
@click.option("--port", type=click.IntRange(1, 65535), default=29536, show_default=True, help="Where it listens.")
def tell(words: tuple[str, ...], port: int) -> None:
    """Tell a virtual robot what happens to it: `lose 3`, `late`, `freeze`, `silence 2`, `press estop`, `hold`, `heal` ..."""
    from hil.virtual.control import Remote

    with Remote(port) as remote:
        remote.tell(" ".join(words))
