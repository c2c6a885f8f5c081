"""What the documentation tells people to type, and somebody who types it in a folder."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from tests.hil.test_any_bus import KERNEL
from tests.in_process import misfit_here

# Output comes at once, also through a pipe.
AT_ONCE = {**os.environ, "PYTHONUNBUFFERED": "1"}

# Why a command is not run as part of its page, by its beginning: what this machine has not.
NOT_RUN = {
    **({} if find_spec("ziglang") else {"misfit build arm --platforms": "needs the Zig compiler, an extra of 410 MB"}),
    **({} if KERNEL else {"misfit hil robot --interface": "needs a CAN interface of the kernel: MISFIT_CAN=vcan0 names one"}),
}  # fmt: skip
# What is added to a command, by its beginning: less of what takes minutes of real time, no browser, no port that others use.
ADDED = {
    "misfit hil hold --virtual --seconds": "--seconds 2 --rate 100",
    "misfit hil record study": "--trials 1 --rate 100",
    "misfit hil record weak.toml": "--trials 2 --rate 100",
    "misfit hil stimulate": "--posture 0.75 1.35 --rate 100",
    "misfit study caregivers --json": "--seeds 1 --draws 64 --caregivers 2",
    "misfit studio": "--no-browser --port 0 --workspace projects",
    "misfit hil robot": "--port 29611",
    "misfit hil robot --slcan": "--port 29612",
    "misfit hil robot --interface": "--port 29613",
    "misfit hil tell": "--port 29611",
    "dask scheduler": "--host 127.0.0.1 --port 28786 --no-dashboard",
    "dask worker": "--nworkers 1 --no-dashboard",
}
# What stands for a reader's own machine.
REPLACED = {"//host:8786": "//127.0.0.1:28786"}
# They run until they are stopped, here at the end of their block.
ENDLESS = ("misfit studio", "misfit hil robot", "dask scheduler", "dask worker")
# Where they are to be found, said by one that has begun: a link, a port, a terminal, a scheduler.
PLACE = re.compile(r"http://|^\d+$|^/dev/|at port \d|distributed", re.MULTILINE)
# What another terminal does meanwhile.
BESIDE = {"misfit hil view": "misfit hil hold --virtual --seconds 15 --rate 50"}
# Commands that keep what they make for all later ones of the same user.
KEEPS = ("misfit hil compile",)
# Exit code 1 says that the machine is too slow now for the usual rate, or that it stood still so long that the arm was stopped: then they are tried again, more slowly.
AS_FAST_AS_IT_IS = ("misfit hil check", "misfit hil hold")
STOOD_STILL, TRIES = "this machine is too busy", 3


# Pages whose programs in Python another test runs: with other names for their files, as a test of pytest.
PROGRAMS_ELSEWHERE = ("gp.md", "control.md", "regress.md")


@dataclass(frozen=True)
class Command:
    """A command as the page has it, or a program in Python, and the exit code that the page says (0 if it says none)."""

    line: str
    code: int = 0
    program: bool = False

    def begins(self, *beginnings: str) -> bool:
        """Whether it is one of these."""
        return self.line.startswith(beginnings)


def blocks(page: Path) -> list[list[Command]]:
    """The commands of misfit and dask in each block of a page, without the words behind them that say what they do.

    A block in Python is one command: it, after those of the page that stand before it, whose names it may use.
    """
    found, before = [], ""
    for language, text in re.findall(r"^ *```(\w*)[^\n]*\n(.*?)^ *```", page.read_text(), re.DOTALL | re.MULTILINE):
        if language != "python":
            found.append([_command(line.strip()) for line in text.splitlines()])
        elif page.name not in PROGRAMS_ELSEWHERE:
            before += text
            found.append([Command(before, program=True)])
    return [commands for block in found if (commands := [each for each in block if each])]


def _command(line: str) -> Command | None:
    line = line.removeprefix("$ ").removeprefix("- run: ")
    code = re.search(r"# exits (\d)", line)
    return (
        Command(re.split(r"  +| #|\\$", line)[0], int(code[1]) if code else 0)
        if line.startswith(("misfit ", "dask "))
        else None
    )


def files(page: Path) -> dict[str, str]:
    """Files that a page asks its reader to write: blocks with a title, by name."""
    return dict(re.findall(r"^```\w+ title=\"([^\"]+)\"\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE))


def run(block: list[Command], folder: Path) -> None:
    """Type the commands of a block one after another; every one has to end as its page says.

    Raises:
        AssertionError: A command ended otherwise, or one that runs for ever ended by itself.
    """
    with ExitStack() as running:
        for command in block:
            if command.begins(*NOT_RUN):
                continue
            if command.begins(*ENDLESS):
                running.callback(_stop, _start(command.line, folder), command.line)
                continue
            if command.begins(*BESIDE):
                _run_beside(command, folder)
                continue
            _run_to_its_end(command, folder)


def _words(line: str, program: bool = False, more: str = "") -> list[str]:
    if program:
        return [sys.executable, "-c", line]
    for text, other in REPLACED.items():
        line = line.replace(text, other)
    program, *words = shlex.split(line)
    added = [word for name, more in ADDED.items() if line.startswith(name) for word in shlex.split(more)]
    return [str(Path(sys.executable).with_name(program)), *words, *added, *shlex.split(more)]


def _run(line: str, folder: Path, program: bool = False, more: str = "") -> subprocess.CompletedProcess[str]:
    words = _words(line, program, more)
    # Sessions in real time have a process to themselves; so has what speaks to a cluster, whose client warns of large tasks.
    if line.startswith("misfit ") and not line.startswith("misfit hil") and "--scheduler" not in line:
        return misfit_here(*words[1:], folder=folder)
    kept = {"MISFIT_CACHE": str(folder / "cache")} if line.startswith(KEEPS) else {}
    return subprocess.run(words, cwd=folder, env={**AT_ONCE, **kept}, capture_output=True, text=True, check=False)


def _run_to_its_end(command: Command, folder: Path) -> None:
    line = command.line
    done = _run(line, folder, command.program)
    slow = command.begins(*AS_FAST_AS_IT_IS)
    for _ in range(TRIES):
        said = " ".join(done.stdout.split())
        if not (slow and done.returncode == 1 and STOOD_STILL in said):
            break
        for name in re.findall(r"--out (\S+)", line):
            shutil.rmtree(folder / name, ignore_errors=True)
        # What a reader does: as the words say, slower.
        done = _run(line, folder, more="".join(re.findall(r"try (--rate [\d.]+)", said)[-1:]))
    allowed = {command.code, 1} if slow and "check" in line else {command.code}
    assert done.returncode in allowed and "Traceback" not in done.stderr, f"{line}: {done.stdout}{done.stderr}"


def _run_beside(command: Command, folder: Path) -> None:
    """Run a command while another terminal does what it looks at; until that has begun, it says that nothing is there."""
    (other,) = [line for name, line in BESIDE.items() if command.begins(name)]
    done = None
    for _ in range(TRIES):  # where the machine stands still the other one ends before it is seen
        process = subprocess.Popen(_words(other), cwd=folder, env=AT_ONCE, stdout=subprocess.DEVNULL)
        done = _run(command.line, folder)
        while done.returncode and process.poll() is None:
            done = _run(command.line, folder)
        process.wait(timeout=60)
        if not done.returncode:
            return
    assert done is not None and done.returncode == 0, f"{command.line}: {done and done.stderr}"


def _start(line: str, folder: Path) -> subprocess.Popen[str]:
    """Start what goes on beside others; that which runs for ever has said where it is to be found."""
    process = subprocess.Popen(
        _words(line),
        cwd=folder,
        env=AT_ONCE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    if line.startswith(ENDLESS):
        assert process.stdout is not None
        said = ""
        while not PLACE.search(said):
            more = process.stdout.readline()
            assert more, f"{line} ended by itself: {said}"
            said += more
    return process


def _stop(process: subprocess.Popen[str], line: str) -> None:
    assert process.poll() is None, f"{line} ended by itself: {process.communicate()[0]}"
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 0 and "Traceback" not in output, f"{line}: {process.returncode} {output}"
