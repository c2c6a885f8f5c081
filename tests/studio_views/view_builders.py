"""Comparisons for tests of the views, small and made of closed forms."""

from collections.abc import Sequence

import numpy as np

from orchestrator.compare.result import Comparison, SetErrors, TrialCurves
from orchestrator.compare.where import where_it_fails
from orchestrator.ledger import LedgerEntry

UNITS = {"q1": "rad", "q2": "rad"}
FLOOR = {"q1": 0.01, "q2": 0.02}
STEP = 0.01


def trial(place: int, samples: int, subset: str = "learning") -> TrialCurves:
    """A trial whose residual of q1 is 0.1 against the motion, and of q2 a tone of 0.05 at 2 Hz that begins halfway."""
    random = np.random.default_rng(place)
    time = STEP * np.arange(samples)
    modelled = {"q1": np.sin(time + place), "q2": np.cos(0.7 * time)}
    late = time > 0.5 * time[-1]
    residual = {"q1": -0.1 * np.sign(np.cos(time + place)), "q2": 0.05 * np.sin(4 * np.pi * time) * late}
    measured = {name: modelled[name] + residual[name] + 0.01 * random.standard_normal(samples) for name in UNITS}
    return TrialCurves(f"trial_{place}.csv", subset, time, measured, modelled, {"u1": np.abs(np.sin(0.3 * time))})


def comparison(curves: Sequence[TrialCurves], *, where: bool = False) -> Comparison:
    """A comparison that holds these curves; what `where` asks for takes a second."""
    nothing = SetErrors(dict.fromkeys(UNITS, 1.0), 1.0)
    found = where_it_fails([c for c in curves if c.set == "learning"], UNITS, FLOOR) if where else {}
    return Comparison("model", "data", tuple(UNITS), UNITS, FLOOR, (), nothing, None, found, curves=tuple(curves))


def version(number: int, held_out: float | None, **changes: object) -> LedgerEntry:
    """A ledger entry with an error on learning trials of twice that on held-out trials, or of 5."""
    learning = SetErrors({"q1": 0.02}, 5.0 if held_out is None else 2 * held_out)
    found = None if held_out is None else SetErrors({"q1": 0.01 * held_out}, held_out)
    values = dict(
        version=number, name=f"Arm_{number}", model="m", effects=(), learning=learning, held_out=found, noise_floor=FLOOR,
        units=UNITS, model_hash="", data_hash="", date="", misfit_version="",
    )  # fmt: skip
    return LedgerEntry(**{**values, **changes})  # type: ignore[arg-type]
