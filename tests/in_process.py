"""A command of `misfit` in the process of the test, which has loaded what a command loads: that takes a second each time."""

import io
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from orchestrator.cli.main import main


def misfit_here(*arguments: object, folder: Path | None = None) -> "subprocess.CompletedProcess[str]":
    """What a command says on both streams, and its exit code.

    Args:
        arguments: behind the word `misfit`.
        folder: the working folder; the present one by default.

    Raises:
        Exception: what a process would print a traceback for.
    """
    said, complained, code = io.StringIO(), io.StringIO(), None
    before, argv = Path.cwd(), sys.argv
    try:
        os.chdir(folder or before)
        sys.argv = ["misfit", *map(str, arguments)]
        with redirect_stdout(said), redirect_stderr(complained):
            main()
    except SystemExit as ended:
        code = ended.code
    finally:
        os.chdir(before)
        sys.argv = argv
    assert isinstance(code, int)
    return subprocess.CompletedProcess(arguments, code, said.getvalue(), complained.getvalue())
