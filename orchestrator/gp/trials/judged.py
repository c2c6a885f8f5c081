"""Whether a block earns its place: free runs along held-out trials, with it and without it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from fmus.errors import ComponentError
from orchestrator.gp.block import Block
from orchestrator.gp.trials.beside import ModelBeside
from orchestrator.measurements import BoundTrial
from orchestrator.models.contract import FittedTrial
from orchestrator.models.symbolic import SymbolicModel

Array = NDArray[np.float64]
Run = Callable[[BoundTrial], FittedTrial]
# A block that was made without some learning trials, and these trials.
Fold = tuple[Block, Sequence[BoundTrial]]
# A block must take off so much of the error of all held-out trials together, more than a change of start values could.
LEAST_GAIN = 0.05
# No trial and no signal may lose more than this share of its error, nor more than this share of its noise.
MOST_LOSS, OF_NOISE = 0.02, 0.1
# An error within this many times the noise is that of a model that lacks nothing.
NOTHING_LACKS = 1.2
# Of a further trial it must be said at this level that it does not lose, from so many trials that no block has seen, at least.
LEVEL, ENOUGH_TRIALS = 0.95, 4
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
    folds: Sequence[Fold] = (),
) -> Judgement:
    """Judge a block by free runs along trials that it has not seen, against the model without it.

    If it does not win as a whole, outputs alone and smaller shares of all are tried, and the best that wins is used. What
    wins along two trials may do so by chance: blocks that are made alike, without some of the learning trials, must win
    along those, too (cross-validation).

    Args:
        block: None if the data need no function.
        noise: (signals,) standard deviation of the measurements.
        folds: blocks of the same functions that lack some learning trials each, with the trials that they lack.
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
    confirmed = _confirmation(model, folds, noise, alone)

    why = confirmed(all_of_it, whole) if _wins(alone, whole, level) else _why(alone, whole)
    if not why:
        return Judgement("kept", "free runs along the held-out trials are closer with it", all_of_it, alone, whole)
    winners = []
    for shares in others:
        found, lost = _winner(alone, [(trials, lambda t, use=shares: beside.along(t, use, noise))], level)  # type: ignore[misc]
        winners += [] if lost else [(shares, found)]
    for shares, best in sorted(winners, key=lambda run: run[1].all):
        if not confirmed(shares, best):
            used = ", ".join(f"{share:g} of {name}" for name, share in shares.items())
            return Judgement("shrunk", f"{why}; {used} helps", shares, alone, best, whole)
    return Judgement("refused", why, {}, alone, alone, whole)


def _confirmation(
    model: SymbolicModel, folds: Sequence[Fold], noise: Array, alone: Errors
) -> Callable[[Mapping[str, float], Errors], str]:
    """Why shares that won along the held-out trials may lose along others, "" if they also win along learning trials, by
    blocks that lack those, and a further trial will not lose by all that is known; blocks are built when first asked for.

    Args:
        alone: errors along the held-out trials without a block.
    """
    level = dict(zip(model.signals, map(float, noise), strict=True))

    @cache
    def without() -> Errors:
        return free_run_errors(model, None, [trial for _, trials in folds for trial in trials], noise)

    @cache
    def beside(number: int) -> ModelBeside:
        return ModelBeside(model, folds[number][0])

    def confirmed(shares: Mapping[str, float], held_out: Errors) -> str:
        parts = [
            (trials, lambda t, k=k: beside(k).along(t, shares, noise))  # type: ignore[misc]
            for k, (_, trials) in enumerate(folds)
        ]
        if not folds:
            return ""
        gain = f"what takes the error of the held-out trials from {alone.all:.3g} to {held_out.all:.3g} may not help along others: "
        found, lost = _winner(without(), parts, level)
        if lost:
            return f"{gain}of learning trials, blocks that have not seen them take it {lost}"
        pairs = (alone, held_out), (without(), found)
        return "" if will_not_lose(*pairs, noise=level) else f"{gain}its gains differ too much from trial to trial"

    return confirmed


def will_not_lose(*pairs: tuple[Errors, Errors], noise: Mapping[str, float]) -> bool:
    """Whether a further trial does not lose, at `LEVEL`, if ratios of errors are normal over trials.

    The prediction limit for one more of n values is mean + t sd sqrt(1 + 1/n) (Student's t with n - 1 degrees of freedom). Ratios
    and not their logarithms: of 0.002 and 0.1 both are gains, and their difference is no reason to expect a loss.
    """
    least = min(noise.values())
    ratios = [
        max(_rms(after.trials[name]), least) / max(_rms(row), least)
        for before, after in pairs
        for name, row in before.trials.items()
    ]
    n = len(ratios)
    if n < ENOUGH_TRIALS:
        return True
    limit = np.mean(ratios) + scipy.stats.t.ppf(LEVEL, n - 1) * np.std(ratios, ddof=1) * np.sqrt(1.0 + 1.0 / n)
    return bool(limit < 1.0 + MOST_LOSS)


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


def _winner(
    alone: Errors, parts: Sequence[tuple[Sequence[BoundTrial], Run]], noise: Mapping[str, float]
) -> tuple[Errors, str]:
    """Errors of a way along all trials, each run by its part's, and where it loses, "" if it wins; the first trial that loses ends it."""
    found = Errors({}, {})
    for trial, run in ((trial, run) for trials, run in parts for trial in trials):
        one = _errors([trial], list(noise), run)
        found = Errors({**found.trials, **one.trials}, {**found.starts, **one.starts})
        before, after = _rms(alone.trials[trial.name]), _rms(found.trials[trial.name])
        if after > _allowed(before, min(noise.values())):
            return found, f"from {before:.3g} to {after:.3g} in {trial.name}"
    return found, "" if _wins(alone, found, noise) else f"from {alone.all:.3g} to {found.all:.3g} in all"


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
