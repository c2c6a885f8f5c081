"""Checks of a whole model beside its trajectories: each module has `judge(case, system, settings, progress)`."""
