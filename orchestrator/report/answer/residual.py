"""Where it failed: the residual of the worst held-out trial, as given and with the effects, from the JSON document."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Residual:
    """Residuals (n,) of one signal along one trial, in `unit`; `after` is None where nothing is added."""

    trial: str
    signal: str
    unit: str
    time: np.ndarray
    before: np.ndarray
    after: np.ndarray | None
    noise: float


def worst_residual(document: Mapping[str, Any]) -> Residual | None:
    """The signal and held-out trial with the largest error as given, as a multiple of its noise; None without curves."""
    best: tuple[float, Residual] | None = None
    for curve in document.get("curves") or ():
        time = np.asarray(curve["time_s"], dtype=float)
        for name, found in curve["signals"].items():
            measured = np.asarray(found["measured"], dtype=float)
            before = np.asarray(found["before"], dtype=float) - measured
            after = np.asarray(found["after"], dtype=float) - measured
            noise = float(found["noise_floor"])
            size = float(np.sqrt(np.mean(before**2))) / noise if noise > 0 else float("inf")
            if not np.isfinite(before).all() or (best is not None and size <= best[0]):
                continue
            changed = np.isfinite(after).all() and not np.array_equal(before, after)
            best = (
                size,
                Residual(curve["file"], name, str(found["unit"]), time, before, after if changed else None, noise),
            )
    return None if best is None else best[1]
