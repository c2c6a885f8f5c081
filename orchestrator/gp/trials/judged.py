"""Whether a block earns its place: free runs along held-out trials, with it and without it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fmus.errors import ComponentError
from orchestrator.gp.block import Block
from orchestrator.gp.trials.beside import ModelBeside
from orchestrator.measurements import BoundTrial
from orchestrator.models.contract import FittedTrial
from orchestrator.models.symbolic import SymbolicModel

Array = NDArray[np.float64]
Run = Callable[[BoundTrial], FittedTrial]
# A block must take off so much of the error of all held-out trials together, more than a change of start values could.
LEAST_GAIN = 0.05
# No trial and no signal may lose more than this share of its error, nor more than this share of its noise.
MOST_LOSS, OF_NOISE = 0.02, 0.1
# An error within this many times the noise is that of a model that lacks nothing.
NOTHING_LACKS = 1.2
SHARES = (1.0, 0.5, 0.25)


@dataclass(frozen=True)
class Errors:
    """RMS of free runs, by trial and signal, in the signals' units, and the first states that they began from."""

    trials: Mapping[str, Mapping[str, float]]
    starts: Mapping[str, Mapping[str, float]]

    @property
    def signals(self) -> dict[str, float]:
        """RMS of each signal over all trials."""
        rows = list(self.trials.values())
        return {name: float(np.sqrt(np.mean([row[name] ** 2 for row in rows]))) for name in rows[0]}

    @property
    def all(self) -> float:
        """RMS over all signals and trials."""
        return float(np.sqrt(np.mean(np.square(list(self.signals.values())))))

    def finite(self) -> float | None:
        """The same; None where a run left the finite numbers."""
        return self.all if np.isfinite(self.all) else None


@dataclass(frozen=True)
class Judgement:
    """What became of a block: `shares` of its outputs that are used, and free-run errors without it and with these shares.

    `refused` are those of the block as it was learned, where it was not used as such; `reason` says in words what was
    decided and why.
    """

    verdict: Literal["kept", "shrunk", "refused"]
    reason: str
    shares: Mapping[str, float]
    before: Errors
    after: Errors
    refused: Errors | None = None


def judge(
    model: SymbolicModel,
    block: Block | None,
    trials: Sequence[BoundTrial],
    noise: Array,
    learning: Sequence[BoundTrial] = (),
) -> Judgement:
    """Judge a block by free runs along trials that it has not seen, against the model without it.

    If it does not win as a whole, outputs alone and smaller shares of all are tried, and the best that wins is used. What
    wins along two trials may do so by chance: it must win along the learning trials, too.

    Args:
        block: None if the data need no function.
        learning: trials that the block was learned from.
        noise: (signals,) standard deviation of the measurements.
    """
    alone = free_run_errors(model, None, trials, noise)
    if block is None:
        return Judgement("refused", "the learning trials need none of the functions", {}, alone, alone)
    if all(alone.signals[name] < NOTHING_LACKS * s for name, s in zip(model.signals, noise, strict=True)):
        return Judgement(
            "refused", "the model alone follows the held-out trials to within their noise", {}, alone, alone
        )
    beside, level = ModelBeside(model, block), dict(zip(model.signals, map(float, noise), strict=True))
    all_of_it, *others = _ways([output.name for output in block.outputs])
    whole = _errors(trials, model.signals, lambda t: beside.along(t, all_of_it, noise))
    alone_learning = free_run_errors(model, None, learning, noise) if learning else None

    def confirmed(shares: Mapping[str, float]) -> bool:
        if alone_learning is None:
            return True
        return _winner(alone_learning, learning, level, lambda t: beside.along(t, shares, noise)) is not None

    if _wins(alone, whole, level) and confirmed(all_of_it):
        return Judgement("kept", "free runs along the held-out trials are closer with it", all_of_it, alone, whole)
    winners = []
    for shares in others:
        found = _winner(alone, trials, level, lambda t, use=shares: beside.along(t, use, noise))  # type: ignore[misc]
        winners += [] if found is None else [(shares, found)]
    winner = next((run for run in sorted(winners, key=lambda run: run[1].all) if confirmed(run[0])), None)
    if winner is None:
        chance = bool(winners) or _wins(alone, whole, level)
        why = (
            "what helps along the held-out trials does not along the learning trials" if chance else _why(alone, whole)
        )
        return Judgement("refused", why, {}, alone, alone, whole)
    shares, best = winner
    used = ", ".join(f"{share:g} of {name}" for name, share in shares.items())
    return Judgement("shrunk", f"{_why(alone, whole)}; {used} helps", shares, alone, best, whole)


def free_run_errors(model: SymbolicModel, block: Block | None, trials: Sequence[BoundTrial], noise: Array) -> Errors:
    """Errors of free runs along trials, from estimated first states: of a model alone (None), or with a block beside it.

    Args:
        noise: (signals,) standard deviation of the measurements.
    """
    if block is None:
        return _errors(trials, model.signals, lambda t: model.follow(t.time, t.inputs, t.outputs, model.signals, noise))
    beside, whole = ModelBeside(model, block), dict.fromkeys((output.name for output in block.outputs), 1.0)
    return _errors(trials, model.signals, lambda t: beside.along(t, whole, noise))


def _ways(names: Sequence[str]) -> list[dict[str, float]]:
    """Shares to try: all of the block, outputs alone, smaller shares of all."""
    whole = [dict.fromkeys(names, share) for share in SHARES]
    alone = [{name: share} for share in SHARES[:2] for name in names] if len(names) > 1 else []
    return [whole[0], *alone, *whole[1:]]


def _wins(alone: Errors, found: Errors, noise: Mapping[str, float]) -> bool:
    """Whether errors fall in all, and rise noticeably in no trial and no signal."""
    if not found.all < (1.0 - LEAST_GAIN) * alone.all:
        return False
    least = min(noise.values())
    pairs = [(alone.signals[name], found.signals[name], noise[name]) for name in noise]
    for name, row in alone.trials.items():
        pairs.append((_rms(row), _rms(found.trials[name]), least))
    return all(after <= _allowed(before, sigma) for before, after, sigma in pairs)


def _winner(alone: Errors, trials: Sequence[BoundTrial], noise: Mapping[str, float], run: Run) -> Errors | None:
    """Errors of a way that wins; None as soon as a trial loses."""
    found = Errors({}, {})
    for trial in trials:
        one = _errors([trial], list(noise), run)
        found = Errors({**found.trials, **one.trials}, {**found.starts, **one.starts})
        lost = _rms(found.trials[trial.name]) > _allowed(_rms(alone.trials[trial.name]), min(noise.values()))
        if lost:
            return None
    return found if _wins(alone, found, noise) else None


def _allowed(before: float, noise: float) -> float:
    return (1.0 + MOST_LOSS) * before + OF_NOISE * noise


def _why(alone: Errors, found: Errors) -> str:
    worst = max(alone.trials, key=lambda name: _rms(found.trials[name]) / max(_rms(alone.trials[name]), 1e-300))
    before, after = _rms(alone.trials[worst]), _rms(found.trials[worst])
    if after > before:
        return f"the whole block makes free runs worse, in {worst} from {before:.3g} to {after:.3g}"
    return f"the whole block changes the free-run error from {alone.all:.3g} to {found.all:.3g} only"


def _rms(row: Mapping[str, float]) -> float:
    return float(np.sqrt(np.mean(np.square(list(row.values())))))


def _errors(trials: Sequence[BoundTrial], signals: Sequence[str], run: Run) -> Errors:
    found, starts = {}, {}
    for trial in trials:
        try:
            followed = run(trial)
            left = np.sqrt(np.mean((followed.outputs - trial.outputs) ** 2, axis=0))
            starts[trial.name] = followed.start
        except ComponentError:  # the run left the finite numbers
            left = np.full(len(signals), np.inf)
        found[trial.name] = dict(zip(signals, map(float, left), strict=True))
    return Errors(found, starts)
