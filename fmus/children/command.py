"""The command line and the environment of a child process that runs Python."""

import os
import sys
from pathlib import Path

import fmus

_BOOT = Path(__file__).with_name("boot.py")
# The folder that holds the packages `fmus`, `orchestrator` and `hil`.
ROOT = Path(fmus.__file__).resolve().parents[1]


def python_command(program: str, *arguments: str) -> list[str]:
    """The command that runs a program in isolated Python; start it with `child_environment()`.

    Args:
        program: `MODULE:FUNCTION`, which is called without arguments, or `MODULE`, which is run as `python -m MODULE` would.
            A module whose classes travel between parent and child must be called: run, it would be there twice.
        arguments: what the program finds in `sys.argv`.
    """
    return [sys.executable, "-I", str(_BOOT), program, *arguments]


def child_environment(**more: str) -> dict[str, str]:
    """This process' environment, with the search path for a child and variables that come `more`."""
    path = os.pathsep.join(handed_over(sys.path, Path.cwd(), ROOT))
    return {**os.environ, "MISFIT_PATH": path, "MISFIT_PARENT": str(os.getpid()), **more}


def parent_process() -> int:
    """Number of the process that began this one; also where that ended before this one could ask for it.

    A child that still has work to do when its parent is gone compares it with `os.getppid()`.
    """
    return int(os.environ.get("MISFIT_PARENT", os.getppid()))


def handed_over(path: list[str], working: Path, root: Path) -> list[str]:
    """The search path that a child gets: misfit's own folder first, and never the working directory.

    Example:
        >>> handed_over(["", "/home/me", "/lib/python"], Path("/home/me"), Path("/site"))
        ['/site', '/lib/python']
    """
    rest = [str(Path(part).absolute()) for part in path if part and Path(part).resolve() != working.resolve()]
    return list(dict.fromkeys([str(root), *rest]))
