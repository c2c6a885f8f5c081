"""Small made-up results: an arm that lacks joint friction, on six trials of two joint angles."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from orchestrator.compare.result import Comparison, SetErrors, TrialCurves, TrialErrors
from orchestrator.compare.where import findings, where_it_fails
from orchestrator.ledger import LedgerEntry
from orchestrator.verdicts.result import Diagnosis, Estimate, HeldOut, NamedEffect, RankedSet, Step, Verdict

FLOOR = 0.001
COULOMB = NamedEffect("coulomb_friction", "joint1", {"tauC[1]": Estimate(0.0373, "N.m", (0.0361, 0.0385))})
PAYLOAD = NamedEffect("payload", "wrist", {"m": Estimate(0.213, "kg", (0.198, 0.228))})


@contextmanager
def blank() -> Iterator[None]:
    """Figures are made and not drawn."""
    from matplotlib.figure import Figure

    def save(figure: Figure, stream: Any, **_: object) -> None:
        stream.write(b"blank")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", save)
        yield


def trial(index: int, held_out: bool, signals: Sequence[str], error: float, n: int, amplitude: float) -> TrialCurves:
    """Swings measured with noise of one floor; the model is off by `error` (rad) against the motion."""
    random = np.random.default_rng(index)
    time = np.arange(n) / 250.0
    measured, modelled = {}, {}
    for place, name in enumerate(signals):
        true = amplitude * np.sin(2 * np.pi * (0.4 + 0.1 * place) * time + index)
        miss = error * np.sqrt(2) * np.tanh(np.gradient(true, time)) if amplitude else np.full(n, error)
        measured[name] = true + FLOOR * random.standard_normal(n) * (amplitude > 0)
        modelled[name] = true + miss
    return TrialCurves(f"trial_{index:02}.csv", "held_out" if held_out else "learning", time, measured, modelled)


def comparison(
    error: float = 0.04,
    *,
    signals: Sequence[str] = ("q1", "q2"),
    n_learning: int = 4,
    n_held_out: int = 2,
    n: int = 500,
    amplitude: float = 0.5,
    model: str = "arm",
) -> Comparison:
    """A comparison whose model is off by about `error` rad; without `amplitude` every signal is constant."""
    curves = tuple(trial(i + 1, i >= n_learning, signals, error, n, amplitude) for i in range(n_learning + n_held_out))
    units, floor = dict.fromkeys(signals, "rad"), dict.fromkeys(signals, FLOOR)
    held_out = [curve for curve in curves if curve.set == "held_out"]
    where = where_it_fails(curves[:n_learning], units, floor)
    return Comparison(
        model=model,
        data="measurements/swings",
        signals=tuple(signals),
        units=units,
        noise_floor=floor,
        trials=tuple(_trial_errors(curve) for curve in curves),
        learning=_set_errors(curves[:n_learning]),
        held_out=_set_errors(held_out) if held_out else None,
        where=where,
        findings=findings(where, floor),
        notes=("no split was given: the last third of the trials is held out",),
        curves=curves,
    )


def diagnosis(verdict: Verdict = "named", *, n_held_out: int = 2, n: int = 500) -> Diagnosis:
    """A diagnosis that adds friction, then a payload."""
    sets: tuple[tuple[NamedEffect, ...], ...] = ((), (COULOMB,), (COULOMB, PAYLOAD))
    found = [comparison(error, n=n, n_held_out=n_held_out) for error in (0.04, 0.006, 0.0)]
    steps = tuple(Step(effects, result) for effects, result in zip(sets, found, strict=True))
    before, after = ({} if c.held_out is None else c.held_out.rmse for c in (found[0], found[-1]))
    return Diagnosis(
        model="arm",
        data="measurements/swings",
        verdict=verdict,
        effects=sets[-1] if verdict in ("named", "ambiguous") else (),
        confusable=(("coulomb_friction", "viscous_friction"),) if verdict == "ambiguous" else (),
        ranking=tuple(_ranking()),
        p_value=0.004,
        noise_floor=found[0].noise_floor,
        held_out=HeldOut(before, after, found[0].noise_floor, 0.974 if before else float("nan")),
        warnings=("tauC[1] was pinned by 12 reversals only",),
        next_experiment={"experiment": "reverse each joint slowly", "separates": ["coulomb_friction", "payload"]},
        patched_model=None,
        seconds=12.3,
        steps=steps,
    )


def entries(result: Diagnosis) -> list[LedgerEntry]:
    """The ledger that `misfit discover` would write for a diagnosis."""
    return [
        LedgerEntry(
            version=version,
            name="arm" if version == 0 else f"Arm_{version}",
            model=step.comparison.model,
            effects=step.effects,
            learning=step.comparison.learning,
            held_out=step.comparison.held_out,
            noise_floor=step.comparison.noise_floor,
            units=step.comparison.units,
            model_hash=f"{version}" * 64,
            data_hash="d" * 64,
            date="2025-01-02T03:04:05Z",
            misfit_version="0.1.0",
        )
        for version, step in enumerate(result.steps)
    ]


def _ranking() -> list[RankedSet]:
    first = RankedSet(("coulomb_friction", "payload"), ("joint1", "wrist"), 0.974, 0.93)
    second = RankedSet(("coulomb_friction",), ("joint1",), 0.851, 0.06)
    others = [RankedSet(("muscle_weakness",), (f"muscle{i}",), 0.4 - 0.05 * i, 0.001) for i in range(1, 11)]
    return [first, second, *others]


def _rmse(curves: Sequence[TrialCurves], name: str) -> float:
    residual = np.concatenate([curve.measured[name] - curve.modelled[name] for curve in curves])
    return float(np.sqrt(np.mean(residual**2)))


def _trial_errors(curve: TrialCurves) -> TrialErrors:
    rmse = {name: _rmse([curve], name) for name in curve.measured}
    spread = {name: float(np.std(values)) for name, values in curve.measured.items()}
    fit = {name: 100 * (1 - rmse[name] / spread[name]) if spread[name] else 0.0 for name in rmse}
    return TrialErrors(curve.file, curve.set, rmse, fit)


def _set_errors(curves: Sequence[TrialCurves]) -> SetErrors:
    rmse = {name: _rmse(curves, name) for name in curves[0].measured}
    return SetErrors(rmse, float(np.sqrt(np.mean([(value / FLOOR) ** 2 for value in rmse.values()]))))
