"""First file of every child process: `python -I boot.py MODULE[:FUNCTION] ARGUMENT...`.

It calls the function of the module, or runs the module as `python -m MODULE` would.

Isolated Python (`-I`) leaves out the working directory, PYTHONPATH and the user's site. The search path is then built here from
what the parent hands over in MISFIT_PATH, in this order: the standard library, the folder of misfit's packages, the rest. So a
`queue.py`, an `orchestrator.py` or a folder `fmus` of the user's is never taken for one of ours. Nothing but the standard
library may be imported here.
"""

import importlib
import os
import runpy
import sys


def search_path(own: list[str], handed_over: list[str]) -> list[str]:
    """The search path of a child: its `own` one when it starts, and that of its parent."""
    library = os.path.dirname(os.__file__)
    standard = [
        part for part in own if part.endswith(".zip") or part in (library, os.path.join(library, "lib-dynload"))
    ]
    return list(dict.fromkeys([*standard, *handed_over, *own]))


def main() -> None:
    """Set the search path, and become the module."""
    handed_over = [part for part in os.environ.pop("MISFIT_PATH", "").split(os.pathsep) if part]
    sys.path[:] = search_path(sys.path, handed_over)
    if lifeline := os.environ.pop("MISFIT_LIFELINE", ""):
        from fmus.children.start import end_with

        end_with(int(lifeline))
    for package in os.environ.pop("MISFIT_WITHOUT", "").split():
        sys.modules[package] = None  # type: ignore[assignment]  # importing it raises ImportError
    module, _, function = sys.argv.pop(1).partition(":")
    if function:
        sys.exit(getattr(importlib.import_module(module), function)())
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
