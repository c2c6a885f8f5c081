"""The one place that decides which torques reach a robot.

`core.step` is a pure function of limits, state and what a cycle shows: no clock, no bus, no randomness. The same code runs
live, in a dry run and in replay.
"""
