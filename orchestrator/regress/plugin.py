"""Regression cases as tests of pytest, and what its fixtures do; `misfit_pytest.py` registers both.

`pytest models/` collects the same cases as `misfit regress models/`; each runs in a process of its own, so that what an
FMU breaks is a failed test. Nothing of misfit is imported before the first case is seen.
"""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from orchestrator.regress.names import is_case_file

if TYPE_CHECKING:
    from orchestrator.regress.case import Case
    from orchestrator.regress.comparison import Signal, SignalVerdict
    from orchestrator.regress.execute import Want
    from orchestrator.regress.outcome import Outcome
    from orchestrator.regress.pool import Lane

_LANES: "pytest.StashKey[dict[Want, Lane]]" = pytest.StashKey()


def collected(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Case files, and FMUs that bring their own results and that no case file beside them names."""
    if is_case_file(file_path):
        return CaseFile.from_parent(parent, path=file_path)
    if file_path.suffix == ".fmu":
        return FmuFile.from_parent(parent, path=file_path)
    return None


def end_processes(config: pytest.Config) -> None:
    """End the processes."""
    for lane in config.stash.get(_LANES, {}).values():
        lane.close()


class Difference(Exception):
    """A case did not pass."""

    def __init__(self, outcome: "Outcome") -> None:
        super().__init__(outcome.reason)
        self.outcome = outcome


class CaseFile(pytest.File):
    """The cases of a file."""

    def collect(self) -> Iterable[pytest.Item]:
        """Each case under the last part of its name."""
        from fmus.errors import MisfitError
        from orchestrator.regress.case_file import read_cases

        try:
            cases = read_cases(self.path)
        except MisfitError as error:
            raise self.CollectError(str(error)) from error
        for case in cases:
            yield CaseItem.from_parent(self, name=case.name.rpartition("/")[2], case=case)


class FmuFile(pytest.File):
    """The case that an FMU is by itself."""

    def collect(self) -> Iterable[pytest.Item]:
        """One case, or none."""
        from fmus.errors import MisfitError
        from orchestrator.regress.case_file import read_cases
        from orchestrator.regress.collect import own_cases

        for beside in sorted(self.path.parent.iterdir()):
            if not is_case_file(beside):
                continue
            try:
                cases = read_cases(beside)
            except MisfitError:  # told where that file is collected
                continue
            if any((case.folder / case.model).resolve() == self.path.resolve() for case in cases):
                return
        for case in own_cases(self.path, required=False):
            yield CaseItem.from_parent(self, name=case.name, case=case)


class CaseItem(pytest.Item):
    """One case."""

    def __init__(self, *, case: "Case", **keywords: Any) -> None:
        super().__init__(**keywords)
        self.case = case
        for tag in case.tags:
            self.extra_keyword_matches.add(tag)

    def runtest(self) -> None:
        """Run the case in a process of its own."""
        outcome = _lane(self.config, "verdict").run(self.case)
        self.user_properties.append(("misfit", outcome.to_json()["verdict"]))
        if outcome.verdict != "passed":
            raise Difference(outcome)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """A line for each check that did not hold."""
        if not isinstance(excinfo.value, Difference):
            return super().repr_failure(excinfo, style)
        from orchestrator.regress.junit import lines

        outcome = excinfo.value.outcome
        return "\n".join([f"{outcome.name} {outcome.verdict} ({outcome.file})", *(f"  {x}" for x in lines(outcome))])

    def reportinfo(self) -> tuple[Path, int, str]:
        """Where the case is written."""
        return self.path, 0, f"case {self.case.name}"


def _lane(config: pytest.Config, want: "Want") -> "Lane":
    """The process for cases of this session; those whose signals are kept have one of their own."""
    from orchestrator.regress.pool import Lane

    lanes = config.stash.setdefault(_LANES, {})
    if want not in lanes:
        lanes[want] = Lane(want)
    return lanes[want]


def runner(request: pytest.FixtureRequest) -> "Callable[..., Mapping[str, Signal]]":
    """What the fixture `misfit_run` gives to a test."""

    def run(model: str | Path, **options: Any) -> "Mapping[str, Signal]":
        from orchestrator.regress.one_run import case_of, kept_signals

        case = case_of(request.node.name, Path(request.path), str(model), options)
        return kept_signals(_lane(request.config, "signals").run(case))

    return run


def compared_or_failed(result: "Mapping[str, Signal]", reference: Any, **tolerance: Any) -> "tuple[SignalVerdict, ...]":
    """What the fixture `misfit_compare` gives to a test."""
    from orchestrator.regress.one_run import compared

    verdicts = compared(result, reference, tolerance)
    wrong = [f"{each.name}: {each.reason}" for each in verdicts if not each.passed]
    if wrong:
        pytest.fail("\n".join(wrong), pytrace=False)
    return verdicts
