"""Checks that run an FMU's native code: `python -m fmus.behaviour FOLDER RESULT`, as a process of its own.

FOLDER is an unpacked FMU. Into the file RESULT goes a line of JSON for each check that begins, `{"check": words}`, and
for each finding, `{"finding": words}`. An FMU may crash or hang, which is for the caller to notice (see
`fmus.validate`).
"""

import json
import sys
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from fmus.checks.repeatability import check_repeatability, check_snapshots, check_threads
from fmus.checks.structure import check_dependencies, check_derivatives, check_initial_dependencies, check_starts
from fmus.checks.subject import Subject
from fmus.checks.trajectories import check_interfaces, check_reference

Check = Callable[[Subject], Iterator[str]]
# One cause often breaks hundreds of variables.
MOST_FINDINGS = 5


def checks_of(subject: Subject) -> dict[str, Check]:
    """The checks that fit what an FMU offers, by what they look at."""
    description = subject.description
    stepping, exchanging = description.coSimulation, description.modelExchange
    checks: dict[str, Check] = {}
    if stepping is not None or exchanging is not None:
        checks["its start values"] = check_starts
    if stepping is not None and not stepping.canBeInstantiatedOnlyOncePerProcess:
        checks["two equal runs"] = check_repeatability
        checks["runs in parallel"] = check_threads
    if stepping is not None:
        checks["its state"] = check_snapshots
    if exchanging is not None:
        checks["its dependencies"] = check_dependencies
        checks["its dependencies at the start"] = check_initial_dependencies
        checks["its directional derivatives"] = check_derivatives
    if stepping is not None:
        checks["its reference results"] = check_reference
    if stepping is not None and exchanging is not None:
        checks["both interfaces"] = check_interfaces
    return checks


def main(folder: Path, result: Path) -> None:
    """Run all checks and write what they find."""
    from fmpy import read_model_description  # type: ignore[import-untyped]

    subject = Subject(folder, read_model_description(str(folder), validate=False))
    with result.open("w") as stream:

        def note(kind: str, words: str) -> None:
            stream.write(json.dumps({kind: words}) + "\n")
            stream.flush()

        for words, check in checks_of(subject).items():
            note("check", words)
            try:
                for finding in islice(check(subject), MOST_FINDINGS):
                    note("finding", finding)
            except Exception as error:  # a refused call, or whatever FMPy makes of a strange FMU
                note("finding", f"checking {words} failed: {' '.join(str(error).split()) or type(error).__name__}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
