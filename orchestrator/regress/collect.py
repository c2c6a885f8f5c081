"""Which cases there are: case files below the paths, and FMUs that bring their own results."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.regress.case import Case, Reference, Stimulus
from orchestrator.regress.case_file import read_cases
from orchestrator.regress.names import is_case_file
from orchestrator.regress.outcome import Outcome
from orchestrator.regress.reference import named_results, replay_of

# What tools write, as pytest skips it; a folder that is named as a path is searched whatever its name.
_SKIPPED = ("build", "dist", "venv", "node_modules", "__pycache__")


def collect(paths: Sequence[Path]) -> tuple[list[Case], list[Outcome]]:
    """Cases of files and folders, each once, in order of their paths; and an outcome for each file that cannot be read.

    A file that is named is read whatever it is called. An FMU that no case names, and that brings results along (in
    its manifest, or as `Model_ref.csv` beside it), is a case of its own.

    Raises:
        MisfitError: if a path does not exist or holds no cases.
    """
    cases: list[Case] = []
    broken: list[Outcome] = []
    for path in paths:
        files = list(_files(path))
        before = len(cases) + len(broken)
        for file in files:
            if file.suffix == ".toml":
                try:
                    cases += read_cases(file)
                except MisfitError as error:
                    broken.append(Outcome(file.name, str(file), "error", str(error), "input"))
        named = {os.path.realpath(case.folder / case.model) for case in cases}
        for file in files:
            if file.suffix == ".fmu" and os.path.realpath(file) not in named:
                cases += own_cases(file, required=file == path)
        if len(cases) + len(broken) == before:
            raise MisfitError(f"{path} holds no cases; expected NAME.regress.toml, or FMUs that bring results along")
    unique = {(os.path.realpath(case.file), case.name): case for case in cases}
    return list(unique.values()), broken


def _files(path: Path) -> Iterator[Path]:
    if path.is_file():
        if path.suffix not in (".toml", ".fmu"):
            raise MisfitError(
                f"{path}: ending {path.suffix!r}; expected a case file (.regress.toml), an FMU or a folder"
            )
        yield path
        return
    if not path.is_dir():
        raise MisfitError(f"{path} does not exist; expected a case file (.regress.toml), an FMU or a folder")
    for entry in sorted(path.iterdir()):
        if entry.name.startswith(".") or entry.name in _SKIPPED:
            continue
        if entry.is_dir() and not entry.is_symlink():
            yield from _files(entry)
        elif (is_case_file(entry) or entry.suffix == ".fmu") and (entry.is_file() or not entry.exists()):
            yield entry  # a link that leads nowhere is an error of its own; a pipe would never end


def own_cases(path: Path, required: bool) -> list[Case]:
    """The case of an FMU without a case file; none if it brings no results, unless they are required."""
    try:
        if replay_of(path) is not None or named_results(path) is not None:
            return [Case(path.stem, path, path.name, reference=Reference("own", points=True))]
    except MisfitError:
        # It cannot even be read: its case says why.
        return [Case(path.stem, path, path.name, reference=Reference("own", points=True))]
    beside = path.with_name(f"{path.stem}_ref.csv")
    if beside.is_file():
        return [cross_check_case(path)]
    if required:
        raise MisfitError(f"{path} brings no results along, and there is no {beside.name}; write a case file for it")
    return []


def cross_check_case(path: Path) -> Case:
    """The case that `Model_ref.csv`, `Model_in.csv` and `Model_ref.opt` beside `Model.fmu` describe."""
    given, options = path.with_name(f"{path.stem}_in.csv"), path.with_name(f"{path.stem}_ref.opt")
    settings = _options(options) if options.is_file() else {}
    return Case(
        path.stem,
        path,
        path.name,
        start=settings.get("StartTime"),
        stop=settings.get("StopTime"),
        step=settings.get("StepSize") or None,
        solver_tolerance=settings.get("RelTol") or None,
        stimulus=Stimulus(given) if given.is_file() else Stimulus(),
        reference=Reference("file", f"{path.stem}_ref.csv"),
    )


def _options(path: Path) -> dict[str, float]:
    """Numbers of lines such as `StopTime, 10.0`."""
    found = {}
    for line in path.read_text(errors="replace").splitlines():
        key, _, value = line.partition(",")
        try:
            found[key.strip()] = float(value)
        except ValueError:
            continue
    return found
