"""Mutants that the tests cannot tell from the safety core, and why nobody could: part of what is printed of them, and a reason."""

EQUIVALENT: dict[str, str] = {
    "motion.py:36: 0.0 + 1": "the rate counts with the time that has passed, and here none has",
}
