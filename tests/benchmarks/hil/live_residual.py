"""How well the missing torque is known while a session runs: `python -m tests.benchmarks.hil.live_residual [--trials N]`.

Trials on the virtual robot, whose arm has friction at the elbow that nobody is told of; what that takes is known here. The encoders'
angles are made noisier step by step. Two ways are compared: means over windows by differences of momentum, as they follow from the
session's speeds, and the Kalman filter of `hil.emulation.residual`, told a window later; for the live residual the momentum observer
of De Luca and Mattone (2005) and the filter. Learned functions are judged on trials that they have not seen, a third at a time.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil.emulation.anatomy import anatomy
from hil.emulation.corrections import Corrections
from hil.emulation.planar import PLANE
from hil.emulation.residual import Residual
from hil.emulation.settings import Learning
from hil.trials.phases import Phase
from hil.trials.protocol import read_protocol
from tests.hil.trial_session import FRICTION, run_trials

ENCODERS = (0.0, 1e-4, 2e-4, 5e-4)
BANDWIDTH, FOLLOWS, FOLDS = 180.0, 20.0, 3
# Of the windows, as sessions took it before there was the filter.
WINDOW_NOISE = 0.1


@dataclass(frozen=True, eq=False)
class Stream:
    """What cycles showed, (n, 2) each but for times and trials (n,); `truth` N.m is what the links really miss. Trials are 0 between stimulations."""

    time: np.ndarray
    trial: np.ndarray
    q: np.ndarray
    w: np.ndarray
    pull: np.ndarray
    sent: np.ndarray
    truth: np.ndarray

    def noisier(self, deviation: float, seed: int = 3) -> "Stream":
        """With white noise on the angles, and speeds as the safety core takes them from these."""
        if not deviation:
            return self
        q = self.q + deviation * np.random.default_rng(seed).normal(size=self.q.shape)
        w = np.zeros_like(q)
        for k in range(1, len(q)):
            step = self.time[k] - self.time[k - 1]
            w[k] = (w[k - 1] + BANDWIDTH * (q[k] - q[k - 1])) / (1.0 + BANDWIDTH * step)
        return replace(self, q=q, w=w)


Datum = tuple[int, np.ndarray, np.ndarray, np.ndarray]  # cycle, where (4,), torque (2,), deviation (2,)


def windows(stream: Stream, size: float = 0.1) -> tuple[list[Datum], np.ndarray]:
    """Mean missing torques over windows by differences of momentum, and the observer's live residual (n, 2)."""
    body, data, live = anatomy(), [], np.zeros_like(stream.q)
    begin, expected = 0, np.zeros(2)
    momentum = body.mass_matrix(stream.q[0]) @ stream.w[0]
    first = momentum
    for k in range(1, len(stream.time)):
        step, before = stream.time[k] - stream.time[k - 1], momentum
        torque = stream.sent[k] + body.jacobian(stream.q[k]).T @ stream.pull[k]
        rate = body.expected_rate(stream.q[k], stream.w[k], torque)
        momentum = body.mass_matrix(stream.q[k]) @ stream.w[k]
        live[k] = (live[k - 1] + FOLLOWS * (momentum - before - rate * step)) / (1.0 + FOLLOWS * step)
        expected = expected + rate * step
        passed = stream.time[k] - stream.time[begin]
        if not stream.trial[k] or stream.trial[begin] != stream.trial[k]:
            begin, first, expected = k, momentum, np.zeros(2)
        elif passed >= size - 1e-9:
            here = slice(begin + 1, k + 1)
            where = np.concatenate([stream.q[here].mean(axis=0), stream.w[here].mean(axis=0)])
            data.append(((begin + k) // 2, where, (momentum - first - expected) / passed, np.full(2, WINDOW_NOISE)))
            begin, first, expected = k, momentum, np.zeros(2)
    return data, live


class _Listening(Corrections):
    """Keeps what it learns."""

    def __init__(self, learning: Learning) -> None:
        super().__init__(learning)
        self.data: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def _learn(self, where: np.ndarray, torque: np.ndarray, deviation: np.ndarray) -> None:
        self.data.append((where, torque, deviation))


def moments(stream: Stream, learning: Learning) -> tuple[list[Datum], np.ndarray, float]:
    """Missing torques at moments by the filter, its live residual (n, 2), and CPU us of a cycle."""
    residual, listening = Residual(anatomy(), learning), _Listening(learning)
    live, data, marked, began = np.zeros_like(stream.q), [], 0, time.process_time()
    for k in range(len(stream.time)):
        step = stream.time[k] - stream.time[k - 1] if k else 0.0
        live[k] = residual.advance(stream.q[k], stream.w[k], stream.sent[k], stream.pull[k], step)
        at = listening._marked
        listening.advance(residual, stream.q[k], step, bool(stream.trial[k]))
        if len(listening.data) > len(data):
            data.append((marked, *listening.data[-1]))
        if listening._marked is not at:
            marked = k
    return data, live, 1e6 * (time.process_time() - began) / len(live)


def learned(stream: Stream, data: list[Datum], learning: Learning) -> np.ndarray:
    """RMS (2,) in N.m of the learned torque less the truth, on trials that were not learned."""
    inside, errors = np.flatnonzero(stream.trial)[::10], []
    for fold in range(FOLDS):
        corrections = Corrections(learning)
        for cycle, where, torque, deviation in data:
            if stream.trial[cycle] % FOLDS != fold:
                corrections._learn(where, torque, deviation)
        for k in inside[stream.trial[inside] % FOLDS == fold]:
            errors.append(corrections.predict(stream.q[k], stream.w[k]) - stream.truth[k])
    return rms(errors)


def rms(errors: object) -> np.ndarray:
    """Root mean square (2,) of rows."""
    return np.asarray(np.sqrt(np.mean(np.square(errors), axis=0)))  # type: ignore[arg-type]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=21)
    stream = record(parser.parse_args().trials)
    inside = stream.trial > 0
    print(f"truth: {_pair(rms(stream.truth[inside]))} N.m RMS at shoulder and elbow; errors in N.m RMS")
    print(f"{'noise of angles':18s}{'':9s}{'a datum':>18s}{'within 90 %':>14s}{'live residual':>18s}{'learned':>18s}")
    for deviation in ENCODERS:
        seen = stream.noisier(deviation)
        learning = Learning(budget=400, encoder=max(deviation, Learning.encoder))
        by_windows, observed = windows(seen)
        by_filter, filtered, cost = moments(seen, learning)
        for name, data, live, how in (
            ("windows", by_windows, observed, replace(learning, noise=1e-6)),
            ("filter", by_filter, filtered, learning),
        ):
            errors = np.array([torque - seen.truth[k] for k, _, torque, _ in data])
            sure = np.mean(np.abs(errors) < 1.645 * np.array([each[3] for each in data]))
            print(
                f"{deviation:<18g}{name:9s}{_pair(rms(errors)):>18s}{100 * sure:>13.0f} {_pair(rms((live - seen.truth)[inside])):>18s}"
                f"{_pair(learned(seen, data, how)):>18s}",
                flush=True,
            )
    print(f"the filter takes {cost:.0f} us of CPU time a cycle, learning not counted")


def record(trials: int) -> Stream:
    """A session in virtual time; friction at the elbow takes what the arm's speed there makes of it."""
    study = replace(read_protocol("study"), confirm=False)
    with tempfile.TemporaryDirectory() as name:
        some = replace(study, trials=study.trials[:trials])
        session = run_trials(Path(name) / "session", some, keep=True)
    print(f"{trials} trials, faults: {session.summary.faults or 'none'}, cycles: {session.summary.cycles}")
    names = [signal.name for signal in session.controller.signals]
    armed = [k for k, decision in enumerate(session.decisions) if decision.observed.seconds >= 0]
    shown = np.array([session.decisions[k].shown for k in armed])
    sent = np.array([session.decisions[k].observed.sent for k in armed])
    speeds = np.array([session.speeds[k] for k in armed])
    time_s = np.array([session.decisions[k].observed.seconds for k in armed])

    def pair(name: str) -> np.ndarray:
        return shown[:, [names.index(f"{name}{k}") for k in (1, 2)]]

    stimulated = shown[:, names.index("phase")] == Phase.STIMULATE
    trial = np.where(stimulated, shown[:, names.index("trial")], 0).astype(int)
    truth = np.column_stack([np.zeros(len(armed)), -FRICTION * speeds[:, 2]])
    return Stream(time_s, trial, pair("arm_q"), pair("arm_w"), pair("pull"), sent[:, list(PLANE)], truth)


def _pair(values: np.ndarray) -> str:
    return " and ".join(f"{value:.4f}" for value in values)


if __name__ == "__main__":
    main()
