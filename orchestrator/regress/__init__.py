"""Regression tests of FMUs and systems: what to run, what to compare, and whether the behaviour changed."""
