"""What the commands share: options, progress, tables, and results written to files."""

import json
import os
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from fmus.errors import MisfitError
from fmus.files import try_writing, write_atomically
from orchestrator.elapsed import Elapsed, columns, in_words

if TYPE_CHECKING:
    from rich.progress import Progress

    from orchestrator.measurements import MeasurementSet
    from orchestrator.models.contract import Model

Say = Callable[[str], None]
Folder = TypeVar("Folder", str, Path, None)
# Off a terminal, long work says where it is as often as this.
LINE_EVERY_S = 30.0


def json_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--json`."""
    return click.option(
        "--json",
        "json_file",
        metavar="F",
        callback=can_be_written,
        help="Write the result to F ('-': standard output).",
    )(command)


def html_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--html`."""
    return click.option(
        "--html", "html_file", metavar="F", callback=can_be_written, help="Write a self-contained report to F."
    )(command)


def quiet_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--quiet`."""
    return click.option("--quiet", is_flag=True, help="Print nothing but errors.")(command)


def result_options(html: bool = True) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add `--json`, `--html`, `--quiet` and `--workers` to a command."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        command = json_option(command)
        if html:
            command = html_option(command)
        command = quiet_option(command)
        default = os.cpu_count() or 1
        return click.option(
            "--workers", type=click.IntRange(1, 64), default=default, show_default=True, help="Fits that run at a time."
        )(command)

    return decorate


def can_be_written(context: click.Context, option: click.Parameter, target: str | None) -> str | None:
    """Refuse a place that cannot be written to before the work, not after it."""
    if target is None or target == "-":
        return target
    if os.path.isdir(target):
        raise MisfitError(f"{target} is a folder; expected a file to write")
    _require_room_for(target, Path(target))
    return target


def can_be_filled(context: click.Context, option: click.Parameter, target: Folder) -> Folder:
    """Refuse a folder that cannot be made or written to before the work, not after it."""
    if target is not None:
        _require_room_for(target, Path(target) / "result")
    return target


def _require_room_for(place: str | Path, file: Path) -> None:
    """Raise `MisfitError`, which names `place`, if a file could not be written."""
    try:
        try_writing(file)
    except OSError as error:
        above = next(folder for folder in file.absolute().parents if os.path.exists(folder))
        reasons = {NotADirectoryError: f"{above} is no folder", PermissionError: f"no permission to write in {above}"}
        reason = reasons.get(type(error), error.strerror)
        raise MisfitError(f"{place} cannot be written: {reason}; choose another place") from error


def library_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--library DIR`: a folder of Modelica packages, or of one; it goes before MODELICAPATH."""
    return click.option(
        "--library",
        multiple=True,
        metavar="DIR",
        expose_value=False,
        is_eager=True,
        callback=_use_libraries,
        help="Folder of Modelica libraries that the model uses, such as the one that contains Modelica/package.mo; repeatable.",
    )(command)


def _use_libraries(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> None:
    from fmus.library import add_library

    for text in reversed(given):
        folder = Path(text)
        if not folder.is_dir():
            raise MisfitError(
                f"--library {text}: there is no such folder; name the one that contains the library's folder"
            )
        held = [*folder.glob("package.mo"), *folder.glob("*/package.mo"), *folder.glob("*.mo")]
        if not held:
            raise MisfitError(
                f"--library {text} holds no Modelica package; name the folder that contains, say, Modelica/package.mo"
            )
        add_library(folder)


def cards_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--cards`, folders with effect cards of the user's own."""
    return click.option(
        "--cards",
        "card_folders",
        multiple=True,
        metavar="DIR",
        type=click.Path(exists=True, file_okay=False, path_type=Path),
        help="Folder with effect cards of your own (docs/effect_cards.md); repeat it for several.",
    )(command)


def scheduler_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--scheduler`, the address of a Dask cluster."""
    return click.option(
        "--scheduler", metavar="ADDRESS", help="Refit on the Dask cluster at ADDRESS, such as tcp://host:8786."
    )(command)


def tolerance_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--tolerance`, how well the parameters of the model are known."""
    return click.option(
        "--tolerance",
        "tolerances",
        multiple=True,
        metavar="[NAME=]SHARE",
        callback=_tolerances,
        help="Standard deviation of the model's parameters, such as 5% or linkage.m=2%; they are refitted within it.",
    )(command)


def _tolerances(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, float]:
    from orchestrator.measurements.case_file import relative

    found = {}
    for text in given:
        name, _, share = text.rpartition("=")
        value = relative(share)
        if value is None:
            raise MisfitError(f"--tolerance {text}: expected a share or a percentage, such as 5% or linkage.m=0.02")
        found[name or "default"] = value
    return found


@contextmanager
def progress(quiet: bool) -> Iterator[Say]:
    """Show what is being done on a terminal; elsewhere say it in a line now and then, once the work has taken a while."""
    if quiet:
        yield lambda message: None
        return
    if not sys.stderr.isatty():
        with _now_and_then() as say:
            yield say
        return
    from rich.console import Console
    from rich.progress import Progress

    gone = Elapsed()
    with on_screen(Progress(*columns(gone), console=Console(stderr=True), transient=True)) as bar:
        task = bar.add_task("starting")

        def say(message: str) -> None:
            gone.said(message)
            bar.update(task, description=message)

        yield say


_ON_SCREEN: list["Progress"] = []


@contextmanager
def on_screen(bar: "Progress") -> Iterator["Progress"]:
    """Show a bar that redraws itself, and let `screen_paused` know of it."""
    with bar:
        _ON_SCREEN.append(bar)
        try:
            yield bar
        finally:
            _ON_SCREEN.remove(bar)


@contextmanager
def screen_paused() -> Iterator[None]:
    """Take bars off the terminal while somebody is asked: they would draw over the question and its answer."""
    bars = list(_ON_SCREEN)
    for bar in bars:
        bar.stop()
    try:
        yield
    finally:
        for bar in bars:
            bar.start()


@contextmanager
def _now_and_then(every_s: float = LINE_EVERY_S) -> Iterator[Say]:
    """Say a line on stderr every so often, also where one step of the work takes longer than that."""
    began, gone, latest, ended = time.monotonic(), Elapsed(), ["starting"], threading.Event()

    def say(message: str) -> None:
        gone.said(message)
        latest[0] = message

    def speak() -> None:
        while not ended.wait(every_s):
            words = ", ".join(filter(None, (f"{time.monotonic() - began:.0f} s", gone.words)))
            with suppress(OSError, ValueError):  # nobody reads any more
                print(f"misfit: {words}: {in_words(latest[0])}", file=sys.stderr, flush=True)

    speaker = threading.Thread(target=speak, daemon=True)
    speaker.start()
    try:
        yield say
    finally:
        ended.set()
        speaker.join()


def show(renderable: Any, quiet: bool) -> None:
    """Print a table or text, 100 columns wide in a pipe."""
    if quiet:
        return
    from rich.console import Console

    on_terminal = sys.stdout.isatty()
    # Brackets are units and elements of arrays here, such as 'phi [rad]', which rich would take for its markup.
    console = Console(width=None if on_terminal else 100, highlight=False, markup=False)
    if isinstance(renderable, str) and on_terminal:
        renderable = wrapped(renderable, console.width)
    console.print(renderable, soft_wrap=isinstance(renderable, str))
    sys.stdout.flush()  # a pipe, too, shows at once what is known


def wrapped(text: str, width: int) -> str:
    """Text in lines that fit a terminal, which would break them within numbers; a path that is longer stays whole.

    >>> wrapped("  biased by -1.25 rad", 15)
    '  biased by\\n  -1.25 rad'
    """
    lines = []
    for line in text.splitlines():
        indent = line[: len(line) - len(line.lstrip())]
        short = textwrap.wrap(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        lines += [line] if len(line) <= width else short
    return "\n".join(lines)


def write_json(target: str | None, document: Any) -> None:
    """Write a result to a file as a whole, or to standard output for `-`."""
    if target is None:
        return
    text = json.dumps(document, indent=2, allow_nan=False) + "\n"
    if target == "-":
        click.echo(text, nl=False)
    else:
        write_file(target, text)


def write_file(target: str | None, text: str | None) -> None:
    """Write text to a file as a whole."""
    if target is None or text is None:
        return
    path = Path(target)
    try:
        write_atomically(path, text.encode())
    except OSError as error:
        raise MisfitError(f"{path} cannot be written: {error.strerror}; choose another place") from error


def mend_option(command: Callable[..., None]) -> Callable[..., None]:
    """Add `--mend`."""
    return click.option(
        "--mend", "accept_mends", is_flag=True, help="Accept what the data checks propose to mend in the record."
    )(command)


def mended_record(model: "Model", measurements: "MeasurementSet", quiet: bool) -> "MeasurementSet":
    """Return the record with the proposals of the data checks accepted, and say which."""
    from orchestrator.datacheck.check import mend

    found = mend(model, measurements)
    for finding in found.done:
        show(f"Mended: {finding.proposal}, because {finding.evidence}.", quiet)
    return found.measurements
