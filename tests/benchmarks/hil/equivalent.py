"""Mutants that the tests cannot tell from the safety core, and why nobody could."""

EQUIVALENT: dict[str, str] = {}
