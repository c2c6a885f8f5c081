"""The verdict and its figures, as pure functions."""

from collections.abc import Sequence

from orchestrator.diagnosis.result import Verdict

# A named set either removes most of the reducible error or ends near the floor.
MOST = 0.7
NEAR = 2.0


def reducible_removed(before: float, after: float) -> float:
    """Share of the error above the floor that is gone; errors are multiples of the floor.

    >>> reducible_removed(11.0, 2.0)
    0.9
    """
    return (before - after) / max(before - 1.0, 1e-9)


def decide(
    before: float, after: float, named: int, *, structured: bool, ambiguous: bool = False, blind: Sequence[str] = ()
) -> Verdict:
    """Decide on a verdict.

    Args:
        before, after: held-out errors as multiples of the floor, without and with the accepted effects.
        named: number of effects accepted.
        structured: whether more than noise is left after them.
        ambiguous: whether others explain the data as well as the accepted ones.
        blind: sites at which the data show no effect, were there one.

    >>> decide(1.1, 1.1, 0, structured=False), decide(16.0, 1.1, 1, structured=False)
    ('adequate', 'named')
    >>> decide(25.0, 20.0, 1, structured=True), decide(25.0, 25.0, 0, structured=True)
    ('unknown', 'unknown')
    """
    if named == 0:
        if structured:
            return "unknown"
        return "cannot_tell" if blind else "adequate"
    if structured and after > NEAR and reducible_removed(before, after) < MOST:
        return "unknown"
    return "ambiguous" if ambiguous else "named"
