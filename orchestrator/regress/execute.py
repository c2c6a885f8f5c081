"""One case, from its file to its outcome; what goes wrong is part of the outcome."""

import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim.system import RunSettings, System
from orchestrator.regress.case import Case
from orchestrator.regress.check_tables import default_check, variables_for, with_formulas
from orchestrator.regress.comparison import Check, Signal, SignalVerdict
from orchestrator.regress.interface import CHECK, interface_of, judge_interface, path_beside, read_interface
from orchestrator.regress.outcome import Curve, Outcome, WholeVerdict, curve_of
from orchestrator.regress.prepare import system_of, with_own_experiment
from orchestrator.regress.recording import Recording, Watched, missing_reasons, record, wanted_signals
from orchestrator.regress.reference import Expected, at_points, expected_from_file, expected_of_fmu, like

# What an outcome holds beside its verdict.
Want = Literal["verdict", "signals", "coverage"]


@dataclass(frozen=True, eq=False)
class Compared:
    """A run with what it was compared with."""

    case: Case
    system: System
    recording: Recording
    expected: Expected | None
    verdicts: tuple[SignalVerdict, ...]
    curves: tuple[Curve, ...]


def execute(case: Case, progress: Watched | None = None, want: Want = "verdict") -> Outcome:
    """Run a case and judge it; `want` says what else the outcome holds: the signals, or what the run reached.

    Args:
        case: the case.
        progress: where it is noted what runs.
        want: "verdict", or what else the outcome holds.

    Raises:
        Nothing that a case can cause: a component that fails and a case that cannot be run are outcomes.
    """
    began = clock.perf_counter()
    try:
        outcome = _executed(case, progress or Watched(), want)
    except ComponentError as error:
        outcome = Outcome(case.name, str(case.file), "error", str(error), "component")
    except MisfitError as error:
        outcome = Outcome(case.name, str(case.file), "error", str(error), "input")
    return replace(outcome, took_s=clock.perf_counter() - began)


def _executed(case: Case, progress: Watched, want: Want) -> Outcome:
    if want == "coverage":
        from orchestrator.regress.reached import reached

        return Outcome(case.name, str(case.file), "passed", coverage=reached(completed(case), progress))
    return _judged(case, progress, want == "signals")


def _judged(case: Case, progress: Watched, keep: bool) -> Outcome:
    compared = run_and_compare(case, progress, may_lack=keep)
    wholes, untold = _wholes(compared, progress)
    notes = (
        ()
        if compared.verdicts or any(each.check != CHECK for each in wholes)
        else ("nothing is compared: the case has no reference, signals or checks",)
    )
    wrong = [each for each in compared.verdicts if not each.passed]
    bad = [each for each in wholes if not each.passed]
    reasons = [f"{each.name}: {each.reason}" for each in wrong] + [f"{each.check}: {each.reason}" for each in bad]
    if notes:
        reasons = [notes[0]]
    more = f" (and {len(reasons) - 1} more)" if len(reasons) > 1 else ""
    return Outcome(
        name=case.name,
        file=str(case.file),
        verdict="failed" if reasons else "passed",
        reason=reasons[0] + more if reasons else "",
        signals=compared.verdicts,
        wholes=wholes,
        curves=compared.curves,
        where=compared.expected.where if compared.expected else "",
        notes=(*notes, *untold),
        seconds=compared.recording.seconds,
        model_sha256=_digest(compared.recording),
        signals_kept=dict(compared.recording.signals) if keep else {},
    )


def run_and_compare(case: Case, progress: Watched | None = None, may_lack: bool = False) -> Compared:
    """Run a case and compare its signals with their references; with `may_lack` the reference may be missing still.

    Raises:
        MisfitError: if the case cannot be run.
        ComponentError: if a component fails.
    """
    case = completed(case)
    system = system_of(case)
    expected = None if may_lack and _lacks_reference(case) else expected_of(case, system, progress)
    names = tuple(case.signals) or (tuple(expected.signals) if expected else ())
    # Outputs that the reference lacks are a difference, too, so without named signals all of them are looked at.
    outputs = wanted_signals(system)[0].addresses if not case.signals else {}
    names = tuple(dict.fromkeys((*names, *outputs)))
    wanted, missing = wanted_signals(system, variables_for(names, case.formulas))
    recording = record(system, wanted, progress)
    recording = replace(recording, signals=with_formulas(names, case.formulas, recording.signals))
    lacking = missing_reasons(system, missing) if missing else {}
    verdicts: list[SignalVerdict] = []
    curves = []
    for name, checks in _checks(case, expected, wanted.addresses, missing).items():
        if name not in recording.signals:
            gone = next(each for each in variables_for((name,), case.formulas) if each in lacking)
            verdicts.append(SignalVerdict(name, False, lacking[gone], "missing"))
            continue
        result = recording.signals[name]
        reference = expected.signals.get(name) if expected else None
        if reference is not None and case.reference is not None and case.reference.points:
            result = at_points(result, reference)
        found = [_verdict(check, result, reference, expected) for check in checks]
        verdicts += [*found, *_ended(recording, result, reference, system.run, found)]
        if not all(each.passed for each in verdicts if each.name == name):
            curves.append(curve_of(result, reference))
    return Compared(case, system, recording, expected, tuple(verdicts), tuple(curves))


def _ended(
    recording: Recording, result: Signal, reference: Signal | None, run: RunSettings, found: list[SignalVerdict]
) -> tuple[SignalVerdict, ...]:
    """A run that a component ended early covers less than the case asks for, unless its reference ends there, too."""
    if not recording.ended or not all(each.passed for each in found):
        return ()
    if reference is not None and abs(float(reference.time[-1]) - recording.end) <= (run.step or 0.0):
        return ()
    reason = f"{recording.ended}, before the end of the case at {run.stop:g} s"
    return (SignalVerdict(result.name, False, reason, "length", result.unit),)


def _checks(
    case: Case, expected: Expected | None, addresses: Mapping[str, str], missing: tuple[str, ...]
) -> dict[str, tuple[Check, ...]]:
    """Checks by signal, in the order in which they are reported."""
    if case.signals:
        return dict(case.signals)
    if expected is None:
        return {}
    names = dict.fromkeys((*expected.signals, *missing, *addresses))
    return {name: (default_check(expected.tolerances.get(name, case.tolerance)),) for name in names}


def _verdict(check: Check, result: Signal, reference: Signal | None, expected: Expected | None) -> SignalVerdict:
    if reference is None and check.needs_reference:
        where = (
            f"the reference {expected.where} has no signal {result.name!r}" if expected else "the case has no reference"
        )
        advice = "run with --update to take it in, or name the signals to compare" if expected else "give it one"
        return SignalVerdict(result.name, False, f"{where}; {advice}", "missing", result.unit)
    try:
        return check.judge(result, None if reference is None else like(reference, result))
    except MisfitError as error:
        return SignalVerdict(result.name, False, str(error), "units", result.unit)


def completed(case: Case) -> Case:
    """The case with the experiment that its reference brings along, where it says nothing itself."""
    kind = "" if case.reference is None else case.reference.kind
    if kind == "own":
        return with_own_experiment(case)
    if kind == "measurement":
        # What estimates noise takes most of a second to import.
        from orchestrator.regress.measured import with_measured_inputs

        return with_measured_inputs(case)
    return case


def expected_of(case: Case, system: System, progress: Watched | None) -> Expected | None:
    """The reference of a case, from wherever it comes.

    Args:
        case: the case.
        system: what it runs.
        progress: where it is noted what runs.

    Returns:
        None for a case without a reference.

    Raises:
        MisfitError: if it cannot be had.
    """
    reference = case.reference
    if reference is None:
        return None
    if reference.kind == "file":
        return _computed(_with_units(expected_from_file(case, reference), case), case)
    if reference.kind == "own":
        return expected_of_fmu(_only_fmu(system))
    if reference.kind == "measurement":
        from orchestrator.regress.measured import expected_from_measurement

        return expected_from_measurement(case, reference)
    other = system_of(case, reference.source)
    wanted, _ = wanted_signals(other, variables_for(tuple(case.signals), case.formulas))
    return _computed(Expected(record(other, wanted, progress).signals, f"{reference.source}, run beside"), case)


def _with_units(expected: Expected, case: Case) -> Expected:
    """The signals of a file that says no units, in those that are kept beside it."""
    kept = (read_interface(case.reference_file) if case.reference_file else None) or {}
    signals = {
        name: replace(signal, unit=signal.unit or str(kept.get(name, {}).get("unit") or ""))
        for name, signal in expected.signals.items()
    }
    return replace(expected, signals=signals)


def _computed(expected: Expected, case: Case) -> Expected:
    """What is expected, with the formulas of the case where the reference has their variables and not themselves."""
    missing = [name for name in case.formulas if name not in expected.signals]
    return replace(expected, signals={**expected.signals, **with_formulas(missing, case.formulas, expected.signals)})


def _lacks_reference(case: Case) -> bool:
    """Whether the reference is to be a file that does not exist yet."""
    reference = case.reference
    return reference is None or (reference.kind == "file" and not (case.folder / reference.source).exists())


def _only_fmu(system: System) -> Path:
    fmus = [spec for spec in system.components.values() if spec.kind == "fmu"]
    if len(fmus) != 1:
        raise MisfitError(f"reference = own: {system.name!r} has {len(fmus)} FMUs; expected a model of one FMU")
    return system.folder / fmus[0].source


def _wholes(compared: Compared, progress: Watched) -> tuple[tuple[WholeVerdict, ...], tuple[str, ...]]:
    """Verdicts on the model as a whole, and notes on what could not be judged."""
    found, notes = _interface(compared)
    if not compared.case.checks:
        return found, notes
    from orchestrator.regress.whole_checks import judge_whole

    judged = (
        judge_whole(name, compared.case, compared.system, settings, progress)
        for name, settings in compared.case.checks.items()
    )
    return (*found, *judged), notes


def _interface(compared: Compared) -> tuple[tuple[WholeVerdict, ...], tuple[str, ...]]:
    """Whether units, types and start values are those that are kept beside the reference."""
    file = compared.case.reference_file
    if file is None or not file.is_file():
        return (), ()
    before = read_interface(file)
    if before is None:
        return (), (
            f"units, types and start values are not compared: {path_beside(file).name} is not there; --update writes it",
        )
    return (judge_interface(before, interface_of(compared.system), compared.case.allowed),), ()


def _digest(recording: Recording) -> str:
    parts = recording.provenance.get("components", {})
    digests = [str(part["sha256"]) for part in parts.values() if "sha256" in part]
    return digests[0] if len(digests) == 1 else ""
