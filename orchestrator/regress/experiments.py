"""The experiment that an FMU brings along with its results."""

from dataclasses import replace

import numpy as np

from orchestrator.cosim.load import load_system
from orchestrator.regress.case import Case, Stimulus
from orchestrator.regress.prepare import model_path
from orchestrator.regress.reference import replay_of


def with_own_experiment(case: Case) -> Case:
    """The case with the inputs, step and end of the experiment whose results its FMU brings along."""
    system = load_system(model_path(case))
    paths = [system.folder / spec.source for spec in system.components.values() if spec.kind == "fmu"]
    replay = replay_of(paths[0]) if len(paths) == 1 else None
    if replay is None:
        return case
    case = replace(
        case,
        stop=case.stop if case.stop is not None else float(replay.results.times[-1]),
        step=case.step or replay.step,
    )
    if case.stimulus.file is not None or case.stimulus.signals:
        return case
    waves = {
        name: as_table(replay.inputs.times, replay.inputs.values[:, k]) for k, name in enumerate(replay.inputs.names)
    }
    return replace(case, stimulus=Stimulus(signals=waves))


def as_table(time: np.ndarray, values: np.ndarray) -> dict[str, object]:
    """A generator that goes through points."""
    return {"kind": "table", "times": np.asarray(time).tolist(), "values": np.asarray(values).tolist()}
