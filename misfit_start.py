"""The way in for the command `misfit` and for pytest: no file of the user's is taken for one of ours.

The packages `orchestrator`, `hil` and `fmus` have names that a user's own files may have, too. They are imported here
from beside this file, and found there from then on, whatever the search path holds before it.
"""

import sys
from importlib import import_module
from pathlib import Path

PACKAGES = ("fmus", "orchestrator", "hil")


def import_our_packages() -> None:
    """Import the packages from beside this file, unless they are there already."""
    before = sys.path[:]
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    try:
        for name in PACKAGES:
            import_module(name)
    finally:
        sys.path[:] = before


def leave_the_working_directory_out() -> None:
    """Take the working directory out of the search path, where `PYTHONPATH=.` has put it, unless misfit itself lies there."""
    here, ours = Path.cwd(), Path(__file__).resolve().parent
    if here != ours:
        sys.path[:] = [part for part in sys.path if part and Path(part).resolve() != here]


def command() -> None:
    """Run the command `misfit`."""
    leave_the_working_directory_out()
    import_our_packages()
    from orchestrator.cli.main import main

    main()
