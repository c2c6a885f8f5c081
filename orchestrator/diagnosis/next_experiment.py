"""The next experiment: the one of the menu that best separates the explanations that remain.

For two explanations i and j the separation is the mean square of y_i - y_j in the metric, where noise is white with unit
variance, after j has been refitted to what i predicts, so that only what refitting cannot imitate counts (T-optimality:
Atkinson and Fedorov 1975; Hunter and Reiner 1965). Over N rows the log-likelihood ratio then has mean N separation/2, and
the right one is preferred with the probability Phi(sqrt(N separation)/2). The noise of the inputs is taken to be carried to
the outputs as in the first trial.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.stats import norm

from fmus.errors import MisfitError
from orchestrator.diagnosis.evidence import LearningData
from orchestrator.diagnosis.excitation import driven, is_at_rest
from orchestrator.diagnosis.menu import OUT_OF_REST, OUT_OF_REST_ELSE, Experiment, menu
from orchestrator.diagnosis.metric import Metric
from orchestrator.models.correction import PREFIX
from orchestrator.models.estimation import Record, fit
from orchestrator.models.symbolic import SymbolicModel

# Explanations compared, and experiments for which they are refitted to each other.
MOST_MEMBERS = 5
REFITTED = 3
# Outputs may leave the range seen so far by this share of it.
BEYOND = 0.5
# Below this probability an experiment is no better than tossing a coin.
HOPELESS = 0.6
INSEPARABLE = "no experiment of the menu separates these, they act alike on what is measured; add another sensor"
# A separation below this is the rounding of a fit.
NOTHING = 1e-9


@dataclass(frozen=True)
class Explanation:
    """A model with values of its free parameters, their bounds, and start values of the states (nx,)."""

    label: str
    model: SymbolicModel
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray


@dataclass(frozen=True)
class Plan:
    """The experiment to do next, and what is expected of it.

    `separation` and `probability` are those of the pair that is told apart worst, without those (`alike`) that nothing
    separates; `repeat` the same for a repetition of the first trial. `considered` lists every experiment of the menu with its separation before refitting.
    """

    experiment: Experiment
    members: tuple[str, ...]
    separation: float
    probability: float
    repeat: tuple[float, float]
    considered: tuple[tuple[str, float], ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    alike: tuple[tuple[str, str], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return it as plain values; the inputs themselves are in `csv`."""
        return {
            "effects": list(self.members),
            "do": self._do,
            "experiment": self.experiment.name,
            "duration_s": float(self.experiment.time[-1] - self.experiment.time[0]),
            "start_scale": self.experiment.start_scale,
            "start_offset": self.experiment.start_offset,
            "inputs": {
                name: {"unit": unit, "from": float(column.min()), "to": float(column.max())}
                for name, unit, column in zip(self.names, self.units, self.experiment.inputs.T, strict=True)
                if np.ptp(column) > 0
            },
            "separation": self.separation,
            "probability_to_separate": self.probability,
            "expected_gain": self.separation / max(self.repeat[0], NOTHING) if self.separation > NOTHING else 1.0,
            "repeat": {"separation": self.repeat[0], "probability_to_separate": self.repeat[1]},
            "considered": [{"experiment": name, "separation": value} for name, value in self.considered],
        }

    @property
    def _do(self) -> str:
        if self.probability < HOPELESS:
            return INSEPARABLE
        kept = "; ".join(
            f"{one} and {other} act alike in all of the menu and stay one class" for one, other in self.alike
        )
        return f"{self.experiment.do}; {kept}" if kept else self.experiment.do

    def csv(self) -> str:
        """The inputs as a table to play: time and one column for each input."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["time", *self.names])
        for t, row in zip(self.experiment.time, self.experiment.inputs, strict=True):
            writer.writerow([f"{value:.9g}" for value in (t, *row)])
        return stream.getvalue()


def plan(explanations: Sequence[Explanation], learning: LearningData, scale: float = 1.0) -> Plan | None:
    """Choose the experiment that tells the explanations apart; the noise has the power `scale` in the metric.

    Experiments in which some explanation leaves the range of the recorded outputs by more than half of it, or cannot be
    simulated, are left out.

    Returns:
        None for fewer than two explanations, or if no experiment can be simulated.
    """
    members = list(explanations[:MOST_MEMBERS])
    if len(members) < 2:
        return None
    variables, resting = members[0].model.inputs, is_at_rest(learning)
    commands = [i for i, v in enumerate(variables) if not v.name.startswith(PREFIX)]
    amplitudes = {}
    if commands and not driven(learning.trials)[commands].any():
        amplitudes = {i: a for i in commands if (a := _amplitude(members[0], i, learning)) > 0}
    unit = members[0].model.outputs[0].unit if resting else None
    choices = menu(variables, learning.trials, amplitudes, unit)
    rough = {}
    for k, experiment in enumerate(choices):
        runs = _predictions(members, experiment, learning, limited=k > 0)
        if runs is not None:
            rough[k] = min(_distance(a, b, learning) for a, b in combinations(runs, 2))
    shortlist = sorted((k for k in rough if k), key=lambda k: -rough[k])[:REFITTED]
    pairs = {k: _refitted(members, choices[k], learning) for k in (0, *shortlist) if k in rough}
    if not pairs:
        return None
    separable = np.max(list(pairs.values()), axis=0) > NOTHING
    scores = {k: float(each[separable].min(initial=np.inf)) if separable.any() else 0.0 for k, each in pairs.items()}
    alike = [pair for pair, seen in zip(combinations(members, 2), separable, strict=True) if not seen]
    best = max(scores, key=lambda k: scores[k])
    repeat = scores.get(0, 0.0)
    return Plan(
        experiment=choices[best],
        members=tuple(m.label for m in members),
        separation=scores[best],
        probability=_probability(scores[best] / scale, choices[best], learning),
        repeat=(repeat, _probability(repeat / scale, choices[0], learning)),
        considered=tuple((choices[k].name, value) for k, value in rough.items()),
        names=tuple(v.name for v in members[0].model.inputs),
        units=tuple(v.unit for v in members[0].model.inputs),
        alike=tuple((one.label, other.label) for one, other in alike) if separable.any() else (),
    )


def _start(member: Explanation, experiment: Experiment, learning: LearningData) -> np.ndarray:
    """Start of a run: as in the first trial; at rest and moved from the middle for a model that nothing drives."""
    if experiment.start_scale == 1.0 and experiment.name == "repeat":
        return member.start
    start = member.start.copy()
    residual = member.model.residual
    if residual is None:
        return start
    names = [v.name for v in member.model.system.states]
    for signal, position in residual.positions.items():
        m = member.model.signals.index(signal)
        middle = float(np.mean(np.concatenate([t.values[:, m] for t in learning.trials])))
        place = names.index(position.state)
        start[place] = middle + experiment.start_scale * (start[place] - middle) + experiment.start_offset
        if position.speed is not None:
            start[names.index(position.speed)] = 0.0
    return start


def _run(member: Explanation, experiment: Experiment, learning: LearningData) -> np.ndarray:
    parameters = member.model.compiled.with_values(member.values)
    start = _start(member, experiment, learning)
    return member.model.compiled.run(experiment.time, experiment.inputs, parameters, start, substeps=2).outputs


def _predictions(
    members: Sequence[Explanation], experiment: Experiment, learning: LearningData, *, limited: bool
) -> list[np.ndarray] | None:
    """Outputs under each explanation; None if one fails or goes where nothing has been recorded."""
    measured = np.concatenate([t.measured for t in learning.trials])
    low, high = measured.min(axis=0), measured.max(axis=0)
    reach = BEYOND * (high - low)
    if is_at_rest(learning):
        units = {v.name: v.unit for v in members[0].model.outputs}  # measured or not
        signals = members[0].model.signals
        reach = np.array([2.5 * OUT_OF_REST.get(units[name], OUT_OF_REST_ELSE) for name in signals])
    runs = []
    for member in members:
        try:
            run = _run(member, experiment, learning)
        except MisfitError:
            return None
        if limited and (np.any(run < low - reach) or np.any(run > high + reach)):
            return None
        runs.append(run)
    return runs


def _distance(a: np.ndarray, b: np.ndarray, learning: LearningData) -> float:
    return float(np.mean(_metric(learning, len(a))(a - b) ** 2))


def _metric(learning: LearningData, samples: int) -> Metric:
    """The metric of the first trial for a record of its first samples.

    The inverse of a leading block of a triangular matrix is that block of its inverse.
    """
    metric = learning.metrics[0]
    if metric.whitener.ndim == 1:
        return metric
    rows = samples // metric.stride * len(learning.floor)
    return Metric(metric.stride, np.ascontiguousarray(metric.whitener[:rows, :rows]))


def _amplitude(member: Explanation, column: int, learning: LearningData) -> float:
    """How far an input that was never driven may be driven to either side: 0, or a power of the square root of 10."""
    first = learning.trials[0]
    found = 0.0
    shape = np.sin(2 * np.pi * np.linspace(0, 1, len(first.time)))
    for amplitude in 10.0 ** np.arange(-8.0, 4.0, 0.5):
        inputs = np.tile(first.inputs.mean(axis=0), (len(first.time), 1))
        inputs[:, column] = amplitude * shape
        if _predictions([member], Experiment("", "", first.time, inputs), learning, limited=True) is None:
            break
        found = float(amplitude)
    return found


def _refitted(members: Sequence[Explanation], experiment: Experiment, learning: LearningData) -> np.ndarray:
    """Separation of each pair, the worse of two: each explanation refitted to the other's prediction.

    The model as given is every effect at no size at all, so it only shows how far it is from them.
    """
    found = []
    for one, other in combinations(members, 2):
        ways = [(a, b) for a, b in ((one, other), (other, one)) if len(a.values) or not len(b.values)]
        found.append(min(_imitated(target, by, experiment, learning) for target, by in ways))
    return np.array(found)


def _imitated(target: Explanation, other: Explanation, experiment: Experiment, learning: LearningData) -> float:
    """Mean squared distance that is left when `other` imitates `target` as well as it can."""
    try:
        wanted = _run(target, experiment, learning)
        start = _start(other, experiment, learning)
        free = np.full(len(start), np.inf)
        spread = np.maximum(0.1 * np.abs(start), 0.02)
        record = Record(experiment.time, experiment.inputs, wanted, start, free, start - spread, start + spread)
        with np.errstate(all="ignore"):  # what a poor imitation says of its own accuracy may overflow
            found = fit(
                other.model.compiled,
                [record],
                np.ones(len(learning.floor)),
                other.values,
                other.low,
                other.high,
                substeps=2,
                reduce=_metric(learning, len(wanted)),
                tolerance=1e-3,
            )
    except MisfitError:
        return 0.0
    return found.cost


def _probability(separation: float, experiment: Experiment, learning: LearningData) -> float:
    rows = len(experiment.time) // learning.metrics[0].stride * len(learning.floor)
    return float(norm.cdf(0.5 * np.sqrt(rows * max(separation, 0.0))))
