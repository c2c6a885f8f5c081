"""The next experiment: the one of the menu that best separates the explanations that remain.

For two explanations i and j the separation is the mean square of y_i - y_j in the metric, where noise is white with
unit variance, after j has been refitted to what i predicts, so that only what refitting cannot imitate counts
(T-optimality: Atkinson and Fedorov 1975; Hunter and Reiner 1965). It is refitted as in a diagnosis of that record:
start values, what a delay held back and a shift of the clock are free as far as they are there. Over N rows the
log-likelihood ratio then has mean N separation/2 and variance N separation, and a diagnosis names the right one where
that is above the odds that it asks for, L = log(20): with the probability Phi((N separation/2 - L)/sqrt(N separation)).
The noise of the inputs is taken to be carried to the outputs as in the first trial.
"""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from fmus.errors import MisfitError
from orchestrator.diagnosis.advise.menu import OUT_OF_REST, Experiment, menu
from orchestrator.diagnosis.advise.thresholds import (
    BEYOND,
    HOPELESS,
    LARGEST,
    MOST_MEMBERS,
    MOST_RECORDS,
    NEARLY_CERTAIN,
    NOTHING,
    OUT_OF_REST_ELSE,
    REFITTED,
)
from orchestrator.diagnosis.decide.excitation import driven, is_at_rest
from orchestrator.diagnosis.decide.thresholds import DECISIVE
from orchestrator.diagnosis.fit.evidence import LearningData
from orchestrator.diagnosis.noise.metric import Metric
from orchestrator.models.correction import PREFIX
from orchestrator.models.estimation import STEEPEST, Prior, fit
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel

INSEPARABLE = "no experiment of the menu separates these, they act alike on what is measured; add another sensor"


@dataclass(frozen=True)
class Explanation:
    """A model with values of its free parameters, their bounds, and start values of the states (nx,).

    `simpler` is the label of an explanation whose law this one holds: refitted, it imitates that one always, and only what
    it has beyond that can tell them apart.
    """

    label: str
    model: SymbolicModel
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    simpler: str = ""


@dataclass(frozen=True)
class Plan:
    """The experiment to do next, and what is expected of it.

    `separation` and `probability` are those of the pair that is told apart worst, without those (`alike`) that no
    experiment is likely to tell apart; `repeat` the same for a repetition of the first trial. `records` of the
    experiment name the right one with near certainty. `considered` lists every experiment of the menu with its
    separation to first order.
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
    records: float = 1.0

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
            if self.records > MOST_RECORDS:
                return INSEPARABLE
            times = int(np.ceil(self.records))
            return f"{self.experiment.do}; one such record will hardly tell them apart, {times} of them will"
        kept = "; ".join(
            f"{one} and {other} act so much alike in all of the menu that they stay one class"
            for one, other in self.alike
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
    simulated, are left out. All explanations of a machine that only rested rank the experiments to first order, those
    that are told apart worst are refitted.

    Args:
        explanations: the models to tell apart, with their parameters, the likeliest first.
        learning: the trials learned from, which say how far inputs and outputs went.
        scale: power of the noise in the metric.

    Returns:
        None for fewer than two explanations, or if no experiment can be simulated.
    """
    resting = is_at_rest(learning)
    members = _at_rest(explanations, learning) if resting else list(explanations[:MOST_MEMBERS])
    if len(members) < 2:
        return None
    variables = members[0].model.inputs
    commands = [i for i, v in enumerate(variables) if not v.name.startswith(PREFIX)]
    amplitudes = {}
    if commands and not driven(learning.trials)[commands].any():
        amplitudes = {i: a for i in commands if (a := _amplitude(members[0], i, learning)) > 0}
    unit = members[0].model.outputs[0].unit if resting else None
    choices = menu(variables, learning.trials, amplitudes, unit)
    rough, sizes = dict[int, np.ndarray](), Counter[str]()
    for k, experiment in enumerate(choices):
        shape = experiment.name.partition(",")[0]
        if resting and sizes[shape] == LARGEST or _predictions(members, experiment, learning, limited=k > 0) is None:
            continue
        each = _to_first_order(members, experiment, learning)
        if each is not None:
            rough[k] = each
            sizes[shape] += 1
    if not rough:
        return None

    def told_apart(found: Mapping[int, np.ndarray]) -> np.ndarray:
        """Which pairs some experiment is likely to tell apart; the others stay a class whatever is done."""
        each = [[_probability(s / scale, choices[k], learning) for s in pair] for k, pair in found.items()]
        return np.max(each, axis=0) >= HOPELESS

    def scores_of(found: Mapping[int, np.ndarray]) -> dict[int, float]:
        """The least separation in each experiment, of the pairs that can be told apart if there are such."""
        able = told_apart(found)
        return {k: float(each[able if able.any() else ~able].min()) for k, each in found.items()}

    first = scores_of(rough)
    shortlist = sorted((k for k in rough if k), key=lambda k: -first[k])[:REFITTED]
    hardest = _hardest(rough[max(first, key=lambda k: first[k])], told_apart(rough), len(members))
    members = [members[i] for i in hardest]
    pairs = {k: _refitted(members, choices[k], learning) for k in (0, *shortlist) if k in rough}
    separable, scores = told_apart(pairs), scores_of(pairs)
    alike = [pair for pair, seen in zip(combinations(members, 2), separable, strict=True) if not seen]
    best = max(scores, key=lambda k: scores[k])
    repeat = scores.get(0, 0.0)
    return Plan(
        experiment=choices[best],
        members=tuple(m.label for m in members),
        separation=scores[best],
        probability=_probability(scores[best] / scale, choices[best], learning),
        repeat=(repeat, _probability(repeat / scale, choices[0], learning)),
        considered=tuple((choices[k].name, value) for k, value in first.items()),
        names=tuple(v.name for v in members[0].model.inputs),
        units=tuple(v.unit for v in members[0].model.inputs),
        alike=tuple((one.label, other.label) for one, other in alike) if separable.any() and not resting else (),
        records=_records(scores[best] / scale, choices[best], learning),
    )


def _at_rest(explanations: Sequence[Explanation], learning: LearningData) -> list[Explanation]:
    """Those of a machine that rested that let it rest; an effect that moves it would have shown."""
    first = learning.trials[0]
    as_it_was = Experiment("repeat", "", first.time, first.inputs)
    return [e for e in explanations if _predictions([e], as_it_was, learning, limited=True)]


def _hardest(separations: np.ndarray, separable: np.ndarray, count: int) -> list[int]:
    """At most `MOST_MEMBERS` of `count` explanations: those of the pairs that are told apart worst, of separable ones first.

    >>> _hardest(np.array([9.0, 1.0, 5.0]), np.array([True, False, True]), 3)
    [0, 1, 2]
    """
    pairs, found = list(combinations(range(count), 2)), set[int]()
    for k in np.lexsort((separations, ~separable)):
        if len(found | set(pairs[k])) <= MOST_MEMBERS:
            found |= set(pairs[k])
    return sorted(found)


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


def _to_first_order(
    members: Sequence[Explanation], experiment: Experiment, learning: LearningData
) -> np.ndarray | None:
    """Separation of each pair after one linear step of the refit, which ranks experiments; None if slopes overflow."""
    try:
        seen = [_reduced(member, experiment, learning) for member in members]
    except MisfitError:
        return None
    found = []
    for pair in combinations(range(len(members)), 2):
        left = []
        for i, j in _ways(members, *pair):
            change, slopes = seen[i][:, :1] - seen[j][:, :1], seen[j][:, 1:]
            step, *_ = np.linalg.lstsq(slopes, change, rcond=1e-9)
            left.append(float(np.mean((change - slopes @ step) ** 2)))
        found.append(min(left))
    return np.array(found)


def _reduced(member: Explanation, experiment: Experiment, learning: LearningData) -> np.ndarray:
    """Outputs of an explanation and their slopes in all that a refit may move, in the metric: (rows, 1 + k)."""
    parameters = member.model.compiled.with_values(member.values)
    start = _start(member, experiment, learning)
    about = (experiment.time, experiment.inputs, parameters, start)
    run = member.model.compiled.run(*about, substeps=2, sensitivities=True)
    assert run.sensitivities is not None
    late = np.gradient(run.outputs, experiment.time, axis=0)[:, :, None] * bool(learning.nuisances.shift_std)
    slopes = np.where(np.abs(run.sensitivities) < STEEPEST, run.sensitivities, 0.0)
    table = np.concatenate([run.outputs[:, :, None], slopes, late], axis=2)
    return _metric(learning, len(table))(table).reshape(-1, table.shape[2])


def _ways(members: Sequence[Explanation], i: int, j: int) -> list[tuple[int, int]]:
    """Which of two is to be imitated by which: the model as given is every effect at no size at all, and a law that holds
    another one is that one without the rest, so that both only show how far it is from them."""
    ways = [(a, b) for a, b in ((i, j), (j, i)) if members[b].simpler != members[a].label]
    return [(a, b) for a, b in ways if len(members[a].values) or not len(members[b].values)]


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
    """Separation of each pair, the worse of two: each explanation refitted to the other's prediction."""
    pairs = combinations(range(len(members)), 2)
    ways = [_ways(members, *pair) for pair in pairs]
    return np.array([min(_imitated(members[i], members[j], experiment, learning) for i, j in each) for each in ways])


def _imitated(target: Explanation, other: Explanation, experiment: Experiment, learning: LearningData) -> float:
    """Mean squared distance that is left when `other` imitates a record of `target` as well as a diagnosis lets it.

    That is no more than before a refit, which may lose its way along a motion that runs away.
    """
    shift = Prior(np.zeros(len(other.values)), np.full(len(other.values), np.inf), learning.nuisances.shift_std)
    metric = _metric(learning, len(experiment.time))
    try:
        wanted = _run(target, experiment, learning)
        as_it_is = float(np.mean(metric(_run(other, experiment, learning) - wanted) ** 2))
        trial = SmoothedTrial(experiment.time, experiment.inputs, wanted, learning.trials[0].noise)
        with np.errstate(all="ignore"):  # what a poor imitation says of its own accuracy may overflow
            found = fit(
                other.model.compiled,
                [other.model.record(trial, other.model.compiled.with_values(other.values))],
                np.ones(len(learning.floor)),
                other.values,
                other.low,
                other.high,
                substeps=2,
                prior=shift,
                reduce=metric,
                tolerance=1e-3,
            )
    except MisfitError:
        return 0.0
    return min(found.misfit / found.rows, as_it_is)


def _worth(separation: float, experiment: Experiment, learning: LearningData) -> float:
    """Twice the mean of the log-likelihood ratio that a record of the experiment gives."""
    rows = len(experiment.time) // learning.metrics[0].stride * len(learning.floor)
    return rows * max(separation, 0.0)


def _probability(separation: float, experiment: Experiment, learning: LearningData) -> float:
    """Chance that a record of the experiment gives the odds that a diagnosis asks for."""
    worth = max(_worth(separation, experiment, learning), NOTHING)
    return float(ndtr((0.5 * worth - np.log(DECISIVE)) / np.sqrt(worth)))


def _records(separation: float, experiment: Experiment, learning: LearningData) -> float:
    """How many records of the experiment give those odds with near certainty: Phi^-1 of it solved for their worth."""
    least = ndtri(NEARLY_CERTAIN)
    needed = (least + np.sqrt(least**2 + 2 * np.log(DECISIVE))) ** 2
    return float(needed / max(_worth(separation, experiment, learning), NOTHING))
