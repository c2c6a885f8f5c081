"""Single runs and comparisons for tests that people write themselves."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.system import Value
from orchestrator.regress.case import Case, Stimulus
from orchestrator.regress.check_tables import default_check
from orchestrator.regress.comparison import Bounds, Signal, SignalVerdict, Tolerance
from orchestrator.regress.outcome import Outcome
from orchestrator.regress.reference import expected_of_table, like, read_table


def case_of(name: str, file: Path, model: str, options: Mapping[str, Any]) -> Case:
    """A case without a file: see the fixture `misfit_run` for the options.

    Args:
        name: name of the case.
        file: the file that asks for it, for messages and relative paths.
        model: the FMU or system.
        options: of the fixture.

    Raises:
        MisfitError: if an option is unknown.
    """
    rest = dict(options)
    parameters = {k: v if isinstance(v, Value) else Value(v) for k, v in rest.pop("parameters", {}).items()}
    inputs = {
        key: {"kind": "constant", "value": value} if isinstance(value, int | float) else value
        for key, value in rest.pop("inputs", {}).items()
    }
    # A bound that every number keeps: it only says which signals are wanted.
    signals = {signal: (Bounds(upper=1e300),) for signal in rest.pop("signals", ())}
    try:
        return Case(
            name, file, model, parameters=parameters, stimulus=Stimulus(signals=inputs), signals=signals, **rest
        )
    except TypeError as error:
        raise MisfitError(f"{name}: {error}") from error


def kept_signals(outcome: Outcome) -> Mapping[str, Signal]:
    """The signals of a run.

    Raises:
        ComponentError, MisfitError: if there was none.
    """
    if outcome.verdict == "error" or not outcome.signals_kept:
        kind = ComponentError if outcome.problem == "component" else MisfitError
        raise kind(outcome.reason)
    return outcome.signals_kept


def compared(result: Mapping[str, Signal], reference: Any, options: Mapping[str, Any]) -> tuple[SignalVerdict, ...]:
    """Verdicts on signals against others, or against those of a file.

    Args:
        result: signals by name.
        reference: signals by name, or the path of a table.
        options: `signals`, and those of a tolerance.

    Raises:
        MisfitError: if the file cannot be read or a unit does not fit.
    """
    rest = dict(options)
    names = tuple(rest.pop("signals", ()))
    check = default_check(Tolerance(**rest))
    if isinstance(reference, str | Path):
        reference = expected_of_table(read_table(Path(reference)), {}, str(reference)).signals
    found = []
    for name in names or tuple(reference):
        if name not in result or name not in reference:
            lacking = "result" if name not in result else "reference"
            found.append(SignalVerdict(name, False, f"the {lacking} has no signal {name!r}", "missing"))
        else:
            found.append(check.judge(result[name], like(reference[name], result[name])))
    return tuple(found)
