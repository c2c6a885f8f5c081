"""What a law is in words: each term by its kin in the library, with the values that say where, when and how fast."""

import re
from collections.abc import Mapping, Sequence

from orchestrator.greybox.laws import Law
from orchestrator.laws.terms import Term
from orchestrator.laws.vocabulary import Factor
from orchestrator.verdicts.result import Estimate


def sentence_of(terms: Sequence[Term], law: Law, values: Mapping[str, Estimate], variables: Mapping[str, str]) -> str:
    """Such as `dry friction that fades with a time constant of 3 s, and viscous friction`.

    Args:
        terms: the terms of the law.
        law: the law.
        values: its values by name.
        variables: the model's variable for each coordinate of the law.
    """
    parts = []
    for number, term in enumerate(terms, start=1):
        end = str(number) if len(terms) > 1 else ""
        words = " ".join(_filled(f, term, end, values, variables) for f in term.factors)
        parts.append(f"{words} (pushing, not braking)" if _pushes(term, values[f"k{end}"].value) else words)
    return ", and ".join(dict.fromkeys(parts))


def _filled(factor: Factor, term: Term, end: str, values: Mapping[str, Estimate], variables: Mapping[str, str]) -> str:
    def value(match: re.Match[str]) -> str:
        if match[1] == "of":
            return variables.get(term.of, term.of)
        found = values.get(match[1] + end) or values[match[1]]  # without a number if several terms share it
        return f"{found.value:.3g} {found.unit if found.unit != '1' else ''}".strip()

    return re.sub(r"\{(\w+)\}", value, factor.words)


def _pushes(term: Term, gain: float) -> bool:
    """Whether what usually brakes or holds back does the opposite."""
    return gain < 0 and bool(term.library) and term.library != "constant_force"
