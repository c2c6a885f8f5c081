"""`misfit hil`: sessions with a robot on CAN, real or virtual."""

import contextlib
import tempfile
import time
from pathlib import Path
from typing import Any

import click

from fmus.errors import MisfitError
from fmus.files import write_atomically
from hil.stimulation_cli import stimulate
from hil.terminal import ask_arm, ask_home, gaps, robot_of, stopped_by, yes
from hil.trials_cli import record
from hil.virtual.cli import robot, tell
from orchestrator.cli.common import can_be_filled, json_option, quiet_option, show, write_json


@click.group()
def hil() -> None:
    """Run a session with a robot on CAN, real or virtual."""


kind_option = click.option(
    "--robot",
    "kind",
    type=click.Choice(["proficio", "cia402"]),
    default="proficio",
    show_default=True,
    help="Which virtual robot; a bench file says so itself ([robot] kind).",
)


@hil.command()
@click.option("--virtual", is_flag=True, help="Bring a virtual robot along; nothing needs to be attached.")
@kind_option
@click.option("--bench", metavar="FILE", type=click.Path(path_type=Path), help="Bus, robot and limits (TOML).")
@click.option("--seconds", type=click.FloatRange(0.1), default=10.0, show_default=True, help="How long.")
@click.option("--rate", "rate_hz", type=float, default=500.0, show_default=True, help="Cycles a second (Hz).")
@click.option(
    "--out",
    "folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    callback=can_be_filled,
    help="Where to record; default: a new folder in ./recordings.",
)
@click.option("--dry-run", is_flag=True, help="Decide and record everything, send no torque.")
@click.option(
    "--reconnect",
    "patience_s",
    metavar="S",
    type=click.FloatRange(0.1),
    help="Where the bus breaks, wait up to so many seconds for it and begin anew; the arm has to be armed again.",
)
@json_option
@quiet_option
def hold(
    virtual: bool,
    kind: str,
    bench: Path | None,
    seconds: float,
    rate_hz: float,
    folder: Path | None,
    dry_run: bool,
    patience_s: float | None,
    json_file: str | None,
    quiet: bool,
) -> None:
    """Hold the arm where it is, and give way to whoever pushes."""
    from hil.session.again import keep_on
    from hil.session.entry import Operator
    from hil.session.session import run_session

    if virtual and patience_s is not None:
        raise MisfitError(
            "--reconnect needs --bench FILE: a virtual robot that --virtual brings along ends with its bus"
        )
    with contextlib.ExitStack() as stack:
        settings = robot_of(virtual, bench, rate_hz, stack, kind=kind)
        out = folder or Path(tempfile.mkdtemp(prefix="session-", dir=_made(Path("recordings"))))
        at_home, may_arm = (yes, yes) if virtual else (ask_home, ask_arm)

        def tell(words: str) -> None:
            click.echo(words, err=True)

        def run(into: Path) -> dict[str, Any]:
            return run_session(settings, seconds, Operator(at_home, may_arm, tell=tell), into, dry_run=dry_run)

        document = (
            run(out)
            if patience_s is None
            else keep_on(run, out, settings.bus, patience_s, tell, dry_run=dry_run, kind=settings.kind)
        )
    write_json(json_file, document)
    if json_file != "-":
        late = document["lateness_us"]
        show(
            f"{document['cycles']} cycles at {document['rate_hz']:g} Hz, {document['missed']} missed,"
            f" {document['answers_late']} answers late, {document['frames_lost']} lost\n"
            f"late by {late['p50']} us (median), {late['p99']} us (99 %), {late['max']} us (at most)\n"
            + gaps(document)
            + "".join(f"not permitted here: {words}; cycles may be late\n" for words in document["not_permitted"])
            + "".join(f"broken off: {each['fault']}\n" for each in document.get("breaks", []))
            + stopped_by(document, virtual)
            + f"recorded in {document['recording']}",
            quiet,
        )
    if document["faults"]:
        raise SystemExit(1)


@hil.command()
@click.option("--virtual", is_flag=True, help="Check a virtual robot; nothing needs to be attached.")
@click.option("--bench", metavar="FILE", type=click.Path(path_type=Path), help="Bus, robot and limits (TOML).")
@click.option("--rate", "rate_hz", type=float, default=500.0, show_default=True, help="Cycles a second (Hz) to hold.")
@json_option
@quiet_option
def check(virtual: bool, bench: Path | None, rate_hz: float, json_file: str | None, quiet: bool) -> None:
    """Say what is on a bus, what is missing, and what is set up wrongly. Motors are woken, not energised."""
    from dataclasses import asdict

    from hil.bus.wire import open_wire
    from hil.robots.known import PROFICIO
    from hil.session.check import check as look
    from hil.session.check import check_any

    with contextlib.ExitStack() as stack:
        settings = robot_of(virtual, bench, rate_hz, stack)
        kind = settings.kind
        wire = open_wire(settings.bus, kind.torque_identifiers)
        stack.callback(wire.close)
        findings = []
        is_known = settings.robot == PROFICIO
        looked = (
            look(wire, rate_hz, time.sleep, settings.limits.joints, settings.waived)
            if is_known
            else check_any(wire, kind, rate_hz)
        )
        for finding in looked:
            findings.append(finding)
            if json_file != "-":
                show(f"{'ok ' if finding.good else 'BAD'}  {finding.words}", quiet)
    write_json(json_file, {"schema": "misfit.hil-check/1", "findings": [asdict(finding) for finding in findings]})
    if not all(finding.good for finding in findings):
        raise SystemExit(1)


@hil.command("compile")
@json_option
@quiet_option
def compile_decisions(json_file: str | None, quiet: bool) -> None:
    """Compile the decision of a cycle (safety core, Barrett's codecs, robot) to machine code, for sessions and replays from now on."""
    from hil.compiled import MODULES, build

    place = build()
    write_json(json_file, {"schema": "misfit.hil-compile/1", "modules": list(MODULES), "folder": str(place)})
    if json_file != "-":
        show(f"{len(MODULES)} modules compiled; sessions and replays decide by them from now on\n{place}", quiet)


@hil.command()
@click.argument("folder", metavar="RECORDING", type=click.Path(path_type=Path))
@json_option
@quiet_option
def replay(folder: Path, json_file: str | None, quiet: bool) -> None:
    """Run a recording through the same decisions: every frame must come out again, bit for bit."""
    from hil.session.recorded import replay_session

    found = replay_session(folder)
    identical = found.first_different is None
    write_json(json_file, {"cycles": found.cycles, "identical": identical})
    if json_file != "-":
        words = "identical" if identical else f"cycle {found.first_different} differs"
        show(f"{found.cycles} cycles replayed: {words}", quiet)
    if not identical:
        raise SystemExit(1)


@hil.command()
@click.argument("folder", metavar="RECORDING", type=click.Path(path_type=Path))
@quiet_option
def finish(folder: Path, quiet: bool) -> None:
    """Make a measurement set of a session that was killed, or whose machine died; sessions that end do so themselves."""
    from hil.session.recorded import finish_session

    finish_session(folder)
    show(f"finished: {folder} is a measurement set", quiet)


@hil.command()
@click.argument("folder", metavar="RECORDING", type=click.Path(path_type=Path))
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@quiet_option
def export(folder: Path, file: Path, quiet: bool) -> None:
    """Write all frames of a recording to FILE for other CAN tools: .blf, .asc, .mf4, .trc or .log."""
    from hil.recording.frames import write_frames

    show(f"{write_frames(folder, file)} frames in {file}", quiet)


@hil.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option(
    "--database",
    metavar="FILE",
    required=True,
    help="Messages of the bus: DBC, KCD, ARXML, SYM, or `proficio`, `wam4`, `wam7`, `joint_arm`.",
)
@click.option("--out", "folder", metavar="DIR", default="decoded", show_default=True, callback=can_be_filled,
              help="Where to write the measurement set.")  # fmt: skip
@click.option("--at", metavar="MESSAGE", help="One row for each frame of this message; default: the most frequent one.")
@json_option
@quiet_option
def decode(log: Path, database: str, folder: str, at: str | None, json_file: str | None, quiet: bool) -> None:
    """Make a measurement set of LOG, frames of any robot's bus (.blf, .asc, .log, .mf4, .trc, .csv), by a database."""
    from hil.codecs.database import Database
    from hil.logs import measurement_of_log

    found = measurement_of_log(log, Database(database), Path(folder), at)
    others = {f"{number:#x}": count for number, count in sorted(found.others.items())}
    document = {"rows": found.rows, "rows_at": found.at, "columns": list(found.columns), "others": others}
    write_json(json_file, {"schema": "misfit.hil-decode/1", **document, "without_unit": list(found.units)})
    lines = [f"{found.rows} rows of {len(found.columns)} signals at the times of {found.at} in {folder}"]
    if found.units:
        lines.append(f"written without a unit, as it is not known here: {', '.join(found.units)}")
    if others:
        lines.append(f"{sum(others.values())} frames that the database does not explain: {', '.join(others)}")
    show("\n".join([*lines, f"to go on: misfit compare MODEL {folder}"]), quiet or json_file == "-")


@hil.command()
@click.argument("robot", metavar="ROBOT")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--counts", type=float, default=4096, show_default=True, help="Counts of a motor's turn (CTS).")
@click.option("--torque-units", type=float, default=2700, show_default=True, help="Units of torque per N.m (IPNM).")
@click.option("--firmware", type=int, default=200, show_default=True, help="Version of the motors' firmware (VERS).")
@quiet_option
def dbc(robot: str, file: Path, counts: float, torque_units: float, firmware: int, quiet: bool) -> None:
    """Write the messages of ROBOT (proficio, wam4, wam7) as a DBC to FILE, for candump logs and any CAN tool."""
    from hil.codecs.barrett.database import dbc_of

    write_atomically(file, dbc_of(robot, counts, torque_units, firmware).encode())
    show(f"messages of a {robot} in {file}\nto go on: misfit hil decode LOG --database {file}", quiet)


hil.add_command(robot)
hil.add_command(tell)
hil.add_command(record)
hil.add_command(stimulate)


@hil.command()
@click.option("--seconds", type=click.FloatRange(0.1), help="How long; until the session ends without it.")
def view(seconds: float | None) -> None:
    """Look at the session that runs in another terminal: rates, lateness, joints, forces, faults."""
    from rich.console import Console

    from hil.view.live import watch
    from hil.view.window import newest

    with contextlib.suppress(KeyboardInterrupt):
        watch(newest(), Console(), float("inf") if seconds is None else seconds)


def _made(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    return folder


@hil.command()
@click.argument("source", metavar="SYSTEM|RECORDING", type=click.Path(path_type=Path))
@click.option("--out", "out", metavar="DIR", type=click.Path(path_type=Path), required=True, callback=can_be_filled,
              help="Where to write.")  # fmt: skip
@click.option("--joint", type=click.IntRange(1, 3), help="Which joint; default: the one that moved most.")
@click.option("--inertia", type=float, default=0.05, show_default=True, help="Of the nominal model (kg.m2).")
@click.option("--block/--no-block", "learned", default=True, help="Also learn what the model lacks as a block.")
@click.option("--discover", "named", is_flag=True, help="Also name what the model lacks, as `misfit discover` does.")
@json_option
@quiet_option
def identify(
    source: Path,
    out: Path,
    joint: int | None,
    inertia: float,
    learned: bool,
    named: bool,
    json_file: str | None,
    quiet: bool,
) -> None:
    """Run SYSTEM, a coupled system with a robot, or take a RECORDING, and make a measurement set of one of its joints.

    Writes the set with its case.toml, a nominal model with inertia alone, and the block learned from both; with --discover the
    diagnosis, and the models with what it names, too.
    """
    from hil.recording.identify import BLOCK, CLASS, DIAGNOSIS, FOUND, MODEL, write_identification
    from hil.session.recorded import recorded_pilot
    from orchestrator.cli.improve import discover
    from orchestrator.cli.learn import learn

    recording = source if source.is_dir() else _recorded_run(source, out, quiet)
    found = write_identification(recording, recorded_pilot(recording), out, joint, inertia)
    model, block = f"{out / MODEL}:{CLASS}", out / BLOCK
    if learned:
        with contextlib.suppress(SystemExit):  # a block that is refused leaves the set and the model
            learn.main([model, str(out), "--out", str(block), "--quiet"], standalone_mode=False)
    written = str(block) if learned and block.exists() else None
    document = {"schema": "misfit.hil-identify/1", "recording": str(recording), "model": model, "data": str(out)}
    write_json(json_file, {**document, "joint": found.joint, "rows": found.rows, "block": written})
    lines = [f"{found.rows} rows of joint {found.joint}, which moved by {found.moved:.3g} rad, in {out}"]
    if learned:
        coupled = block.with_suffix("") / "system.toml"
        learned_words = f"block learned: {written}, coupled to the model in {coupled}"
        lines.append(learned_words if written else "no block: what was learned made held-out runs worse")
    silent = quiet or json_file == "-"
    if not named:
        lines.append(f"to go on: misfit discover {model} {out}")
    show("\n".join(lines), silent)
    if named:
        options = ["--out", str(out / FOUND), "--json", str(out / DIAGNOSIS), *(["--quiet"] if silent else [])]
        discover.main([model, str(out), *options], standalone_mode=False)


def _recorded_run(system: Path, out: Path, quiet: bool) -> Path:
    """Run a coupled system with a robot; returns the folder that the robot's session was recorded in."""
    from hil.session.recorded import SETTINGS
    from orchestrator.cli.cosim import run

    def recordings() -> set[Path]:
        return {path.parent for root in (Path("recordings"), system.parent) for path in root.glob(f"**/{SETTINGS}")}

    before = recordings()
    out.mkdir(parents=True, exist_ok=True)
    run.main([str(system), "--out", str(out / "run.parquet"), *(["--quiet"] if quiet else [])], standalone_mode=False)
    found = recordings() - before
    if len(found) != 1:
        raise MisfitError(
            f"{system}: the run left {len(found)} recordings of robots; a system with one robot was expected"
        )
    return found.pop()
