"""The command `misfit`: finds its sub-commands by entry points and turns errors into one line and an exit code."""

import os
import sys
from difflib import get_close_matches
from importlib.metadata import EntryPoint, entry_points
from shutil import get_terminal_size
from textwrap import fill

import click

GROUP = "misfit.commands"


class Commands(click.Group):
    """Sub-commands by entry point, imported when they are used, so that `misfit --help` stays quick."""

    def _found(self) -> dict[str, EntryPoint]:
        return {entry.name: entry for entry in entry_points(group=GROUP)}

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(self._found())

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        entry = self._found().get(name)
        return None if entry is None else entry.load()

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if name not in self._found():
            near = get_close_matches(name, self._found(), n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"commands are {', '.join(self.list_commands(ctx))}"
            raise click.UsageError(f"there is no command '{name}'; {hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        # The summaries stand in the entry points' own table below: loading the commands would take a second.
        rows = [(name, SUMMARIES.get(name, "")) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


SUMMARIES = {
    "add": "Write the model with an effect in it, as Modelica and FMU.",
    "blocks": "Show, plot and compare learned blocks.",
    "build": "Build FMUs from Modelica.",
    "compare": "Show where a model fails against a measurement, and by how much.",
    "convert": "Write a system as SSP or TOML.",
    "diagnose": "Name the physical effect that a model lacks.",
    "discover": "Compare, diagnose, add, compare again.",
    "hil": "Run a session with a robot on CAN, real or virtual.",
    "import": "Write a case.toml for recorded files as they are.",
    "learn": "Learn the force that a model lacks along recorded trials.",
    "ledger": "List every version of a model and its errors.",
    "models": "List the built-in models.",
    "regress": "Test whether the behaviour of FMUs changed.",
    "run": "Run a system of FMUs and other components.",
    "studio": "Do the same work in a browser.",
    "study": "Repeat the caregivers' study.",
    "sweep": "Run a system with many values, seeds or FMUs.",
    "validate": "Check FMUs, one line a finding.",
}


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="misfit-fmu", prog_name="misfit")
def misfit() -> None:
    """Compare a physics model with a measurement, name the missing effect, add it, watch the error fall.

    MODEL is an .fmu, FILE.mo:Package.Class, or a built-in model (see `misfit models`); DATA is a folder or file of
    recorded trials.
    """


def main() -> None:
    """Run the command line. Exit codes: 0 done, 1 a check failed, 2 wrong usage or input, 3 a component failed."""
    # Two BLAS threads make the small factorisations here about 100 times slower; set before NumPy is loaded.
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    from fmus.errors import MisfitError

    try:
        code = misfit.main(standalone_mode=False)
    except click.ClickException as error:
        code = _complain(error.format_message(), 2)
    except MisfitError as error:
        code = _complain(str(error), error.exit_code)
    except click.Abort:
        code = _complain("interrupted", 130)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader left; nothing to complain about
        code = 0
    except OSError as error:  # a disk that is full, a folder that went away, rights that lack
        reason = error.strerror or str(error)
        where = f"{error.filename}: {reason}; check the place, its rights and the free space"
        code = _complain(where if error.filename else reason, 2)
    sys.exit(code if isinstance(code, int) else 0)


def _complain(message: str, code: int) -> int:
    line = f"misfit: {' '.join(message.split())}"
    if sys.stderr.isatty():  # a terminal would break numbers and names at its edge
        columns = get_terminal_size().columns
        line = fill(line, columns, break_long_words=False, break_on_hyphens=False)
    print(line, file=sys.stderr)
    return code
