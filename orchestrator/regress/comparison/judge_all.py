"""Every check of every signal of one run."""

from collections.abc import Mapping, Sequence

from orchestrator.regress.comparison.signal import Check, Signal, SignalVerdict


def judge_all(
    checks: Mapping[str, Sequence[Check]],
    results: Mapping[str, Signal],
    references: Mapping[str, Signal],
    exhaustive: bool = False,
) -> tuple[SignalVerdict, ...]:
    """Return one verdict for each check; a variable that is missing on either side is a failed one.

    Args:
        checks: by variable.
        results: what the run recorded.
        references: what it is compared with.
        exhaustive: whether a variable that only one side has, and that no check names, is a failure, too.
    """
    if not checks and not exhaustive:
        return (SignalVerdict("", False, "no signal is compared; name some under [signals]", "none"),)
    verdicts = [_judge(name, check, results, references) for name, several in checks.items() for check in several]
    if exhaustive:
        verdicts += [_unmatched(name, "result", "reference") for name in results if _extra(name, references, checks)]
        verdicts += [_unmatched(name, "reference", "result") for name in references if _extra(name, results, checks)]
    return tuple(verdicts)


def _judge(name: str, check: Check, results: Mapping[str, Signal], references: Mapping[str, Signal]) -> SignalVerdict:
    if name not in results:
        near = ", ".join(sorted(results)[:8]) or "nothing"
        reason = f"the result has no variable {name}; it has {near}{' ...' if len(results) > 8 else ''}"
        return SignalVerdict(name, False, reason, _kind(check))
    if check.needs_reference and name not in references:
        near = ", ".join(sorted(references)[:8]) or "nothing"
        reason = f"the reference has no variable {name}; it has {near}{' ...' if len(references) > 8 else ''}"
        return SignalVerdict(name, False, reason, _kind(check))
    return check.judge(results[name], references.get(name))


def _extra(name: str, others: Mapping[str, Signal], checks: Mapping[str, Sequence[Check]]) -> bool:
    return name not in others and name not in checks


def _unmatched(name: str, has: str, lacks: str) -> SignalVerdict:
    reason = f"the {has} has the variable {name}, the {lacks} has not; update the reference if that is meant"
    return SignalVerdict(name, False, reason, "interface")


def _kind(check: Check) -> str:
    return str(getattr(check, "kind", type(check).__name__))
