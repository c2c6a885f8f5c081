"""The way in for the command `misfit`, for `import misfit` and for pytest: no file of the user's is taken for one of ours.

The packages `orchestrator`, `hil` and `fmus` have names that a user's own files may have, too. They are imported here from
beside this file (in a wheel from the folder `_misfit` there), and found there from then on, whatever the search path holds
before it.
"""

import os
import sys
import warnings
from importlib import import_module
from pathlib import Path

PACKAGES = ("fmus", "orchestrator", "hil")
_HERE = Path(__file__).resolve().parent
ROOT = _HERE / "_misfit" if (_HERE / "_misfit").is_dir() else _HERE


def import_our_packages() -> None:
    """Import the packages from their own folder, unless they are there already.

    Raises:
        ImportError: if this process has imported another module of such a name.
    """
    before = sys.path[:]
    sys.path.insert(0, str(ROOT))
    try:
        for name in PACKAGES:
            _check(name, str(getattr(import_module(name), "__file__", None)))
    finally:
        sys.path[:] = before


def _check(name: str, file: str) -> None:
    if not Path(file).resolve().is_relative_to(ROOT):
        raise ImportError(
            f"this process has already imported {name} from {file}, and misfit has a package of that name; "
            f"rename that one, or run misfit in a process of its own (the command misfit does)"
        )


def leave_the_working_directory_out() -> None:
    """Take the working directory out of the search path, where `PYTHONPATH=.` has put it, unless misfit itself lies there."""
    here = Path.cwd()
    if here != _HERE:
        sys.path[:] = [part for part in sys.path if part and Path(part).resolve() != here]


def open_standard_streams() -> None:
    """Give a process that was started without standard input or output an empty one: else a pipe or file of its own would take that number."""
    number = 0
    while number < 3:
        number = os.open(os.devnull, os.O_RDWR)
    os.close(number)
    sys.stdout = sys.stdout or os.fdopen(1, "w")
    sys.stderr = sys.stderr or os.fdopen(2, "w")


def command() -> None:
    """Run the command `misfit`."""
    open_standard_streams()
    try:
        Path.cwd()
    except FileNotFoundError:
        print("misfit: the working folder is gone; change to one that exists", file=sys.stderr)
        sys.exit(2)
    leave_the_working_directory_out()
    if (
        not sys.warnoptions
    ):  # those of libraries are for developers (`python -W`); what a user has to know is a note or an error
        warnings.simplefilter("ignore")
        os.environ["PYTHONWARNINGS"] = "ignore"  # and of worker processes
    import_our_packages()
    from orchestrator.cli.main import main

    main()
